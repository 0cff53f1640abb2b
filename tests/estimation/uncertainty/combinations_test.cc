// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/combinations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tangible/estimation/uncertainty/decomposition.h"

namespace tangible {
namespace {

std::vector<ParameterEntry> Positive(const std::vector<std::string>& names) {
  std::vector<ParameterEntry> entries;
  for (const std::string& name : names) {
    entries.push_back({name, 1.0, 0.0, std::numeric_limits<double>::infinity(), true, 1.0});
  }
  return entries;
}

std::vector<DeterminedCombination> Find(const std::vector<ParameterEntry>& entries,
                                        const Eigen::VectorXd& estimate,
                                        const RowMatrixXd& jacobian) {
  const Decomposition decomposition(jacobian, 1e-9);
  Eigen::MatrixXd none(estimate.size(), decomposition.size() - decomposition.rank());
  for (Eigen::Index i = decomposition.rank(); i < decomposition.size(); ++i) {
    none.col(i - decomposition.rank()) =
        decomposition.Direction(i).cwiseQuotient(estimate).normalized();
  }
  const RowMatrixXd covariance = decomposition.Covariance();
  return FindDeterminedCombinations(entries, estimate, none, covariance, 4.0 * covariance);
}

TEST(CombinationsTest, AProductIsFoundWithItsExponents) {
  // Residuals of y = m / k^2 at m = 3, k = 2, and of another parameter alone.
  const Eigen::Vector3d p(3.0, 2.0, 5.0);
  RowMatrixXd jacobian(3, 3);
  jacobian << 1.0 / 4.0, -6.0 / 8.0, 0.0, 2.0 / 4.0, -12.0 / 8.0, 0.0, 0.0, 0.0, 1.0;
  const auto found = Find(Positive({"m", "k", "g"}), p, jacobian);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].product, "'m' * 'k'^-2");
  EXPECT_EQ(found[0].sum, "'m' - 3 'k'");
  EXPECT_EQ(found[0].parameters, (std::vector<int>{0, 1}));
  // y has the deviation 1 / sqrt(1 + 4); the sum is 4 y to first order.
  EXPECT_NEAR(found[0].standard_deviation, 4.0 / std::sqrt(5.0), 1e-12);
  EXPECT_NEAR(found[0].standard_deviation_robust, 8.0 / std::sqrt(5.0), 1e-12);
}

TEST(CombinationsTest, APendulumHasOnlyItsMomentOverItsInertia) {
  // omega^2 = m a g / (m a^2 + I) of which m, a and I are free: one number of three.
  const double m = 2.0, a = 0.5, i = 0.3;
  const double inertia = m * a * a + i;
  RowMatrixXd jacobian(1, 3);
  jacobian << a / inertia - m * a * a * a / (inertia * inertia),
      m / inertia - 2.0 * m * a * m * a / (inertia * inertia), -m * a / (inertia * inertia);
  const auto found = Find(Positive({"m", "a", "I"}), Eigen::Vector3d(m, a, i), jacobian);
  ASSERT_EQ(found.size(), 1u);
  ASSERT_EQ(found[0].coefficients.size(), 3u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(found[0].coefficients[k], jacobian(0, k) / jacobian(0, 0), 1e-12);
  }
}

TEST(CombinationsTest, SeveralAreSeparatedAsFarAsTheyCanBe) {
  // a + b, b + c, c + d of four numbers that may have any sign.
  std::vector<ParameterEntry> entries = Positive({"a", "b", "c", "d"});
  for (ParameterEntry& entry : entries) {
    entry.logarithmic = false;
  }
  RowMatrixXd jacobian(3, 4);
  jacobian << 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 1;
  const auto found = Find(entries, Eigen::Vector4d::Ones(), jacobian);
  ASSERT_EQ(found.size(), 3u);
  for (const DeterminedCombination& combination : found) {
    EXPECT_EQ(combination.parameters.size(), 2u) << combination.sum;
    EXPECT_TRUE(combination.product.empty());
  }
}

TEST(CombinationsTest, NoneWhereAllOrNothingIsDetermined) {
  EXPECT_TRUE(
      Find(Positive({"a", "b"}), Eigen::Vector2d::Ones(), RowMatrixXd::Identity(2, 2)).empty());
  EXPECT_TRUE(Find(Positive({"a", "b"}), Eigen::Vector2d::Ones(), RowMatrixXd::Zero(2, 2)).empty());
}

}  // namespace
}  // namespace tangible
