// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "run_program.h"
#include "tangible/scene/csv.h"

namespace tangible {
namespace {

using nlohmann::json;

// A ball that is thrown, bounces twice and rolls.
constexpr char kBallScene[] = R"({"bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.3],
     "velocity": [1, 0], "friction": 0.3, "restitution": 0.5},
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}},
     "friction": 0.3, "restitution": 0.5}],
  "simulation": {"dt": 0.01, "duration": 0.6}})";

constexpr char kQuickTradeoff[] =
    "--dt_factors=2,1,0.5 --repeat_seconds=1e-6 --reference_error=1e-9 ";

class TangibleTradeoffTest : public ProgramTest {
 protected:
  ProgramRun Tradeoff(const std::string& flags, const std::string& scene = kBallScene) const {
    return Run("tangible-tradeoff",
               "'" + Write("scene.json", scene) + "' " + kQuickTradeoff + flags);
  }
  std::string Flag(const std::string& name, const std::string& file) const {
    return "--" + name + "='" + Path(file) + "' ";
  }
  // The poses of the ball of a simulated scene, by time.
  std::map<double, std::vector<double>> Simulate(const json& scene) const {
    const ProgramRun run = Run("tangible-simulate", "'" + Write("run.json", scene.dump()) + "'");
    EXPECT_EQ(run.exit_status, 0) << run.error;
    CsvTable table;
    std::string error;
    EXPECT_TRUE(ParseCsv(run.out, "run", {}, {}, &table, &error)) << error;
    std::map<double, std::vector<double>> poses;
    for (int row = 0; row < static_cast<int>(table.rows.size()); ++row) {
      std::vector<double> numbers(4);
      for (const int column : {0, 2, 3, 4}) {
        EXPECT_TRUE(ReadCell(table, row, column, &numbers[column == 0 ? 0 : column - 1], &error));
      }
      poses[std::round(numbers[0] * 1e6)] = {numbers[1], numbers[2], numbers[3]};
    }
    return poses;
  }
};

TEST_F(TangibleTradeoffTest, PrintsTheFrontsAndWritesAllCells) {
  const ProgramRun run =
      Tradeoff(Flag("out", "r.json") + Flag("report", "r.html") + Flag("picture", "p.svg") +
               "--parameters=gravity/y,bodies/ball/velocity/x");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.error, "");
  EXPECT_EQ(run.out.rfind("commit ", 0), 0u);
  for (const char* expected : {"18 cells measured", "on a front", "fixed semi_implicit_euler, none",
                               "left out: fixed stepping with runge_kutta_4: "}) {
    EXPECT_NE(run.out.find(expected), std::string::npos) << expected << "\n" << run.out;
  }
  const json scene = json::parse(Read(Path("r.json")))["scenes"][0];
  EXPECT_EQ(scene["parameters"], (json{"gravity/y", "bodies/ball/velocity/x"}));
  EXPECT_LE(scene["reference"]["trajectory_error"], 1e-9);
  ASSERT_EQ(scene["cells"].size(), 18u);
  for (const json& cell : scene["cells"]) {
    if (cell["stepping"] == "event") {
      // Accelerations are constant: both are exact but for rounding, which impacts amplify.
      EXPECT_LE(cell["trajectory_error"], 1e-10);
      EXPECT_LE(cell["gradient_error"], 1e-10);
    } else {
      EXPECT_GT(cell["trajectory_error"], 1e-4);
      // A rebound's derivative does not become right with a smaller step.
      EXPECT_GT(cell["gradient_error"], 1e-2);
    }
  }
  EXPECT_EQ(Read(Path("p.svg")).rfind("<svg", 0), 0u);
  EXPECT_NE(Read(Path("r.html")).find("fixed semi_implicit_euler, none"), std::string::npos);
}

// The block, put into the scene and run again, is as right as was asked for.
TEST_F(TangibleTradeoffTest, ThePrintedBlockMeetsTheTarget) {
  json exact = json::parse(kBallScene);
  exact["simulation"] = {
      {"dt", 0.0005}, {"duration", 0.6}, {"stepping", "event"}, {"integrator", "runge_kutta_4"}};
  const auto reference = Simulate(exact);
  for (const double target : {0.1, 0.02, 1e-6}) {
    const ProgramRun run = Tradeoff("--target=trajectory --target_error=" + std::to_string(target));
    ASSERT_EQ(run.exit_status, 0) << run.error;
    EXPECT_EQ(run.error, "");
    EXPECT_EQ(run.out.rfind("\"simulation\": {", 0), 0u) << run.out;
    json scene = json::parse(kBallScene);
    scene["simulation"] = json::parse("{" + run.out + "}")["simulation"];
    if (target < 1e-3) {
      EXPECT_EQ(scene["simulation"]["stepping"], "event");
    }
    const auto poses = Simulate(scene);
    // Samples are twenty equal times; the length is at most the ball's way, 0.6 m, by 0.2 m.
    double worst = 0.0;
    for (int k = 0; k <= 20; ++k) {
      const double time = 30000.0 * k;
      ASSERT_TRUE(poses.count(time) == 1 && reference.count(time) == 1) << time;
      const std::vector<double>& pose = poses.at(time);
      const std::vector<double>& right = reference.at(time);
      worst = std::max(worst, std::hypot(pose[0] - right[0], pose[1] - right[1]));
    }
    EXPECT_LE(worst, target * std::hypot(0.6, 0.2));
  }
}

// The scenes that the README shows, with one step length: each has a reference by event stepping,
// and of several scenes there is one picture.
TEST_F(TangibleTradeoffTest, ScenesOfTheReadmeRun) {
  const std::string folder = TANGIBLE_SOURCE_DIR "/data/tradeoff_scenes/";
  const ProgramRun run =
      Run("tangible-tradeoff", "'" + folder + "stack.json' '" + folder + "billiards.json' '" +
                                   folder + "pendulum.json' '" + folder +
                                   "falling_discs.json' --dt_factors=0.5 " +
                                   "--repeat_seconds=1e-6 " + Flag("picture", "p.svg"));
  ASSERT_EQ(run.exit_status, 0) << run.error;
  for (const char* expected : {"\nstack\n", "\nbilliards\n", "\npendulum\n", "\nfalling discs\n"}) {
    EXPECT_NE(run.out.find(expected), std::string::npos) << run.out;
  }
  EXPECT_EQ(run.out.find("reference: fixed"), std::string::npos) << run.out;
  EXPECT_EQ(run.out.find("did not come within"), std::string::npos) << run.out;
  EXPECT_NE(Read(Path("p.svg")).find("billiards"), std::string::npos);
}

TEST_F(TangibleTradeoffTest, BothErrorsCountUnlessOneIsNamed) {
  // At 0.05 the trajectory of a fixed step is right, its gradient never.
  const ProgramRun both = Tradeoff("--target_error=0.05");
  ASSERT_EQ(both.exit_status, 0) << both.error;
  EXPECT_EQ(json::parse("{" + both.out + "}")["simulation"]["stepping"], "event");
}

TEST_F(TangibleTradeoffTest, ATargetThatNothingMeetsIsOneLine) {
  const ProgramRun run = Tradeoff("--target_error=1e-15");
  ExpectOneLine(run, 1, "scene.json: expected settings with errors <= 1e-15, got none: the least");
  EXPECT_EQ(run.out, "");
}

TEST_F(TangibleTradeoffTest, BadInputIsOneLine) {
  ExpectOneLine(Tradeoff("--parameters=bodies/bal/mass"), 1,
                "scene.json: parameter bodies/bal/mass: matches no number");
  ExpectOneLine(Tradeoff("", R"({"bodies": []})"), 1, "/bodies: expected a moving body, got none");
  std::string still = kBallScene;
  still.replace(still.find("0.6}"), 4, "0}");
  ExpectOneLine(Tradeoff("", still), 1, "/simulation/duration: expected a number > 0, got 0");
  std::string fine = kBallScene;
  fine.replace(fine.find("0.01"), 4, "1e-9");
  ExpectOneLine(Tradeoff("", fine), 1, "/simulation/dt: expected at most 1e6 steps");
  ExpectOneLine(Run("tangible-tradeoff", "/nonexistent.json"), 1, "/nonexistent.json");
  ExpectOneLine(Tradeoff("--out=/nonexistent/r.json"), 1, "/nonexistent/r.json");
}

TEST_F(TangibleTradeoffTest, WrongFlagsAreUsage) {
  for (const char* flag : {"--target_error=-1", "--target_error=nan", "--target=speed",
                           "--dt_factors=", "--dt_factors=1,x", "--dt_factors=0", "--budget=0",
                           "--budget=inf", "--repeat_seconds=-1", "--reference_error=0",
                           "--reference_seconds=nan", "--threads=0", "--threads=1000"}) {
    const std::string name(flag, std::string(flag).find('='));
    ExpectOneLine(Tradeoff(flag), 2, name);
  }
  const std::string scene = "'" + Write("scene.json", kBallScene) + "' ";
  ExpectOneLine(Run("tangible-tradeoff", scene + scene + "--target_error=1"), 2, "--target_error");
  ExpectOneLine(Run("tangible-tradeoff", ""), 2, "tangible-tradeoff");
}

}  // namespace
}  // namespace tangible
