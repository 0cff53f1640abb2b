// SPDX-License-Identifier: Apache-2.0
// Random scenes of 20 contacts with friction up to 1e6, which the interior point alone does not
// solve: a minute in a build without optimisation.
#include <gtest/gtest.h>

#include <iostream>
#include <string>

#include "../../support/cases.h"
#include "tangible/lcp/dense/solver.h"

namespace tangible {
namespace {

TEST(HardProblemsTest, ThePortfolioSolvesAll) {
  if (!CasesArePresent()) GTEST_SKIP() << "../shared/cases is not there";
  int problems = 0;
  int by_interior_point = 0;
  for (const auto& data : PlainCases()) {
    if (data["name"].get<std::string>().rfind("hard_", 0) != 0) continue;
    ++problems;
    const MixedLcp<double> problem = PlainProblem(data);
    const LcpSolution<double> solution = SolveLcp(problem);
    EXPECT_EQ(solution.status, LcpStatus::kSolved) << data["name"];
    EXPECT_LE(solution.residual, 1e-10);
    const LcpSolution<double> alone = SolveLcp(problem, {.solver = SolverChoice::kInteriorPoint});
    by_interior_point += alone.status == LcpStatus::kSolved ? 1 : 0;
    // Feasible: never said not to be.
    EXPECT_NE(alone.status, LcpStatus::kInfeasible) << data["name"];
  }
  EXPECT_GT(problems, 0);
  std::cout << "interior point alone: " << by_interior_point << " of " << problems << "\n";
}

}  // namespace
}  // namespace tangible
