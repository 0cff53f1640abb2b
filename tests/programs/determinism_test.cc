// SPDX-License-Identifier: Apache-2.0
//
// The same bits every time: trajectories and gradients of every scene in data and of twenty extreme
// ones, in both steppings, as hashes, over repeats, threads, processes, and against a list.
//
// sin, cos and their like round in other ways on other processors and with other libraries. The
// list carries a fingerprint of them; where this machine's is another, a line says that the list
// was not compared, and all else is.
//
// After a change that may move results by rounding:  cmake --build build/release --target
// golden_hashes  writes the list anew.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "../support/sanitizers.h"
#include "extreme_scenes.h"
#include "run_program.h"
#include "tangible/dynamics/model/settings.h"
#include "tangible/math/bit_hash.h"
#include "tangible/scene/scene_json.h"
#include "tangible/simulation/gradient/batch.h"

namespace tangible {
namespace {

using nlohmann::json;

constexpr char kFolder[] = TANGIBLE_SOURCE_DIR;
constexpr char kList[] = TANGIBLE_SOURCE_DIR "/tests/programs/golden_hashes.txt";
constexpr char kListTo[] = "TANGIBLE_GOLDEN_OUT";
constexpr int kMostSteps = 60;
constexpr int kMostStepsByEvents = 4;

/// The functions of the mathematics library that the engine calls.
std::string Fingerprint() {
  BitHash hash;
  for (int i = 0; i < 4000; ++i) {
    const double x = 1e-3 * i * i - 7.0 + 1.0 / (1 + i);
    const double y = 1.7 - 2.3e-3 * i;
    for (const double value :
         {std::sin(x), std::cos(x), std::tan(y), std::atan2(x, y), std::hypot(x, y), std::exp(y),
          std::log(std::abs(x)), std::pow(std::abs(x), y), std::acos(y / 10.0), std::cbrt(x)}) {
      hash.Add(value);
    }
  }
  return hash.Text();
}

struct NamedScene {
  std::string name;
  Scene scene;
};

void AddScene(const std::string& name, Scene scene, std::vector<NamedScene>* scenes) {
  SimulationSettings& settings = scene.simulation;
  const int most = settings.stepping == Stepping::kEvent ? kMostStepsByEvents : kMostSteps;
  settings.duration = std::min(settings.duration, most * settings.dt);
  scenes->push_back({name, std::move(scene)});
}

std::vector<NamedScene> AllScenes() {
  std::vector<NamedScene> scenes;
  std::string error;
  for (const std::string folder : {"scenes", "event_scenes", "tradeoff_scenes"}) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string(kFolder) + "/data/" + folder)) {
      if (entry.path().extension() == ".json") {
        files.push_back(entry.path());
      }
    }
    std::sort(files.begin(), files.end());
    for (const auto& file : files) {
      Scene scene;
      EXPECT_TRUE(LoadScene(file.string(), &scene, &error)) << error;
      AddScene(folder + "/" + file.stem().string(), std::move(scene), &scenes);
    }
  }
  for (ExtremeScene& extreme : ExtremeScenes()) {
    for (const std::string stepping : {"fixed", "event"}) {
      json& settings = extreme.scene["simulation"];
      settings["stepping"] = stepping;
      if (stepping == "event") {
        settings["integrator"] = "trapezoidal";
      }
      Scene scene;
      EXPECT_TRUE(ParseScene(extreme.scene.dump(), extreme.name, "", &scene, &error)) << error;
      AddScene(extreme.name + "/" + stepping, std::move(scene), &scenes);
    }
  }
  return scenes;
}

/// Gravity, the last moving body's mass and its friction: each acts in nearly every scene.
std::vector<ParameterPath> ParametersOf(const Scene& scene) {
  std::string last;
  for (const auto& body : scene.bodies) {
    if (body.motion == Motion::kMoving) {
      last = body.name;
    }
  }
  std::vector<ParameterPath> parameters;
  for (const std::string& path : {std::string("gravity/y"), "bodies/" + last + "/mass",
                                  "bodies/" + last + "/linear_damping"}) {
    ParameterPath parameter;
    std::string error;
    EXPECT_TRUE(ResolveParameter(scene, path, &parameter, &error)) << error;
    parameters.push_back(parameter);
  }
  return parameters;
}

void AddState(const State<double>& state, BitHash* hash) {
  hash->AddAll(state.pose);
  hash->AddAll(state.twist);
}

std::string TrajectoryHash(const Scene& scene) {
  Model<double> model;
  State<double> initial;
  State<double> final;
  BuildModel(scene, &model, &initial);
  BitHash hash;
  const RolloutReport report = Rollout(
      model, initial,
      [&](long k, double t, const State<double>& state, Stepper*) {
        hash.Add(static_cast<int>(k));
        hash.Add(t);
        AddState(state, &hash);
      },
      &final);
  hash.Add(static_cast<int>(report.status));
  AddState(final, &hash);
  return hash.Text();
}

/// Final states and Jacobians at two points.
std::string GradientHash(const Scene& scene, BatchDerivative derivative, int threads) {
  const std::vector<ParameterPath> parameters = ParametersOf(scene);
  constexpr int kRows = 2;
  RowMatrixXd values(kRows, static_cast<Eigen::Index>(parameters.size()));
  for (int row = 0; row < kRows; ++row) {
    for (Eigen::Index k = 0; k < values.cols(); ++k) {
      values(row, k) = parameters[static_cast<size_t>(k)].value * (1.0 + 0.01 * row);
    }
  }
  const BatchResult batch =
      RunBatch(scene, parameters, values, {.threads = threads, .derivative = derivative});
  EXPECT_EQ(batch.message, "");
  BitHash hash;
  for (const BatchRow& row : batch.rows) {
    hash.Add(NameOf(row.status));
    hash.Add(row.message);
    AddState(row.final, &hash);
    hash.AddAll(row.jacobian);
    for (Eigen::Index i = 0; i < row.jacobian.size(); ++i) {
      EXPECT_TRUE(std::isfinite(row.jacobian.data()[i]));
    }
  }
  return hash.Text();
}

/// "trajectory tangent adjoint" by scene.
using Hashes = std::map<std::string, std::string>;

Hashes HashesWith(int threads) {
  Hashes hashes;
  for (const NamedScene& named : AllScenes()) {
    hashes[named.name] = TrajectoryHash(named.scene) + " " +
                         GradientHash(named.scene, BatchDerivative::kTangent, threads) + " " +
                         GradientHash(named.scene, BatchDerivative::kAdjoint, threads);
  }
  return hashes;
}

std::string TextOf(const Hashes& hashes) {
  std::string text = "arithmetic " + Fingerprint() + "\n";
  for (const auto& [name, hash] : hashes) {
    text += name + " " + hash + "\n";
  }
  return text;
}

/// The lines of one text that the other lacks.
std::string Missing(const std::string& of, const std::string& in) {
  std::string missing;
  std::istringstream lines(of);
  for (std::string line; std::getline(lines, line);) {
    missing += in.find(line + "\n") == std::string::npos ? "\n" + line : "";
  }
  return missing;
}

using DeterminismTest = ProgramTest;

TEST_F(DeterminismTest, TheSameBitsOverThreadsRepeatsProcessesAndTheList) {
  if (const char* to = std::getenv(kListTo)) {
    std::ofstream(to) << TextOf(HashesWith(1));
    return;
  }
  const std::string mine = TextOf(HashesWith(2));
  ASSERT_GE(std::count(mine.begin(), mine.end(), '\n'), 50);
  if (!testing::kSanitized) {  // ten times slower: once, and against the list
    EXPECT_EQ(Missing(mine, TextOf(HashesWith(1))), "") << "with one thread";
    const std::string own = std::filesystem::read_symlink("/proc/self/exe").string();
    const std::string command = "TMPDIR='" + Path("") + "' " + kListTo + "='" + Path("other.txt") +
                                "' '" + own + "' --gtest_filter='*TheSameBits*' > /dev/null";
    ASSERT_EQ(std::system(command.c_str()), 0);
    EXPECT_EQ(Missing(mine, Read(Path("other.txt"))), "") << "in another process";
  }

  const std::string list = Read(kList);
  if (list.substr(0, list.find('\n')) != mine.substr(0, mine.find('\n'))) {
    std::printf("%s: not compared: written with another arithmetic (%s), here %s\n", kList,
                list.substr(0, list.find('\n')).c_str(), Fingerprint().c_str());
    return;
  }
  EXPECT_EQ(Missing(list, mine), "") << "scenes that are gone, or whose results changed";
  EXPECT_EQ(Missing(mine, list), "")
      << "if results may have changed by rounding, write the list anew: cmake "
         "--build build/release --target golden_hashes";
}

TEST_F(DeterminismTest, TheProgramsTableIsTheSameForAnyNumberOfThreads) {
  for (const std::string name : {"scenes/sliding_box", "event_scenes/dropped_ball"}) {
    const std::string scene = std::string(kFolder) + "/data/" + name + ".json";
    Write("rows.csv", "gravity/y\n-9.81\n-9.8\n-9.7\n-9.6\n-3\n");
    std::string first;
    for (const std::string threads : {"1", "2", "2", "5"}) {
      const ProgramRun run =
          Run("tangible-simulate",
              "'" + scene + "' --batch='" + Path("rows.csv") + "' --threads=" + threads);
      EXPECT_EQ(run.exit_status, 0) << run.error;
      first = first.empty() ? run.out : first;
      EXPECT_EQ(run.out, first) << name << ", " << threads << " threads";
    }
  }
}

// A hash that stayed the same whatever the numbers would compare nothing.
TEST_F(DeterminismTest, TheHashesChangeWithOneBit) {
  std::vector<NamedScene> scenes = AllScenes();
  Scene& scene = scenes.front().scene;
  const std::string trajectory = TrajectoryHash(scene);
  const std::string tangent = GradientHash(scene, BatchDerivative::kTangent, 1);
  const std::string adjoint = GradientHash(scene, BatchDerivative::kAdjoint, 1);
  scene.gravity.y() = std::nextafter(scene.gravity.y(), 0.0);
  EXPECT_NE(TrajectoryHash(scene), trajectory);
  EXPECT_NE(GradientHash(scene, BatchDerivative::kTangent, 1), tangent);
  EXPECT_NE(GradientHash(scene, BatchDerivative::kAdjoint, 1), adjoint);
}

}  // namespace
}  // namespace tangible
