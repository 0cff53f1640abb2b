// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleCostTest : public ProgramTest {
 protected:
  ProgramRun Cost(const std::string& arguments) const { return Run("tangible-cost", arguments); }
};

constexpr char kQuick[] = "--parameters=1,8 --steps=5 --long_run=20 --repeat_seconds=0.005 ";

TEST_F(TangibleCostTest, PrintsATableAndWritesJsonAndAPicture) {
  const ProgramRun run = Cost(std::string(kQuick) + "--out='" + Path("r.json") + "' --picture='" +
                              Path("p.svg") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.error, "");
  EXPECT_EQ(run.out.rfind("commit ", 0), 0u) << run.out;
  for (const char* expected : {"5 steps: one rollout ", "checkpointed adjoint ", "unrolled ADOL-C ",
                               "takes less time than another", "not checked"}) {
    EXPECT_NE(run.out.find(expected), std::string::npos) << expected << "\n" << run.out;
  }
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["verdict"], "");
  EXPECT_NE(result["provenance"]["cpu"], "");
  EXPECT_EQ(result["cells"].size(), 15u);
  EXPECT_EQ(result["long_run"]["steps"], 20);
  EXPECT_EQ(Read(Path("p.svg")).rfind("<svg", 0), 0u);
}

// By events: all but the tape.
TEST_F(TangibleCostTest, StepsByEvents) {
  const ProgramRun run =
      Cost(std::string(kQuick) + "--stepping=event --out='" + Path("r.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.out.find("by events with runge_kutta_4"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("fixed alone"), std::string::npos);
  for (const json& cell : json::parse(Read(Path("r.json")))["cells"]) {
    EXPECT_EQ(cell.contains("ratio"), cell["method"] != "unrolled ADOL-C") << cell;
  }
}

// The shortest bounded run, a thousand steps, and bounds that nothing holds.
TEST_F(TangibleCostTest, ABrokenBoundIsExitStatusOne) {
  const std::string broken =
      "--parameters=1 --steps=1000 --long_run=20 --repeat_seconds=0.005 --budget_seconds=2 "
      "--adjoint_bound=0.1 ";
  const ProgramRun run = Cost(broken);
  EXPECT_EQ(run.exit_status, 1);
  EXPECT_EQ(run.error.rfind("tangible-cost: adjoint, any number of parameters: rollouts ", 0), 0u)
      << run.error;
  EXPECT_NE(run.error.find("expected at most 0.1\n"), std::string::npos) << run.error;
  EXPECT_NE(run.out.find("does not hold"), std::string::npos);
  EXPECT_EQ(Cost(broken + "--bounds=false").exit_status, 0);
}

TEST_F(TangibleCostTest, ScenesInMotionBesideSettledOnes) {
  const ProgramRun run =
      Cost("--scaling --discs=2 --bouncing=2 --pyramids=1 --out='" + Path("r.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.out.find("2 discs that bounce, by events"), std::string::npos) << run.out;
  const json scenes = json::parse(Read(Path("r.json")))["scenes"];
  ASSERT_EQ(scenes.size(), 3u);
  EXPECT_GT(scenes[2]["in_motion"]["percentile_99_us"], scenes[2]["in_motion"]["mean_us"]);
  ExpectOneLine(Cost("--scaling --discs=3,2"), 2, "--discs: expected ascending numbers");
}

TEST_F(TangibleCostTest, WrongFlagsAreUsage) {
  for (const char* flag :
       {"--parameters=", "--parameters=0", "--parameters=8,1", "--parameters=1,,8",
        "--parameters=1x", "--parameters=1e9", "--steps=", "--steps=-1", "--steps=10,10",
        "--steps=99999999999999999999", "--long_run=0", "--budget_seconds=0", "--budget_mib=nan",
        "--budget_mib=inf", "--repeat_seconds=-1", "--adjoint_bound=0", "--tangent_bound=nan",
        "--jet_bound=-2", "--stepping=both"}) {
    const std::string name(flag, std::string(flag).find('='));
    ExpectOneLine(Cost(std::string(flag)), 2, name);
  }
  ExpectOneLine(Cost("scene.json"), 2, "argument");
}

TEST_F(TangibleCostTest, WhatCannotBeWrittenIsOneLine) {
  ExpectOneLine(Cost(std::string(kQuick) + "--out=/nonexistent/r.json"), 1, "/nonexistent/r.json");
}

}  // namespace
}  // namespace tangible
