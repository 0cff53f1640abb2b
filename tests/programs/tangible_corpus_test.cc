// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleCorpusTest : public ProgramTest {
 protected:
  ProgramRun Corpus(const std::string& arguments) const {
    return Run("tangible-corpus", arguments);
  }
};

TEST_F(TangibleCorpusTest, PrintsATableAndWritesJson) {
  const ProgramRun run =
      Corpus("--random=3 --contacts=20 --threads=2 --seed=3 --out='" + Path("r.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error << run.out;
  EXPECT_EQ(run.out.rfind("commit ", 0), 0u) << run.out;
  EXPECT_NE(run.out.find("30 problems, "), std::string::npos) << run.out;
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["problems"], 30);
  EXPECT_EQ(result["seed"], 3);
  EXPECT_NE(result["provenance"]["cpu"], "");
  for (const json& row : result["rows"]) EXPECT_EQ(row["wrong"], 0) << row;
}

TEST_F(TangibleCorpusTest, OneProblemAgain) {
  const ProgramRun run = Corpus("--kind='mass ratio' --first=17 --random=1");
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.out.find("\n1 problems, "), std::string::npos) << run.out;
}

TEST_F(TangibleCorpusTest, WrongInputAndFlags) {
  ExpectOneLine(Corpus("--problems=/nonexistent"), 1, "/nonexistent");
  ExpectOneLine(Corpus("--random=1 --contacts=3 --out=/nonexistent/r.json"), 1,
                "/nonexistent/r.json");
  ExpectOneLine(Corpus("--kind=nothing"), 2, "--kind");
  ExpectOneLine(Corpus("--random=-1"), 2, "--random");
  ExpectOneLine(Corpus("--random=0"), 2, "--random");
  ExpectOneLine(Corpus("--contacts=0"), 2, "--contacts");
  ExpectOneLine(Corpus("--threads=257"), 2, "--threads");
  ExpectOneLine(Corpus("scene.json"), 2, "argument");
}

}  // namespace
}  // namespace tangible
