// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace tangible {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<ParameterizedScene::Entry> Entries(int count) {
  std::vector<ParameterizedScene::Entry> entries;
  entries.reserve(count);
  for (int k = 0; k < count; ++k) {
    entries.push_back({std::string(1, static_cast<char>('a' + k)), 1.0, -kInfinity, kInfinity});
  }
  return entries;
}

TEST(UncertaintyTest, CovarianceIsTheInverseOfTheNormalMatrix) {
  RowMatrixXd jacobian(4, 2);
  jacobian << 1, 2, 3, -1, 0, 5, 2e3, 1;
  const Eigen::Vector4d residuals(1.0, -2.0, 0.5, 0.25);
  const Uncertainty result =
      EstimateUncertainty(Entries(2), Eigen::Vector2d(3.0, 4.0), residuals, jacobian, {});
  const Eigen::Matrix2d expected = (jacobian.transpose() * jacobian).inverse();
  EXPECT_LT((result.covariance - expected).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_NEAR(result.standard_deviation[1], std::sqrt(expected(1, 1)), 1e-14);
  ASSERT_TRUE(result.confidence_95[0]);
  EXPECT_NEAR(result.confidence_95[0]->second - 3.0, 1.959964 * result.standard_deviation[0],
              1e-6 * result.standard_deviation[0]);
  EXPECT_NEAR(result.residual_rms, std::sqrt(residuals.squaredNorm() / 4.0), 1e-15);
  EXPECT_NEAR(result.reduced_chi_square, residuals.squaredNorm() / 2.0, 1e-15);
}

TEST(UncertaintyTest, ResidualsBeyondHuberDoNotCount) {
  RowMatrixXd jacobian(3, 1);
  jacobian << 1, 2, 100;
  UncertaintyOptions options;
  options.huber = 3.0;
  const Uncertainty result = EstimateUncertainty(Entries(1), Eigen::VectorXd::Ones(1),
                                                 Eigen::Vector3d(1, -2.5, 4), jacobian, options);
  EXPECT_NEAR(result.covariance(0, 0), 0.2, 1e-15);
}

TEST(UncertaintyTest, FewerResidualsThanParameters) {
  RowMatrixXd jacobian(1, 2);
  jacobian << 1, -1;
  const Uncertainty result = EstimateUncertainty(Entries(2), Eigen::Vector2d::Ones(),
                                                 Eigen::VectorXd::Zero(1), jacobian, {});
  EXPECT_FALSE(result.confidence_95[0]);
  EXPECT_FALSE(result.confidence_95[1]);
  EXPECT_TRUE(std::isnan(result.reduced_chi_square));
  EXPECT_FALSE(result.messages[0].empty());
}

TEST(UncertaintyTest, AnUndeterminedPairLeavesTheOthersTheirIntervals) {
  RowMatrixXd jacobian(4, 3);
  jacobian << 1, 2, 0, 2, 4, 0, 0, 0, 5, -1, -2, 1;
  const Uncertainty result = EstimateUncertainty(Entries(3), Eigen::Vector3d(2.0, 1.0, 1.0),
                                                 Eigen::Vector4d::Zero(), jacobian, {});
  EXPECT_FALSE(result.confidence_95[0]);
  EXPECT_FALSE(result.confidence_95[1]);
  EXPECT_TRUE(result.confidence_95[2]);
  // a + 2 b is measured, so a - 2 da = -2 db: equal and opposite relative changes where a = 2 b.
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_NE(result.warnings[0].find("1 'a' - 1 'b'"), std::string::npos) << result.warnings[0];
}

TEST(UncertaintyTest, IllConditionAndMisfitAreWarnedOf) {
  RowMatrixXd jacobian(3, 2);
  jacobian << 1, 1, 1, 1 + 1e-6, 1, 1;
  const Uncertainty result = EstimateUncertainty(Entries(2), Eigen::Vector2d::Ones(),
                                                 Eigen::Vector3d(50, 50, 50), jacobian, {});
  ASSERT_EQ(result.warnings.size(), 2u);
  EXPECT_NE(result.warnings[0].find("larger than sigma explains"), std::string::npos);
  EXPECT_NE(result.warnings[1].find("ill-conditioned"), std::string::npos);
}

}  // namespace
}  // namespace tangible
