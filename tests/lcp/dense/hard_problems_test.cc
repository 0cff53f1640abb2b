// SPDX-License-Identifier: Apache-2.0
// Random problems of 20 contacts with friction up to 1e5, which the interior point alone does not
// solve.
#include <gtest/gtest.h>

#include <iostream>
#include <string>

#include "../../support/random_problem.h"
#include "tangible/lcp/dense/solver.h"

namespace tangible {
namespace {

MatrixX<double> Rounded(const MatrixX<double>& matrix) {
  return (matrix.array() * 0x1p30).round() * 0x1p-30;
}

// 20 contacts of three bodies in the form z = (λn, λt+, λt−, γ), with random rows J and a random
// free motion v:
//
//   w = [J W Jᵀ, E; μ − Eᵀ, 0] z + (J v; 0)
//
// It has a solution: the matrix is copositive, and λᵀ J v = 0 where Jᵀ λ = 0. J Jᵀ has rank 9 of
// 60; its numbers and those of J v are rounded to ten digits, which contradict each other by that
// much, but for 1e-6 on the diagonal.
MixedLcp<double> ContactsOf(double friction, unsigned seed) {
  constexpr Eigen::Index kContacts = 20;
  constexpr Eigen::Index kSpeeds = 9;
  RandomProblem random(seed);
  MatrixX<double> rows(3 * kContacts, kSpeeds);
  rows.topRows(kContacts) = random.Matrix(kContacts, kSpeeds);
  rows.middleRows(kContacts, kContacts) = random.Matrix(kContacts, kSpeeds);
  rows.bottomRows(kContacts) = -rows.middleRows(kContacts, kContacts);
  MixedLcp<double> problem;
  problem.F = MatrixX<double>::Zero(4 * kContacts, 4 * kContacts);
  problem.F.topLeftCorner(3 * kContacts, 3 * kContacts) =
      Rounded(rows * rows.transpose()) +
      0x1p-20 * MatrixX<double>::Identity(3 * kContacts, 3 * kContacts);
  problem.c = VectorX<double>::Zero(4 * kContacts);
  problem.c.head(3 * kContacts) = Rounded(rows * random.Matrix(kSpeeds, 1));
  for (Eigen::Index k = 0; k < kContacts; ++k) {
    const Eigen::Index gamma = 3 * kContacts + k;
    problem.F(gamma, k) = friction;
    for (const Eigen::Index row : {kContacts + k, 2 * kContacts + k}) {
      problem.F(row, gamma) = 1.0;
      problem.F(gamma, row) = -1.0;
    }
  }
  ConformEmptyBlocks(problem);
  return problem;
}

TEST(HardProblemsTest, ThePortfolioSolvesAll) {
  int problems = 0;
  int by_interior_point = 0;
  for (const double friction : {3.0, 10.0, 30.0, 100.0, 1e3, 1e4, 1e5}) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
      SCOPED_TRACE("friction " + std::to_string(friction) + ", seed " + std::to_string(seed));
      const MixedLcp<double> problem = ContactsOf(friction, seed);
      ++problems;
      const LcpSolution<double> solution = SolveLcp(problem);
      EXPECT_EQ(solution.status, LcpStatus::kSolved);
      EXPECT_LE(solution.residual, 1e-10);
      const LcpSolution<double> alone = SolveLcp(problem, {.solver = SolverChoice::kInteriorPoint});
      by_interior_point += alone.status == LcpStatus::kSolved ? 1 : 0;
      // Feasible: never said not to be.
      EXPECT_NE(alone.status, LcpStatus::kInfeasible);
    }
  }
  EXPECT_LT(by_interior_point, problems);
  std::cout << "interior point alone: " << by_interior_point << " of " << problems << "\n";
}

}  // namespace
}  // namespace tangible
