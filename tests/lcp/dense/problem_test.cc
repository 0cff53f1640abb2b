// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/problem.h"

#include <gtest/gtest.h>

#include <limits>

#include "../../support/random_problem.h"

namespace tangible {
namespace {

MixedLcp<double> Plain(double F, double c) {
  MixedLcp<double> problem;
  problem.F = MatrixX<double>::Constant(1, 1, F);
  problem.c = VectorX<double>::Constant(1, c);
  ConformEmptyBlocks(problem);
  return problem;
}

VectorX<double> Number(double x) { return VectorX<double>::Constant(1, x); }

TEST(ProblemTest, SaysWhichBlockDoesNotFit) {
  RandomProblem random(1);
  const MixedLcp<double> good = random.Make(3, 1, 4);
  EXPECT_EQ(ValidateProblem(good), "");
  MixedLcp<double> bad = good;
  bad.G = random.Matrix(4, 2);
  EXPECT_EQ(ValidateProblem(bad), "G: expected 4 x 3, got 4 x 2");
  bad = good;
  bad.F(2, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ValidateProblem(bad), "F: expected finite numbers");
  bad = good;
  bad.c[0] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ValidateProblem(bad), "c: expected finite numbers");
}

TEST(ProblemTest, ResidualOfTheSolutionIsRounding) {
  RandomProblem random(2);
  const MixedLcp<double> problem = random.Make(5, 2, 6);
  const LcpVector& x = random.solution;
  // Sums of up to 12 terms: 12 eps of their size.
  EXPECT_LT(ScaledResidual(problem, x.v, x.y, x.z), 12 * 2.3e-16);
}

TEST(ProblemTest, ResidualMeasuresEachWayToBeWrong) {
  const MixedLcp<double> problem = Plain(2.0, -4.0);
  const VectorX<double> none;
  EXPECT_EQ(ScaledResidual(problem, none, none, Number(2.0)), 0.0);
  // z = 0: s = -4 against σ = 4.
  EXPECT_EQ(ScaledResidual(problem, none, none, Number(0.0)), 1.0);
  // z = 4: s = 4, σ = 12, ζ = σ / W = 6.
  EXPECT_DOUBLE_EQ(ScaledResidual(problem, none, none, Number(4.0)), 4.0 / 12.0);
  EXPECT_EQ(ScaledResidual(problem, none, none, Number(NAN)),
            std::numeric_limits<double>::infinity());
}

TEST(ProblemTest, ResidualSeesTheEquations) {
  RandomProblem random(3);
  const MixedLcp<double> problem = random.Make(4, 2, 2);
  LcpVector x = random.solution;
  x.y[0] += 1e-6;
  const double momentum = ScaledResidual(problem, x.v, x.y, x.z);
  EXPECT_GT(momentum, 1e-8);
  EXPECT_LT(momentum, 1e-5);
}

TEST(ProblemTest, UnitsDoNotMatter) {
  RandomProblem random(4);
  MixedLcp<double> problem = random.Make(3, 0, 4);
  LcpVector x = random.solution;
  x.z[1] += 1e-3;
  const double residual = ScaledResidual(problem, x.v, x.y, x.z);
  // Impulses in other units: a power of two, so that nothing is rounded.
  problem.M *= 1024.0;
  problem.p *= 1024.0;
  problem.F /= 1024.0;
  EXPECT_EQ(ScaledResidual(problem, x.v, x.y, 1024.0 * x.z), residual);
}

TEST(ProblemTest, LargePointOnARayIsNoSolution) {
  // Feasible, without a solution; z = (t, 2 t) satisfies it ever better relative to t.
  MixedLcp<double> problem;
  problem.F = MatrixX<double>{{-2.0, 1.0}, {-2.0, 1.0}};
  problem.c = VectorX<double>{{-2.0, -1.0}};
  ConformEmptyBlocks(problem);
  const VectorX<double> none;
  const VectorX<double> far{{1e12, 2e12}};
  const double residual = ScaledResidual(problem, none, none, far);
  EXPECT_LT(residual, 1e-10);
  EXPECT_FALSE(DependsOnData(problem, none, none, far, residual));
}

}  // namespace
}  // namespace tangible
