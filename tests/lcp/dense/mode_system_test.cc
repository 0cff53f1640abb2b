// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/mode_system.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../../support/small_problems.h"

namespace tangible {
namespace {

using testing::ListOf;
using testing::OneBodyOnContacts;
using testing::PointOf;

double Dot(const LcpVector& a, const LcpVector& b) {
  return a.v.dot(b.v) + a.y.dot(b.y) + a.z.dot(b.z);
}

TEST(ModeSystemTest, SolvesEachModeAsByHand) {
  MixedLcp<double> problem = OneBodyOnContacts(1, 0.0);
  problem.M(0, 0) = 2.0;
  const auto solve = [&problem](RowMode mode, double kink_weight, double r_z) {
    return ModeSystem(problem, {mode}, ListOf({kink_weight})).Solve(PointOf({1.0}, {r_z}));
  };
  // 2 v − z = 1, and v = 3.
  const LcpVector active = solve(RowMode::kActive, NAN, 3.0);
  EXPECT_DOUBLE_EQ(active.v[0], 3.0);
  EXPECT_DOUBLE_EQ(active.z[0], 5.0);
  const LcpVector inactive = solve(RowMode::kInactive, NAN, NAN);
  EXPECT_DOUBLE_EQ(inactive.v[0], 0.5);
  EXPECT_EQ(inactive.z[0], 0.0);
  // v + z / 2 = 3.
  const LcpVector kink = solve(RowMode::kKink, 0.5, 3.0);
  EXPECT_DOUBLE_EQ(kink.v[0], 1.75);
  EXPECT_DOUBLE_EQ(kink.z[0], 2.5);
}

TEST(ModeSystemTest, RedundantRowsShareTheLeastImpulse) {
  const MixedLcp<double> problem = OneBodyOnContacts(2, 0.0);
  const ModeSystem system(problem, {RowMode::kActive, RowMode::kActive}, ListOf({0.0, 0.0}));
  EXPECT_EQ(system.rank_deficiency(), 1);
  double error = 1.0;
  const LcpVector x = system.Solve(PointOf({-1.0}, {0.0, 0.0}), &error);
  EXPECT_NEAR(x.v[0], 0.0, 1e-15);
  EXPECT_NEAR(x.z[0], 0.5, 1e-15);
  EXPECT_NEAR(x.z[1], 0.5, 1e-15);
  EXPECT_LT(error, 1e-15);
  // v = 1 and v = −1 at once.
  system.Solve(PointOf({0.0}, {1.0, -1.0}), &error);
  EXPECT_GT(error, 0.1);
}

TEST(ModeSystemTest, RegularSystemsHaveNoDeficiencyAndAFiniteCondition) {
  const ModeSystem system(OneBodyOnContacts(1, 0.0), {RowMode::kActive}, ListOf({0.0}));
  EXPECT_EQ(system.rank_deficiency(), 0);
  // [1 −1; 1 0]: 2 · 2 in the 1-norm.
  EXPECT_NEAR(system.condition(), 4.0, 1e-12);
}

TEST(ModeSystemTest, TransposedSolutionsAreAdjoint) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto draw = [&](int rows, int cols) {
    return MatrixX<double>(
        MatrixX<double>::NullaryExpr(rows, cols, [&](int, int) { return uniform(random); }));
  };
  for (const int copies : {1, 2}) {
    MixedLcp<double> problem;
    const MatrixX<double> B = draw(4, 4);
    problem.M = B * B.transpose() + MatrixX<double>::Identity(4, 4);
    problem.p = VectorX<double>::Zero(4);
    problem.A = draw(1, 4);
    problem.b = VectorX<double>::Zero(1);
    problem.G = draw(2, 4).replicate(copies, 1);
    problem.F = MatrixX<double>::Zero(2 * copies, 2 * copies);
    problem.c = VectorX<double>::Zero(2 * copies);
    const ModeSystem system(problem, std::vector<RowMode>(2 * copies, RowMode::kActive), problem.c);
    EXPECT_EQ(system.rank_deficiency(), 2 * (copies - 1));
    const LcpVector r{draw(4, 1), draw(1, 1), draw(2 * copies, 1)};
    const LcpVector g{draw(4, 1), draw(1, 1), draw(2 * copies, 1)};
    const double forward = Dot(g, system.Solve(r));
    const double backward = Dot(system.SolveTransposed(g), r);
    EXPECT_GT(std::abs(forward), 1e-3);
    EXPECT_NEAR(forward, backward, 1e-12) << copies;
    // K is not symmetric, so that the other system gives another number.
    EXPECT_GT(std::abs(Dot(system.Solve(g), r) - forward), 1e-3);
  }
}

}  // namespace
}  // namespace tangible
