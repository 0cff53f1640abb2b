// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/chain_statistics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/estimation/uncertainty/nuts.h"

namespace tangible {
namespace {

/// Chains x_i = a x_i−1 + sqrt(1 − a²) e_i with normal e_i.
Eigen::MatrixXd Autoregression(double a, Eigen::Index draws, Eigen::Index chains) {
  Eigen::MatrixXd x(draws, chains);
  for (Eigen::Index j = 0; j < chains; ++j) {
    RandomStream random(7, static_cast<unsigned>(j));
    x(0, j) = random.Normal();
    for (Eigen::Index i = 1; i < draws; ++i) {
      x(i, j) = a * x(i - 1, j) + std::sqrt(1.0 - a * a) * random.Normal();
    }
  }
  return x;
}

TEST(ChainStatisticsTest, IndependentDrawsCountAsMany) {
  const Eigen::MatrixXd draws = Autoregression(0.0, 1000, 4);
  const ChainStatistics of = DescribeChains(draws);
  // Moments and quantiles of a normal distribution, to four of their deviations: 1 / sqrt(4000),
  // and 2.67 times as much of a quantile of 2.5 % (sqrt(0.025 · 0.975) / φ).
  EXPECT_NEAR(of.mean, 0.0, 0.065);
  EXPECT_NEAR(of.deviation, 1.0, 0.05);
  EXPECT_NEAR(of.median, 0.0, 0.08);
  EXPECT_NEAR(of.low, -1.96, 0.17);
  EXPECT_NEAR(of.high, 1.96, 0.17);
  EXPECT_NEAR(of.r_hat, 1.0, 0.005);
  EXPECT_NEAR(of.ess_bulk, 4000.0, 600.0);
  EXPECT_NEAR(of.ess_tail, 4000.0, 800.0);
}

// The integrated autocorrelation is (1 + a) / (1 − a) times that of independent draws.
TEST(ChainStatisticsTest, CorrelatedDrawsCountAsFewer) {
  for (const double a : {-0.5, 0.5, 0.9}) {
    const ChainStatistics of = DescribeChains(Autoregression(a, 20000, 4));
    const double expected = 80000.0 * (1.0 - a) / (1.0 + a);
    EXPECT_NEAR(of.ess_bulk / expected, 1.0, 0.1) << a;
  }
}

TEST(ChainStatisticsTest, ChainsThatDisagreeAreSeen) {
  Eigen::MatrixXd shifted = Autoregression(0.0, 500, 4);
  shifted.col(2).array() += 2.0;
  EXPECT_GT(DescribeChains(shifted).r_hat, 1.1);
  EXPECT_LT(DescribeChains(shifted).ess_bulk, 50.0);
  // Where only the widths differ the distances from the median tell it.
  Eigen::MatrixXd wider = Autoregression(0.0, 500, 4);
  wider.col(2) *= 4.0;
  EXPECT_GT(DescribeChains(wider).r_hat, 1.05);
  // A drift within chains is a difference of their halves.
  Eigen::MatrixXd drifting = Autoregression(0.0, 500, 4);
  for (Eigen::Index i = 0; i < 500; ++i) drifting.row(i).array() += 0.006 * static_cast<double>(i);
  EXPECT_GT(DescribeChains(drifting).r_hat, 1.1);
}

// Ranks do not change with a monotone map, however far the tails go.
TEST(ChainStatisticsTest, RanksAloneCount) {
  const Eigen::MatrixXd draws = Autoregression(0.5, 400, 3);
  const ChainStatistics one = DescribeChains(draws);
  const ChainStatistics other = DescribeChains((40.0 * draws.array()).exp());
  EXPECT_DOUBLE_EQ(one.ess_bulk, other.ess_bulk);
  EXPECT_DOUBLE_EQ(one.ess_tail, other.ess_tail);
}

TEST(ChainStatisticsTest, EqualOrFewDrawsHaveNone) {
  const ChainStatistics equal = DescribeChains(Eigen::MatrixXd::Constant(100, 2, 3.0));
  EXPECT_DOUBLE_EQ(equal.mean, 3.0);
  EXPECT_DOUBLE_EQ(equal.low, 3.0);
  EXPECT_TRUE(std::isnan(equal.r_hat));
  EXPECT_TRUE(std::isnan(equal.ess_bulk));
  EXPECT_TRUE(std::isnan(DescribeChains(Autoregression(0.0, 7, 4)).ess_bulk));
  EXPECT_TRUE(std::isnan(DescribeChains(Eigen::MatrixXd(0, 4)).mean));
}

TEST(ChainStatisticsTest, QuantilesAreLinearBetweenNeighbours) {
  const Eigen::Vector4d numbers(3.0, 0.0, 2.0, 1.0);
  EXPECT_DOUBLE_EQ(QuantileOf(numbers, 0.0), 0.0);
  EXPECT_DOUBLE_EQ(QuantileOf(numbers, 0.5), 1.5);
  EXPECT_DOUBLE_EQ(QuantileOf(numbers, 1.0), 3.0);
}

}  // namespace
}  // namespace tangible
