// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/active_set.h"

#include <gtest/gtest.h>

#include <random>

#include "../../support/small_problems.h"

namespace tangible {
namespace {

using testing::OneBodyOnContacts;
using testing::PlainLcp;
using testing::PointOf;

TEST(ActiveSetTest, ModesAreReadFromThePoint) {
  const MixedLcp<double> problem = PlainLcp({{2, 1}, {1, 2}}, {1, -6});
  const std::vector<RowMode> modes = IdentifyModes(problem, PointOf({}, {0.001, 2.99}));
  EXPECT_EQ(modes, (std::vector<RowMode>{RowMode::kInactive, RowMode::kActive}));
}

TEST(ActiveSetTest, PolishEndsAtTheSolutionFromRightAndWrongModes) {
  // z = (4/3, 7/3) for c = (-5, -6), and (0, 3) for c = (1, -6).
  for (const auto& [c, expected] :
       {std::pair(Eigen::Vector2d(-5, -6), Eigen::Vector2d(4.0 / 3.0, 7.0 / 3.0)),
        {Eigen::Vector2d(1, -6), Eigen::Vector2d(0.0, 3.0)}}) {
    const MixedLcp<double> problem = PlainLcp({{2, 1}, {1, 2}}, {c[0], c[1]});
    for (const Eigen::Vector2d& start :
         {Eigen::Vector2d(1.3, 2.3), {0.0, 0.0}, {9.0, 0.0}, {0.0, 9.0}, {-1.0, 1e-9}}) {
      const LcpVector point = Polish(problem, PointOf({}, {start[0], start[1]}));
      // A few roundings of numbers of order 1.
      EXPECT_LT((point.z - expected).cwiseAbs().maxCoeff(), 4e-15) << start.transpose();
    }
  }
}

TEST(ActiveSetTest, ImpulsesThatAreNotUniqueStayWhereTheyAre) {
  const MixedLcp<double> problem = OneBodyOnContacts(2, -1.0);
  const LcpVector point = Polish(problem, PointOf({1e-6}, {0.25 + 1e-6, 0.75}));
  EXPECT_NEAR(point.v[0], 0.0, 1e-15);
  EXPECT_NEAR(point.z.sum(), 1.0, 1e-15);
  EXPECT_NEAR(point.z[0], 0.25, 2e-6);
}

TEST(ActiveSetTest, EnumerationFindsTheConstructedSolution) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int trial = 0; trial < 10; ++trial) {
    // B Bᵀ + 1 is positive definite: the solution is unique.
    const MatrixX<double> B =
        MatrixX<double>::NullaryExpr(5, 5, [&](int, int) { return uniform(random); });
    MixedLcp<double> problem = PlainLcp({}, {});
    problem.F = B * B.transpose() + MatrixX<double>::Identity(5, 5);
    VectorX<double> z(5), s(5);
    for (int i = 0; i < 5; ++i) {
      const double x = uniform(random);
      z[i] = std::max(x, 0.0);
      s[i] = std::max(-x, 0.0);
    }
    problem.c = s - problem.F * z;
    ConformEmptyBlocks(problem);
    const LcpVector point = EnumerateModes(problem, 1e-12);
    EXPECT_LT((point.z - z).cwiseAbs().maxCoeff(), 1e-12);
  }
}

}  // namespace
}  // namespace tangible
