// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/nnls.h"

#include <gtest/gtest.h>

#include "../../support/random_problem.h"
#include "tangible/lcp/dense/farkas.h"

namespace tangible {
namespace {

// The optimality conditions, which no wrong x satisfies.
void ExpectOptimal(const MatrixX<double>& E, const VectorX<double>& f, Eigen::Index num_free) {
  const NnlsResult result = SolveNnls(E, f, num_free);
  ASSERT_TRUE(result.converged);
  const VectorX<double> gradient = E.transpose() * (f - E * result.x);
  const double tolerance = 1e-11 * E.norm() * f.norm();
  for (Eigen::Index j = 0; j < E.cols(); ++j) {
    EXPECT_LE(gradient[j], tolerance);
    if (j < num_free || result.x[j] > 0.0) {
      EXPECT_NEAR(gradient[j], 0.0, tolerance);
    }
    if (j >= num_free) {
      EXPECT_GE(result.x[j], 0.0);
    }
  }
}

TEST(NnlsTest, OptimalOnRandomProblems) {
  RandomProblem random(1);
  for (int k = 0; k < 50; ++k) {
    ExpectOptimal(random.Matrix(6, 9), random.Matrix(6, 1), k % 4);
    ExpectOptimal(random.Matrix(12, 5), random.Matrix(12, 1), k % 3);
  }
}

TEST(NnlsTest, RedundantColumnsAndZeros) {
  RandomProblem random(2);
  MatrixX<double> E = random.Matrix(5, 6);
  E.col(3) = E.col(0);
  E.col(4).setZero();
  ExpectOptimal(E, random.Matrix(5, 1), 0);
  ExpectOptimal(E, random.Matrix(5, 1), 4);
}

TEST(FarkasTest, ProvesThatNothingIsFeasible) {
  // v = 1 by momentum, and s = -v - 1 + 0 z.
  MixedLcp<double> problem;
  problem.M = MatrixX<double>::Constant(1, 1, 2.0);
  problem.p = VectorX<double>::Constant(1, 2.0);
  problem.G = MatrixX<double>::Constant(1, 1, 0.0);
  problem.F = MatrixX<double>::Constant(1, 1, -1.0);
  problem.c = VectorX<double>::Constant(1, -1.0);
  ConformEmptyBlocks(problem);
  VectorX<double> farkas = FindFarkas(problem);
  ASSERT_EQ(farkas.size(), 2);
  EXPECT_TRUE(CheckFarkas(problem, farkas));
  farkas[1] = -farkas[1];
  EXPECT_FALSE(CheckFarkas(problem, farkas));
}

TEST(FarkasTest, ContradictoryEquations) {
  RandomProblem random(3);
  MixedLcp<double> problem = random.Make(4, 2, 3);
  problem.A.row(1) = 2.0 * problem.A.row(0);
  problem.b[1] = 2.0 * problem.b[0] + 0.5;
  EXPECT_TRUE(CheckFarkas(problem, FindFarkas(problem)));
}

TEST(FarkasTest, FeasibleProblemsHaveNoProof) {
  RandomProblem random(4);
  for (int k = 0; k < 20; ++k) EXPECT_EQ(FindFarkas(random.Make(4, 1, 6)).size(), 0);
}

}  // namespace
}  // namespace tangible
