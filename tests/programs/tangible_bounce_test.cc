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
  ASSERT_EQ(json["methods"].size(), 6U);
  EXPECT_EQ(json["methods"][5]["outcomes"].size(), 2U);
}

TEST_F(TangibleBounceTest, MistakesAreOneLine) {
  ExpectOneLine(Run("tangible-bounce", kScene + " --problems=0"), 2, "--problems: expected");
  ExpectOneLine(Run("tangible-bounce", kScene + " --iterations=0"), 2, "--iterations: expected");
  ExpectOneLine(Run("tangible-bounce", "'" TANGIBLE_SOURCE_DIR "/data/control/pendulum.json'"), 1,
                "/bodies: expected a body hammer, got none");
}

}  // namespace
}  // namespace tangible
