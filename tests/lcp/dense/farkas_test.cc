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
