// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tangible/estimation/uncertainty/robust_covariance.h"

namespace tangible {
namespace {

// The percentage points of the limit distribution of Cramér and von Mises (Anderson and Darling
// 1952, table 1).
TEST(DriftTest, QuantilesOfTheBridge) {
  EXPECT_NEAR(ProbabilityOfBridge(0.34730), 0.10, 5e-6);
  EXPECT_NEAR(ProbabilityOfBridge(0.46136), 0.05, 5e-6);
  EXPECT_NEAR(ProbabilityOfBridge(0.74346), 0.01, 5e-6);
  EXPECT_NEAR(ProbabilityOfBridge(1.16786), 0.001, 5e-6);
  EXPECT_NEAR(ProbabilityOfBridge(0.11888), 0.50, 5e-5);
  EXPECT_EQ(ProbabilityOfBridge(1e-300), 1.0);
  EXPECT_EQ(ProbabilityOfBridge(1e3), 0.0);
}

TEST(DriftTest, TooFewOrEqualAreNotTested) {
  EXPECT_TRUE(std::isnan(DriftProbability(Eigen::VectorXd::LinSpaced(9, 0.0, 1.0))));
  EXPECT_TRUE(std::isnan(DriftProbability(Eigen::VectorXd::Ones(20))));
  EXPECT_LT(DriftProbability(Eigen::VectorXd::LinSpaced(10, 0.0, 1.0)), 0.02);
}

// Recordings of a mean, of unequal lengths; `drift`: of the mean, in deviations of a recording's
// mean, over all of them.
double DriftOf(int recordings, double drift, std::mt19937* random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<RecordingRows> all(static_cast<size_t>(recordings));
  double sum = 0.0;
  double count = 0.0;
  for (int g = 0; g < recordings; ++g) {
    RecordingRows& rows = all[static_cast<size_t>(g)];
    const int samples = 20 + 5 * (g % 3);
    rows.shared = RowMatrixXd::Ones(samples, 1);
    rows.own = RowMatrixXd(samples, 0);
    rows.residuals = Eigen::VectorXd(samples);
    const double own = normal(*random) + drift * g / (recordings - 1.0);
    for (int i = 0; i < samples; ++i) {
      rows.times.push_back(0.1 * i);
      rows.residuals[i] = own + 0.1 * normal(*random);
    }
    sum += rows.residuals.sum();
    count += samples;
  }
  for (RecordingRows& rows : all) rows.residuals.array() -= sum / count;
  return EstimateRobustCovariance(all, RowMatrixXd(0, 1), {}).drift_p_value[0];
}

TEST(DriftTest, FindsADriftAndNoneWhereThereIsNone) {
  std::mt19937 random(5);
  int false_alarms = 0;
  int found = 0;
  constexpr int kReplicas = 1000;
  for (int replica = 0; replica < kReplicas; ++replica) {
    false_alarms += DriftOf(30, 0.0, &random) < 0.05 ? 1 : 0;
    found += DriftOf(30, 3.0, &random) < 0.05 ? 1 : 0;
  }
  // 50 ± 7 are expected of a test of 5 %.
  EXPECT_NEAR(false_alarms, 50, 22);
  EXPECT_GT(found, 950);
}

TEST(DriftTest, FewRecordingsHaveNoTest) {
  std::mt19937 random(5);
  EXPECT_TRUE(std::isnan(DriftOf(9, 0.0, &random)));
}

}  // namespace
}  // namespace tangible
