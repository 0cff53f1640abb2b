// SPDX-License-Identifier: Apache-2.0
//
// Nulls in the results of programs: none where a status says that there is a result, but for those
// that lib/app/README.md lists.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "../support/thorough.h"
#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

const std::set<std::string> kMayBeNull = {"margin_min",
                                          "condition",
                                          "down",
                                          "up",
                                          "growth",
                                          "undetermined_end",
                                          "impulses",
                                          "motions",
                                          "farkas",
                                          "confidence_95",
                                          "confidence_95_robust",
                                          "standard_deviation",
                                          "standard_deviation_robust",
                                          "degrees_of_freedom",
                                          "covariance",
                                          "bandwidth",
                                          "residual_correlation",
                                          "whiteness_p_value",
                                          "reduced_chi_square",
                                          "product",
                                          "plain_cost",
                                          "tried_cost",
                                          "interval",
                                          "rms_in_sigma",
                                          "rms_length",
                                          "max_length",
                                          "rms_angle",
                                          "max_angle",
                                          "prediction_rms",
                                          "energy_start",
                                          "energy_end"};
// Those of single programs, by the rest of their names.
const std::map<std::string, std::set<std::string>> kMayBeNullIn = {
    {"closed_forms", {"value_order", "derivative_order"}},
    {"cost", {"parameters", "measured", "holds"}},
    {"verify", {"error", "ridders_error"}},
    {"extremes", {"differences", "bound", "gradient"}},
    {"cartpole", {"low", "high"}}};

bool IsDone(const json& object) {
  static const std::set<std::string> good = {"done", "solved", "converged"};
  return !object.contains("status") || !object["status"].is_string() ||
         good.count(object["status"].get<std::string>()) > 0;
}

/// Adds the keys below which something is null, but shall not be. What says that it failed (one
/// start of several) may have any.
void FindNulls(const json& value, const std::string& key, const std::set<std::string>& may_be,
               std::vector<std::string>* found) {
  if (value.is_null()) {
    if (kMayBeNull.count(key) + may_be.count(key) == 0) found->push_back(key);
  } else if (value.is_array()) {
    for (const json& item : value) FindNulls(item, key, may_be, found);
  } else if (value.is_object() && IsDone(value)) {
    for (const auto& [name, item] : value.items()) FindNulls(item, name, may_be, found);
  }
}

/// Those of a result of the program tangible-`name`.
std::vector<std::string> NullsOf(const json& result, std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  const auto known = kMayBeNullIn.find(name);
  std::vector<std::string> found;
  FindNulls(result, "", known == kMayBeNullIn.end() ? std::set<std::string>() : known->second,
            &found);
  return found;
}

class NullsTest : public ProgramTest {
 protected:
  /// Status 0 comes with a result that has no other nulls, and any other status with one line.
  void Check(const std::string& program, const std::string& arguments, const std::string& out) {
    SCOPED_TRACE(program + " " + arguments);
    std::filesystem::remove(Path("r.json"));
    const ProgramRun run = Run(program, arguments + " --" + out + "='" + Path("r.json") + "'");
    if (!std::filesystem::exists(Path("r.json"))) {
      ExpectOneLine(run, 1, "");
      return;
    }
    const json result = json::parse(Read(Path("r.json")));
    EXPECT_EQ(run.exit_status == 0, IsDone(result)) << run.error << result.value("status", "");
    EXPECT_EQ(NullsOf(result, program.substr(program.find('-') + 1)), std::vector<std::string>());
  }
};

const std::string kData = TANGIBLE_SOURCE_DIR "/data/";

TEST_F(NullsTest, ThoseOfShippedScenes) {
  for (const char* scene : {"bouncing_ball", "chain", "double_pendulum", "driven_slider",
                            "recording_single_pendulum", "sliding_box"}) {
    const std::string file = "'" + kData + "scenes/" + scene + ".json'";
    Check("tangible-simulate", file + " --certify --every=1000", "summary");
    Check("tangible-gradient", file + " --parameters=gravity/y", "out");
  }
}

TEST_F(NullsTest, ThoseOfShippedFitsAndPlans) {
  Check("tangible-fit", "'" + kData + "fits/chain.json'", "out");
  Check("tangible-control", "'" + kData + "control/pushed_box_to_mark.json'", "out");
}

// Numbers near the ends of their range, and runs of next to nothing.
TEST_F(NullsTest, ThoseOfExtremeNumbers) {
  int file = 0;
  for (const char* stepping : {"fixed", "event"}) {
    for (const char* speed : {"0", "1e-200", "1e100", "1e154", "1e200", "1e308"}) {
      for (const char* duration : {"0", "0.01", "0.5"}) {
        json scene = json::parse(R"({"gravity": [0, 0], "bodies": [
            {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0]}],
          "forces": [{"name": "f", "body": "b", "force": [0, 0]}],
          "simulation": {"dt": 0.01}})");
        scene["bodies"][0]["velocity"] = {json::parse(speed), 0};
        scene["simulation"]["duration"] = json::parse(duration);
        scene["simulation"]["stepping"] = stepping;
        const std::string name = "s" + std::to_string(file++) + ".json";
        const std::string path = "'" + Write(name, scene.dump()) + "'";
        Check("tangible-simulate", path + " --certify", "summary");
        Check("tangible-gradient", path + " --parameters=bodies/b/mass,forces/f/force/x", "out");
        const json plan = {{"scene", name},
                           {"horizon", 0.05},
                           {"controls", {{{"path", "forces/f/force/x"}, {"low", -1}, {"high", 1}}}},
                           {"cost",
                            {{{"state", "b/x"}, {"target", 1}, {"at", "end"}},
                             {{"control", "forces/f/force/x"}, {"weight", 0.1}}}},
                           {"mpc", {{"duration", 0.05}, {"horizon", 0.03}}}};
        const std::string problem = "'" + Write("p.json", plan.dump()) + "'";
        Check("tangible-control", problem, "out");
        Check("tangible-control", problem + " --mpc", "out");
        Write("o.csv", "time,body,x,y\n0,b,0.01,0\n");
        const json fit = {{"scene", name},
                          {"observations", {{{"file", "o.csv"}, {"sigma", 0.01}}}},
                          {"parameters", {"bodies/b/position/x"}}};
        Check("tangible-fit", "'" + Write("f.json", fit.dump()) + "'", "out");
      }
    }
  }
}

// What studies and the verification write, in small; with experiments it takes a minute longer,
// and theirs are among the shipped results too.
TEST_F(NullsTest, ThoseOfStudies) {
  Check("tangible-corpus", "--random=3 --contacts=20 --seed=3", "out");
  Check("tangible-extremes", "--group=paradox", "out");
  for (const char* stepping : {"fixed", "event"}) {
    Check("tangible-cost",
          "--parameters=1,8 --steps=5 --long_run=20 --repeat_seconds=0.001 --nobounds --stepping=" +
              std::string(stepping),
          "out");
  }
  Check("tangible-tradeoff", "'" + kData + "scenes/bouncing_ball.json' --repeat_seconds=0.001",
        "out");
  Check("tangible-verify", "--random=1 --starts=1 --coincidences=1 --seed=2", "out");
  Check("tangible-bounce", "'" + kData + "control/struck_ball.json' --problems=2 --iterations=3",
        "out");
  Check("tangible-closed-forms", "", "out");
  if (testing::Thorough()) {
    Check("tangible-cartpole", "--quick", "out");
    Check("tangible-breakout", "--quick --games=1", "out");
  }
}

// The results that are shipped were written by the programs at their full sizes.
TEST_F(NullsTest, ThoseOfShippedResults) {
  // Those of programs that take minutes, or read recordings that are not shipped, among them.
  std::set<std::string> missing = {"recordings.json", "vision.json", "vision_all.json"};
  for (const auto& entry : std::filesystem::directory_iterator(kData + "results")) {
    if (entry.path().extension() != ".json") continue;
    SCOPED_TRACE(entry.path());
    std::string name = entry.path().stem().string();
    if (const size_t by_events = name.find("_event"); by_events != std::string::npos) {
      name.resize(by_events);
    }
    EXPECT_EQ(NullsOf(json::parse(Read(entry.path().string())), name), std::vector<std::string>());
    missing.erase(entry.path().filename().string());
  }
  EXPECT_EQ(missing, std::set<std::string>());
}

// The tables of cells that were trained before; training one takes minutes.
TEST_F(NullsTest, ThoseOfVision) {
  if (!std::filesystem::exists(TANGIBLE_PROGRAM_DIR "/tangible-vision")) GTEST_SKIP();
  std::string cells;
  const json shipped = json::parse(Read(kData + "results/vision.json"));
  for (const json& cell : shipped["cells"]) {
    const std::string name = cell["cell"];
    Write(name + ".json", cell.dump());
    cells += (cells.empty() ? "" : ",") + name;
  }
  Check("tangible-vision", "--cells=" + cells + " --folder='" + Path("") + "'", "out");
}

// An import writes observations: each cell is a name, a finite number or empty.
TEST_F(NullsTest, ThoseOfImports) {
  for (const char* value : {"1", "", "1e-300", "1e300", "1e400", "nan", "inf", "null"}) {
    SCOPED_TRACE(value);
    const std::string table =
        Write("t.csv", std::string("t,a\n0,1\n1,") + value + "\n2,2\n3,3\n4,1\n");
    const std::string mapping = Write(
        "m.json", R"({"time": "t", "columns": [{"column": "a", "body": "b", "coordinate": "x"}]})");
    std::filesystem::remove(Path("o.csv"));
    const ProgramRun run =
        Run("tangible-import-recording", "'" + table + "' --kind=table --scale=1e10 --mapping='" +
                                             mapping + "' --out='" + Path("o.csv") + "'");
    if (run.exit_status != 0) {
      ExpectOneLine(run, 1, "");
      continue;
    }
    std::istringstream written(Read(Path("o.csv")));
    std::string line, cell;
    std::getline(written, line);
    EXPECT_EQ(line, "time,body,x");
    while (std::getline(written, line)) {
      std::istringstream cells(line);
      while (std::getline(cells, cell, ',')) {
        if (cell.empty() || cell == "b") continue;
        char* end = nullptr;
        EXPECT_TRUE(std::isfinite(std::strtod(cell.c_str(), &end)) && *end == '\0') << line;
      }
    }
  }
}

TEST_F(NullsTest, ThoseOfLinearComplementarity) {
  for (const char* problem :
       {R"({"F": [[2, 1], [1, 2]], "c": [-5, -6]})", R"({"F": [[0]], "c": [-1]})",
        R"({"F": [[1e-300]], "c": [-1e200]})", R"({"F": [[1e300]], "c": [1e300]})"}) {
    Check("tangible-lcp", "'" + Write("l.json", problem) + "'", "out");
  }
}

}  // namespace
}  // namespace tangible
