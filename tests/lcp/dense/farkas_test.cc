// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/farkas.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/small_problems.h"

namespace tangible {
namespace {

using testing::ListOf;
using testing::OneBodyOnContacts;
using testing::PlainLcp;

TEST(FarkasTest, ProvesAPlainProblemInfeasible) {
  // s = −z − 1 < 0.
  const MixedLcp<double> problem = PlainLcp({{-1}}, {-1});
  const VectorX<double> proof = FindFarkas(problem);
  ASSERT_EQ(proof.size(), 1);
  EXPECT_DOUBLE_EQ(proof[0], 1.0);
}

TEST(FarkasTest, ProvesThatContactsContradict) {
  // v ≥ 1 and −v ≥ 1: w = (1, 1).
  MixedLcp<double> problem = OneBodyOnContacts(2, 0.3);
  problem.G(1, 0) = -1.0;
  problem.c = ListOf({-1.0, -1.0});
  const VectorX<double> proof = FindFarkas(problem);
  ASSERT_EQ(proof.size(), 3);
  EXPECT_NEAR(proof[0], 0.0, 1e-12);
  EXPECT_NEAR(proof[1], 1.0, 1e-12);
  EXPECT_NEAR(proof[2], 1.0, 1e-12);
}

TEST(FarkasTest, ProvesThatJointsContradict) {
  // v = 1 and v = 2: t (−1, 1), tᵀ b = 1.
  MixedLcp<double> problem = OneBodyOnContacts(0, 0.0);
  problem.A = MatrixX<double>::Ones(2, 1);
  problem.b = ListOf({1.0, 2.0});
  ConformEmptyBlocks(problem);
  const VectorX<double> proof = FindFarkas(problem);
  ASSERT_EQ(proof.size(), 3);
  EXPECT_NEAR(proof[1], -1.0, 1e-12);
  EXPECT_NEAR(proof[2], 1.0, 1e-12);
}

TEST(FarkasTest, ProvesNothingOfFeasibleProblems) {
  EXPECT_EQ(FindFarkas(PlainLcp({{2, 1}, {1, 2}}, {-5, -6})).size(), 0);
  EXPECT_EQ(FindFarkas(OneBodyOnContacts(2, -1.0)).size(), 0);
  // Feasible, without a solution.
  EXPECT_EQ(FindFarkas(PlainLcp({{-2, 1}, {-2, 1}}, {-2, -1})).size(), 0);
}

// Rows and impulses may have any units: a proof of rows that are scaled by d is w / d.
TEST(FarkasTest, ProvesItWithRowsOfAnyScale) {
  // v1 + v2 >= 1, -v1 >= 1 and -v2 >= 1: w = (1, 1, 1); a fourth row that is open.
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double other : {1e-6, 1.0, 1e6}) {
      MixedLcp<double> problem;
      problem.M = MatrixX<double>{{2.0, 0.3}, {0.3, 1.0}};
      problem.p = ListOf({0.7, -0.4});
      problem.G = MatrixX<double>{{1.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}, {0.5, -2.0}};
      problem.F = MatrixX<double>::Zero(4, 4);
      problem.c = ListOf({-1.0, -1.0, -1.0, 3.0});
      const VectorX<double> rows = ListOf({scale, other, scale, scale});
      problem.G = rows.asDiagonal() * problem.G;
      problem.c = rows.cwiseProduct(problem.c);
      ConformEmptyBlocks(problem);
      const VectorX<double> proof = FindFarkas(problem);
      ASSERT_EQ(proof.size(), 6) << scale << " " << other;
      EXPECT_TRUE(CheckFarkas(problem, proof));
      const VectorX<double> w = proof.tail(4).cwiseProduct(rows);
      EXPECT_NEAR(w[1], w[0], 1e-9 * w[0]);
      EXPECT_NEAR(w[2], w[0], 1e-9 * w[0]);
      EXPECT_EQ(w[3], 0.0);
    }
  }
}

TEST(FarkasTest, ProvesAPlainProblemWithRowsOfAnyScale) {
  // The sum of the first two rows is -z3 - 1 < 0.
  const MatrixX<double> F{{1.0, -2.0, 0.5}, {-1.0, 2.0, -1.5}, {1.0, 1.0, 1.0}};
  for (const double first : {1e-6, 1.0, 1e6}) {
    for (const double second : {1e-6, 1.0, 1e6}) {
      const VectorX<double> rows = ListOf({first, second, 1.0});
      MixedLcp<double> problem;
      problem.F = rows.asDiagonal() * F;
      problem.c = rows.cwiseProduct(ListOf({1.0, -2.0, 1.0}));
      ConformEmptyBlocks(problem);
      const VectorX<double> proof = FindFarkas(problem);
      ASSERT_EQ(proof.size(), 3) << first << " " << second;
      EXPECT_NEAR(proof[0] * first, proof[1] * second, 1e-9 * proof[0] * first);
      EXPECT_EQ(proof[2], 0.0);
    }
  }
}

TEST(FarkasTest, CheckRefusesWhatIsNoProof) {
  const MixedLcp<double> problem = PlainLcp({{-1, 0}, {0, -1}}, {-1, 2});
  EXPECT_TRUE(CheckFarkas(problem, ListOf({1.0, 0.0})));
  EXPECT_TRUE(CheckFarkas(problem, ListOf({1.0, 0.1})));
  EXPECT_FALSE(CheckFarkas(problem, ListOf({0.0, 1.0})));   // cᵀ w = 2
  EXPECT_FALSE(CheckFarkas(problem, ListOf({0.0, 0.0})));   // proves nothing
  EXPECT_FALSE(CheckFarkas(problem, ListOf({1.0, -0.1})));  // w < 0
  EXPECT_FALSE(CheckFarkas(problem, ListOf({1.0})));        // not of its size
  EXPECT_FALSE(CheckFarkas(problem, ListOf({1.0, NAN})));
  EXPECT_FALSE(CheckFarkas(PlainLcp({{1}}, {-1}), ListOf({1.0})));  // Fᵀ w > 0
}

}  // namespace
}  // namespace tangible
