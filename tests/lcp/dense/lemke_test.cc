// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/lemke.h"

#include <gtest/gtest.h>

#include "../../support/cases.h"
#include "../../support/random_problem.h"
#include "tangible/lcp/dense/interior_point.h"

namespace tangible {
namespace {

double Residual(const MatrixX<double>& W, const VectorX<double>& q, const VectorX<double>& z) {
  MixedLcp<double> problem;
  problem.F = W;
  problem.c = q;
  ConformEmptyBlocks(problem);
  return ScaledResidual(problem, VectorX<double>(), VectorX<double>(), z);
}

TEST(LemkeTest, SolvesRandomMonotoneProblems) {
  RandomProblem random(1);
  for (int k = 0; k < 50; ++k) {
    const MixedLcp<double> problem = random.Make(5, 2, 8);
    const auto reduced = ReduceToPlain(problem);
    ASSERT_TRUE(reduced.has_value());
    const LemkeResult result = SolveLemke(reduced->W, reduced->q);
    ASSERT_EQ(result.status, LemkeStatus::kSolved);
    // Pivoting without refinement: the growth of a few dozen pivots on 1e-16.
    EXPECT_LT((result.z - random.solution.z).norm(), 1e-9);
    EXPECT_LT((reduced->v0 + reduced->v_z * result.z - random.solution.v).norm(), 1e-9);
    EXPECT_LT((reduced->y0 + reduced->y_z * result.z - random.solution.y).norm(), 1e-8);
  }
}

TEST(LemkeTest, FromABasisItEndsAtTheSameSolutionByAShortPath) {
  RandomProblem random(5);
  int shorter = 0;
  for (int k = 0; k < 50; ++k) {
    const MixedLcp<double> problem = random.Make(12, 3, 16);
    const auto reduced = ReduceToPlain(problem);
    ASSERT_TRUE(reduced.has_value());
    const MatrixX<double>& W = reduced->W;
    const VectorX<double>& q = reduced->q;
    const LemkeResult cold = SolveLemke(W, q);
    ASSERT_EQ(cold.status, LemkeStatus::kSolved);
    // From the solution's own basis there is nothing to go, and rounding is regained.
    const LemkeResult same = SolveLemkeFrom(cold.z, W, q);
    ASSERT_EQ(same.status, LemkeStatus::kSolved);
    EXPECT_LE(Residual(W, q, same.z), 1e-12);
    EXPECT_LE((same.z - cold.z).norm(), 1e-8 * (1.0 + cold.z.norm()));
    // From another basis: one row too many, one too few.
    VectorX<double> start = cold.z;
    start[k % 16] = start[k % 16] > 0.0 ? 0.0 : 1.0;
    const LemkeResult near = SolveLemkeFrom(start, W, q);
    ASSERT_EQ(near.status, LemkeStatus::kSolved) << k;
    EXPECT_LE((near.z - same.z).norm(), 1e-8 * (1.0 + same.z.norm())) << k;
    shorter += near.pivots < cold.pivots ? 1 : 0;
  }
  EXPECT_GT(shorter, 40);
}

TEST(LemkeTest, ASingularBasisIsReported) {
  const MatrixX<double> W = MatrixX<double>::Zero(2, 2);
  const LemkeResult result =
      SolveLemkeFrom(VectorX<double>{{1.0, 1.0}}, W, VectorX<double>{{-1.0, 1.0}});
  EXPECT_NE(result.status, LemkeStatus::kSolved);
  EXPECT_TRUE(result.z.allFinite());
}

TEST(LemkeTest, DoesNotCycleOnTies) {
  // All of q ties at the first pivot.
  const MatrixX<double> W{{1.0, 2.0, 0.0}, {0.0, 1.0, 2.0}, {2.0, 0.0, 1.0}};
  const VectorX<double> q{{-1.0, -1.0, -1.0}};
  const LemkeResult result = SolveLemke(W, q);
  ASSERT_EQ(result.status, LemkeStatus::kSolved);
  EXPECT_LT(Residual(W, q, result.z), 1e-14);
}

TEST(LemkeTest, EndsOnARayWithoutSolution) {
  const MatrixX<double> W{{-1.0}};
  EXPECT_EQ(SolveLemke(W, VectorX<double>{{-1.0}}).status, LemkeStatus::kRay);
}

TEST(LemkeTest, HonoursThePivotLimit) {
  const MatrixX<double> W{{1.0, 2.0, 0.0}, {0.0, 1.0, 2.0}, {2.0, 0.0, 1.0}};
  const VectorX<double> q{{-1.0, -1.0, -1.0}};
  const LemkeResult result = SolveLemke(W, q, {.max_pivots = 2});
  EXPECT_EQ(result.status, LemkeStatus::kPivotLimit);
  EXPECT_LE(result.pivots, 2);
  EXPECT_TRUE(result.z.allFinite());
}

TEST(LemkeTest, PathsOfPublishedLength) {
  // Murty's problem takes 2¹² pivots; Klee and Minty's, Beale's and Chvatal's cycle without a rule.
  for (const char* name : {"murty_n12", "lp_kleeminty3", "lp_beale", "lp_chvatal",
                           "cycle_psd4_largest", "sic_exp_murty2"}) {
    const nlohmann::json data = PlainCase(name);
    const MixedLcp<double> problem = PlainProblem(data);
    const LemkeResult result = SolveLemke(problem.F, problem.c);
    EXPECT_EQ(result.status, LemkeStatus::kSolved) << name;
    EXPECT_LT(Residual(problem.F, problem.c, result.z), 1e-10) << name;
    EXPECT_LE(result.pivots, 4200) << name;
  }
}

TEST(LemkeTest, ReductionNeedsSolvableEquations) {
  RandomProblem random(2);
  MixedLcp<double> problem = random.Make(4, 2, 3);
  problem.A.row(1) = problem.A.row(0);
  problem.b[1] = problem.b[0];
  EXPECT_TRUE(ReduceToPlain(problem).has_value());
  problem.b[1] += 1.0;
  EXPECT_FALSE(ReduceToPlain(problem).has_value());
}

TEST(InteriorPointTest, SolvesRandomMonotoneProblems) {
  RandomProblem random(3);
  for (int k = 0; k < 50; ++k) {
    const MixedLcp<double> problem = random.Make(5, 2, 8);
    const InteriorPointResult<double> result = SolveInteriorPoint(problem);
    ASSERT_TRUE(result.converged);
    EXPECT_LE(result.iterations, 20);
    // κ = 1e-14 over margins of 0.5, times the size of the problem.
    EXPECT_LT((result.z - random.solution.z).norm(), 1e-11);
    EXPECT_LT((result.v - random.solution.v).norm(), 1e-11);
  }
}

TEST(InteriorPointTest, NeverNanWithoutSolution) {
  MixedLcp<double> problem;
  problem.F = MatrixX<double>{{-1.0, 0.0}, {0.0, -1.0}};
  problem.c = VectorX<double>{{-1.0, 1e300}};
  ConformEmptyBlocks(problem);
  const InteriorPointResult<double> result = SolveInteriorPoint(problem);
  EXPECT_FALSE(result.converged);
  EXPECT_TRUE(result.z.allFinite());
  EXPECT_LE(result.iterations, 100);
}

}  // namespace
}  // namespace tangible
