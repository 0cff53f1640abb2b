// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleLcpTest : public ProgramTest {
 protected:
  ProgramRun Solve(const std::string& problem, const std::string& flags = "") const {
    return Run("tangible-lcp", "'" + Write("problem.json", problem) + "' " + flags);
  }
};

// A mass of 2 kg pressed against a wall: v = (0, 3), z = 4.
constexpr char kMixed[] = R"({"M": [[2, 0], [0, 1]], "p": [-4, 3], "G": [[1, 0]], "F": [[0]],
  "c": [0], "dl_dv": [1, 1], "dl_dz": [1]})";

TEST_F(TangibleLcpTest, SolvesAPlainProblem) {
  const ProgramRun run = Solve(R"({"F": [[2, 1], [1, 2]], "c": [-5, -6]})");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.error, "");
  const json result = json::parse(run.out);
  EXPECT_EQ(result["status"], "solved");
  EXPECT_NEAR(result["z"][0], 4.0 / 3.0, 1e-15);
  EXPECT_NEAR(result["z"][1], 7.0 / 3.0, 1e-15);
  EXPECT_LE(result["residual"].get<double>(), 1e-10);
  EXPECT_EQ(result["certificate"]["verdict"], "trustworthy");
  EXPECT_FALSE(result.contains("gradient"));
  for (const char* key : {"v", "y", "s", "solver", "iterations", "farkas"}) {
    EXPECT_TRUE(result.contains(key)) << key;
  }
}

// Numbers 400 orders of magnitude apart: beside z = 1e108 the constants are rounding of others.
TEST_F(TangibleLcpTest, WhatDoesNotDependOnTheConstantsIsNoSolution) {
  const ProgramRun run =
      Solve(R"({"F": [[1e-200, 1e200], [-1e200, 1e-200]], "c": [-1e308, 1e-308]})");
  EXPECT_EQ(run.exit_status, 1);
  EXPECT_NE(run.error.find("unsolved: what meets the tolerance does so without the constants"),
            std::string::npos)
      << run.error;
}

TEST_F(TangibleLcpTest, WritesTheGradientOfAMixedProblem) {
  for (const char* solver : {"auto", "interior_point", "lemke"}) {
    const ProgramRun run = Solve(kMixed, std::string("--solver=") + solver);
    ASSERT_EQ(run.exit_status, 0) << run.error;
    const json result = json::parse(run.out);
    EXPECT_NEAR(result["v"][0], 0.0, 1e-15);
    EXPECT_NEAR(result["v"][1], 3.0, 1e-15);
    EXPECT_NEAR(result["z"][0], 4.0, 1e-14);
    // l = v₀ + v₁ + z, with v₀ = −c, z = M₀₀ v₀ − p₀, v₁ = p₁ / M₁₁.
    const json& gradient = result["gradient"];
    EXPECT_NEAR(gradient["p"][0], -1.0, 1e-14);
    EXPECT_NEAR(gradient["p"][1], 1.0, 1e-14);
    EXPECT_NEAR(gradient["c"][0], -3.0, 1e-14);
    EXPECT_NEAR(gradient["M"][1][1], -3.0, 1e-14);
    EXPECT_NEAR(gradient["F"][0][0], -12.0, 1e-13);
    EXPECT_EQ(gradient["A"].size(), 0U);
  }
}

TEST_F(TangibleLcpTest, WhatIsNotFiniteIsNull) {
  const ProgramRun run = Solve(R"({"F": [], "c": []})");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  // Without rows no margin limits the derivative: it is infinite.
  EXPECT_TRUE(json::parse(run.out)["certificate"]["margin_min"].is_null()) << run.out;
}

TEST_F(TangibleLcpTest, OutReplacesTheFileAndLeavesNoTemporary) {
  const std::string out = Write("result.json", "old");
  const ProgramRun run = Solve(kMixed, "--out='" + out + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(json::parse(Read(out))["status"], "solved");
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(Path(""))) {
    files += entry.path().string().find(".tmp") != std::string::npos ? 1 : 0;
  }
  EXPECT_EQ(files, 0);
}

TEST_F(TangibleLcpTest, InfeasibleComesWithItsProof) {
  const ProgramRun run = Solve(R"({"F": [[-1]], "c": [-1]})");
  ExpectOneLine(run, 1, "infeasible");
  const json result = json::parse(run.out);
  EXPECT_EQ(result["status"], "infeasible");
  // w ≥ 0, F w ≤ 0, c w < 0.
  ASSERT_EQ(result["farkas"].size(), 1U);
  EXPECT_GT(result["farkas"][0].get<double>(), 0.0);
}

TEST_F(TangibleLcpTest, FeasibleWithoutSolutionIsUnsolved) {
  const ProgramRun run = Solve(R"({"F": [[-2, 1], [-2, 1]], "c": [-2, -1]})");
  ExpectOneLine(run, 1, "unsolved");
  EXPECT_EQ(json::parse(run.out)["status"], "unsolved");
}

TEST_F(TangibleLcpTest, BadInputIsRefusedWithOneLine) {
  const struct {
    const char* problem;
    const char* what;
  } kCases[] = {
      {R"({"F": [[2, 1], [1)", "problem.json: line 1, column 18: malformed JSON"},
      {"", "problem.json: line 1, column 1: malformed JSON"},
      {"[1, 2]", "problem.json: expected an object, got an array of 2"},
      {R"({"F": [[1]], "c": [1], "q": [2]})", "problem.json: /q: unknown key"},
      {R"({"F": [[1]], "c": [1], "c": [2]})", "problem.json: /c: key given twice"},
      {R"({"c": [1]})", "problem.json: /F: missing"},
      {R"({"F": [[1]]})", "problem.json: /c: missing"},
      {R"({"F": [[1]], "c": [1], "M": [[1]]})", "problem.json: /p: missing"},
      {R"({"F": [[1]], "c": [1], "A": [[1]]})", "problem.json: /b: missing"},
      {R"({"F": [[1]], "c": [1], "M": [[1]], "p": [1]})", "problem.json: /G: missing"},
      {R"({"F": [[1, 2]], "c": [1]})", "problem.json: /F: expected 1 x 1, got 1 x 2"},
      {R"({"F": [[1]], "c": [1, 2]})", "problem.json: /F: expected 2 x 2"},
      {R"({"F": [[1]], "c": [1], "dl_dz": [1, 2]})", "problem.json: /dl_dz: expected 1 numbers"},
      {R"({"F": [[1]], "c": [NaN]})", "problem.json: line 1, column 20: malformed JSON"},
      {R"({"F": [[1]], "c": [1e999]})", "malformed JSON: number overflow"},
      {R"({"F": [[1]], "c": [null]})", "problem.json: /c/0: expected a number, got null"},
      {R"({"F": [["a"]], "c": [1]})", "problem.json: /F/0/0: expected a number, got \"a\""},
      {R"({"F": 3, "c": [1]})", "problem.json: /F: expected an array of rows, got 3"},
      {R"({"F": [[1]], "c": "x"})", "problem.json: /c: expected an array"},
      {R"({"F": [[1]], "c": [1], "M": [[1, 2], [0, 1]], "p": [1, 1], "G": [[1, 0]]})",
       "expected a symmetric matrix"},
  };
  for (const auto& bad : kCases) {
    const ProgramRun run = Solve(bad.problem);
    ExpectOneLine(run, 1, bad.what);
    EXPECT_EQ(run.out, "");
  }
}

TEST_F(TangibleLcpTest, AGradientThatOverflowsIsNoGradient) {
  const ProgramRun run = Solve(R"({"F": [[1e-200]], "c": [-1e-200], "dl_dz": [1e200]})");
  ExpectOneLine(run, 1, "the gradient is not finite");
  const json result = json::parse(run.out);
  EXPECT_EQ(result["status"], "solved");
  EXPECT_TRUE(result["gradient"].is_null());
  EXPECT_NE(result["certificate"]["verdict"], "trustworthy");
}

TEST_F(TangibleLcpTest, UnreadableAndUnwritableFiles) {
  ExpectOneLine(Run("tangible-lcp", "/nowhere/p.json"), 1, "/nowhere/p.json: cannot be read");
  ExpectOneLine(Run("tangible-lcp", Path("")), 1, "Is a directory");
  ExpectOneLine(Solve(kMixed, "--out=/nowhere/s.json"), 1, "/nowhere/s.json: cannot be written");
  ExpectOneLine(Solve(kMixed, "--out='" + Path("") + "'"), 1, "cannot be written");
}

TEST_F(TangibleLcpTest, WrongUsageOfFlags) {
  ExpectOneLine(Solve(kMixed, "--fast"), 2, "unknown flag --fast");
  ExpectOneLine(Solve(kMixed, "--tolerance=much"), 2, "--tolerance: expected double");
  ExpectOneLine(Solve(kMixed, "--tolerance=-1"), 2, "--tolerance: expected a number in (0, 1)");
  ExpectOneLine(Solve(kMixed, "--tolerance=nan"), 2, "--tolerance");
  ExpectOneLine(Solve(kMixed, "--solver=magic"), 2, "--solver: expected auto");
  ExpectOneLine(Solve(kMixed, "--max_iterations=0"), 2, "--max_iterations");
  ExpectOneLine(Solve(kMixed, "--out"), 2, "--out needs a value");
  ExpectOneLine(Solve(kMixed, "another.json"), 2, "expected 1 argument");
  ExpectOneLine(Run("tangible-lcp", ""), 2, "expected 1 argument");
}

TEST_F(TangibleLcpTest, FlagsInEveryForm) {
  EXPECT_EQ(Solve(kMixed, "--solver lemke").exit_status, 0);
  EXPECT_EQ(Solve(kMixed, "-solver=lemke").exit_status, 0);
  EXPECT_EQ(Run("tangible-lcp", "--solver=lemke -- '" + Write("p.json", kMixed) + "'").exit_status,
            0);
}

// A row of A without entries says nothing, wherever it stands.
TEST_F(TangibleLcpTest, RowsOfZerosInA) {
  for (const char* rows : {R"("A": [[0, 0]], "b": [0])", R"("A": [[0, 0], [-1, 0]], "b": [0, 0])",
                           R"("A": [[1, 0], [0, 0]], "b": [0, 0])"}) {
    const ProgramRun run = Solve(std::string(R"({"M": [[1, 0], [0, 1]], "p": [0, 1], )") + rows +
                                 R"(, "G": [[1, 1]], "F": [[0]], "c": [0]})");
    ASSERT_EQ(run.exit_status, 0) << run.error;
    const json v = json::parse(run.out)["v"];
    EXPECT_NEAR(v[0], 0.0, 1e-15) << rows;
    EXPECT_NEAR(v[1], 1.0, 1e-15) << rows;
  }
}

// v is unique given z where M is positive definite on the null space of A, and need not be
// elsewhere.
TEST_F(TangibleLcpTest, MIsPositiveDefiniteWhereTheJointsLetMove) {
  const auto problem = [](const std::string& M, const std::string& A) {
    return R"({"M": )" + M + R"(, "p": [1, 1], "G": [[1, 0]], "F": [[0]], "c": [-1])" +
           (A.empty() ? "" : R"(, "A": )" + A + R"(, "b": [0])") + "}";
  };
  const std::string what = "problem.json: /M: expected a matrix that is positive definite";
  ExpectOneLine(Solve(problem("[[-2, 0], [0, 1]]", "")), 1,
                what + " where A v = 0, got v' M v = -2");
  ExpectOneLine(Solve(problem("[[0, 0], [0, 0]]", "")), 1, what);
  ExpectOneLine(Solve(problem("[[1, 2], [2, 1]]", "")), 1, what);
  ExpectOneLine(Solve(problem("[[1, 1], [1, 1]]", "")), 1, what);
  ExpectOneLine(Solve(problem("[[1, 0], [0, -1]]", "[[1, 0]]")), 1, what);
  // The joint holds the second speed, or the difference of both.
  EXPECT_EQ(Solve(problem("[[1, 0], [0, -1]]", "[[0, 1]]")).exit_status, 0);
  EXPECT_EQ(Solve(problem("[[1, 0], [0, 0]]", "[[1e-6, -1e-6]]")).exit_status, 0);
  EXPECT_EQ(Solve(problem("[[1e-9, 0], [0, 1e9]]", "")).exit_status, 0);
}

TEST_F(TangibleLcpTest, FlagsOfLibrariesAreUnknown) {
  for (const char* flag : {"--flagfile=x", "--fromenv=out", "--tryfromenv=out", "--undefok=x",
                           "--v=1", "--logtostderr", "--nologtostderr", "--helpfull"}) {
    ExpectOneLine(Solve(kMixed, flag), 2, "unknown flag --");
  }
}

TEST_F(TangibleLcpTest, TheInputIsNotOverwritten) {
  const std::string path = Write("same.json", kMixed);
  ExpectOneLine(Run("tangible-lcp", "'" + path + "' --out='" + path + "'"), 2,
                "--out: expected a file of its own, got that of the input");
  EXPECT_EQ(Read(path), kMixed);
  EXPECT_EQ(Solve(kMixed, "--out=/dev/null").exit_status, 0);
}

TEST_F(TangibleLcpTest, HelpAndVersion) {
  const ProgramRun help = Run("tangible-lcp", "--help");
  EXPECT_EQ(help.exit_status, 0);
  EXPECT_NE(help.out.find("--tolerance"), std::string::npos);
  EXPECT_EQ(help.out.find("--flagfile"), std::string::npos);
  const ProgramRun version = Run("tangible-lcp", "--version");
  EXPECT_EQ(version.exit_status, 0);
  EXPECT_EQ(version.out.rfind("tangible-lcp ", 0), 0U);
}

}  // namespace
}  // namespace tangible
