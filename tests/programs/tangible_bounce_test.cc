// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "run_program.h"

namespace tangible {
namespace {

using TangibleBounceTest = ProgramTest;

const std::string kScene = "'" TANGIBLE_SOURCE_DIR "/data/control/struck_ball.json'";

TEST_F(TangibleBounceTest, PrintsATableAndWritesOutcomes) {
  const ProgramRun run = Run(
      "tangible-bounce", kScene + " --problems=2 --iterations=3 --out='" + Path("r.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  for (const char* name : {"exact", "extended", "surrogate", "starts", "sampling", "fixed"}) {
    EXPECT_NE(run.out.find(name), std::string::npos) << name;
  }
  const auto json = nlohmann::json::parse(Read(Path("r.json")));
  EXPECT_EQ(json["problems"], 2);
  EXPECT_EQ(json["drawn"].size(), 2U);
  EXPECT_EQ(json["drawn"][0]["cup"].size(), 2U);
  ASSERT_EQ(json["methods"].size(), 6U);
  EXPECT_EQ(json["methods"][5]["outcomes"].size(), 2U);
}

// One method alone, of cups that efforts of several pieces reach.
TEST_F(TangibleBounceTest, RunsTheMethodsThatItIsTold) {
  const ProgramRun run =
      Run("tangible-bounce", kScene + " --problems=1 --iterations=3 --methods=starts --starts=2" +
                                 " --seed=2 --pieces=4 --out='" + Path("r.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const auto json = nlohmann::json::parse(Read(Path("r.json")));
  ASSERT_EQ(json["methods"].size(), 1U);
  EXPECT_EQ(json["methods"][0]["method"], "starts");
  EXPECT_EQ(json["pieces"], 4);
  EXPECT_EQ(run.out.find("surrogate"), std::string::npos) << run.out;
}

TEST_F(TangibleBounceTest, MistakesAreOneLine) {
  ExpectOneLine(Run("tangible-bounce", kScene + " --problems=0"), 2, "--problems: expected");
  ExpectOneLine(Run("tangible-bounce", kScene + " --pieces=0"), 2, "--pieces: expected");
  ExpectOneLine(Run("tangible-bounce", kScene + " --starts=1"), 2, "--starts: expected");
  ExpectOneLine(Run("tangible-bounce", kScene + " --methods=exact,guess"), 2,
                "--methods: expected some of exact, extended");
  ExpectOneLine(Run("tangible-bounce", kScene + " --iterations=0"), 2, "--iterations: expected");
  ExpectOneLine(Run("tangible-bounce", "'" TANGIBLE_SOURCE_DIR "/data/control/pendulum.json'"), 1,
                "/bodies: expected a body hammer, got none");
}

}  // namespace
}  // namespace tangible
