// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "../support/scenes.h"
#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleVerifyTest : public ProgramTest {
 protected:
  ProgramRun Verify(const std::string& arguments) const {
    return Run("tangible-verify", arguments);
  }
  std::string Scene() const { return Write("scene.json", test_scenes::Mixture()); }
};

TEST_F(TangibleVerifyTest, ASceneIsCheckedAndWritten) {
  const ProgramRun run =
      Verify("'" + Scene() + "' --parameters='bodies/ball/mass,gravity/y' --out='" +
             Path("r.json") + "' --report='" + Path("r.html") + "' --jacobians");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.error, "");
  EXPECT_EQ(run.out.rfind("commit ", 0), 0u) << run.out;
  EXPECT_NE(run.out.find("bodies/mass"), std::string::npos);
  EXPECT_NE(run.out.find("1 scenes, 0 not run; 36 entries"), std::string::npos) << run.out;
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["verdict"], "");
  EXPECT_NE(result["provenance"]["compiler"], "");
  EXPECT_EQ(result["scenes"][0]["rows"].size(), 2u);
  EXPECT_EQ(result["scenes"][0]["jacobians"]["outputs"].size(), 18u);
  const std::string page = Read(Path("r.html"));
  EXPECT_EQ(page.rfind("<!DOCTYPE html>", 0), 0u);
  EXPECT_NE(page.find("Every bound holds."), std::string::npos);
}

TEST_F(TangibleVerifyTest, RandomScenesAreTheSameForAnyNumberOfThreads) {
  std::string results[2];
  for (int k = 0; k < 2; ++k) {
    const ProgramRun run = Verify("--random=3 --seed=40 --threads=" + std::to_string(1 + k) +
                                  " --out='" + Path("r.json") + "'");
    ASSERT_EQ(run.exit_status, 0) << run.error;
    json result = json::parse(Read(Path("r.json")));
    result.erase("provenance");
    results[k] = result.dump();
    EXPECT_EQ(result["scenes"].size() % 3, 0u);  // each in every stepping
    EXPECT_EQ(result["scenes"][0]["name"], "random 40");
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST_F(TangibleVerifyTest, TheCommandPrintedReplaysAScene) {
  const ProgramRun many =
      Verify("--random=2 --seed=41 --stepping=fixed --out='" + Path("many.json") + "'");
  ASSERT_EQ(many.exit_status, 0) << many.error;
  const json all = json::parse(Read(Path("many.json")));
  const std::string replay = all["scenes"][1]["replay"];
  EXPECT_EQ(replay, "tangible-verify --random=1 --seed=42 --stepping=fixed");
  const ProgramRun one =
      Verify(replay.substr(replay.find("--")) + " --out='" + Path("one.json") + "'");
  ASSERT_EQ(one.exit_status, 0) << one.error;
  EXPECT_EQ(json::parse(Read(Path("one.json")))["scenes"][0], all["scenes"][1]);
}

TEST_F(TangibleVerifyTest, StartsAreCheckedAloneOrBesideRandomScenes) {
  const ProgramRun starts =
      Verify("--starts=2 --seed=7 --stepping=event --out='" + Path("starts.json") + "'");
  ASSERT_EQ(starts.exit_status, 0) << starts.error;
  EXPECT_NE(starts.out.find("2 random starts from seed 7"), std::string::npos);
  const json alone = json::parse(Read(Path("starts.json")));
  ASSERT_EQ(alone["scenes"].size(), 2u);
  EXPECT_EQ(alone["scenes"][1]["name"], "start 8");
  const ProgramRun both =
      Verify("--random=1 --starts=1 --seed=8 --stepping=event --out='" + Path("both.json") + "'");
  ASSERT_EQ(both.exit_status, 0) << both.error;
  const json beside = json::parse(Read(Path("both.json")));
  ASSERT_EQ(beside["scenes"].size(), 2u);
  EXPECT_EQ(beside["scenes"][0]["name"], "random 8");
  EXPECT_EQ(beside["scenes"][1], alone["scenes"][1]);
}

TEST_F(TangibleVerifyTest, ErrataAreATable) {
  const ProgramRun run = Verify("--errata");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.out.find("printed: sign of F"), std::string::npos);
  EXPECT_NE(run.out.find("| friction |"), std::string::npos);
}

TEST_F(TangibleVerifyTest, WrongUsageAndBadInputAreOneLine) {
  for (const char* flags :
       {"--random=-2", "--random=0", "--starts=-2", "--starts=0", "--seed=-1", "--threads=-1",
        "--threads=1000", "--stepping=leap", "--parameters=gravity/x", "--errata --out=x.json",
        "--unknown", "--random=many"}) {
    SCOPED_TRACE(flags);
    ExpectOneLine(Verify(flags), 2, "tangible-verify");
  }
  ExpectOneLine(Verify("nowhere.json"), 1, "nowhere.json");
  ExpectOneLine(Verify("'" + Scene() + "' --parameters=bodies/bal/mass"), 1, "bodies/bal/mass");
  ExpectOneLine(Verify("--random=1 --out=/nowhere/r.json"), 1, "/nowhere/r.json");
  EXPECT_EQ(Verify("--help").exit_status, 0);
  EXPECT_EQ(Verify("--version").exit_status, 0);
}

// A body that two kinematic ones press together has nowhere to go.
TEST_F(TangibleVerifyTest, ASceneThatDoesNotRunFails) {
  const std::string scene = Write("press.json", R"({"bodies": [
    {"name": "a", "shape": {"box": {"size": [1, 0.2]}}, "mass": 1, "position": [0, 0.1]},
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
    {"name": "press", "kinematic": true, "shape": {"box": {"size": [1, 0.2]}},
     "position": [0, 0.301], "velocity": [0, -1]}],
    "simulation": {"dt": 0.01, "duration": 0.1}})");
  const ProgramRun run = Verify("'" + scene + "'");
  ExpectOneLine(run, 1, "press.json");
  EXPECT_NE(run.out.find("not run"), std::string::npos);
}

}  // namespace
}  // namespace tangible
