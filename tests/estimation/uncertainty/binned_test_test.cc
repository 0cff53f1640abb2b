// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/binned_test.h"

#include <gtest/gtest.h>

#include <random>

namespace tangible {
namespace {

TEST(BinnedTestTest, TwoBinsAreTheAnalysisOfVariance) {
  // Ten residuals of mean 0 and ten of mean 1, each with deviations of ± 1: between the bins lie
  // 20 · ¼ = 5 of 25, and F = 5 / (20 / 18) = 4.5, whose probability is that of Student's t of 18
  // degrees of freedom beyond ± √4.5: 0.0480.
  std::vector<double> x, r;
  for (int k = 0; k < 20; ++k) {
    x.push_back(k < 10 ? 3.0 : 7.0);
    r.push_back((k < 10 ? 0.0 : 1.0) + (k % 2 == 0 ? 1.0 : -1.0));
  }
  const BinnedTest test = TestBins(x, r, 20);
  ASSERT_EQ(test.at.size(), 2U);
  EXPECT_EQ(test.at[0], 3.0);
  EXPECT_EQ(test.mean[1], 1.0);
  EXPECT_NEAR(test.f, 4.5, 1e-12);
  EXPECT_NEAR(test.share, 0.2, 1e-12);
  EXPECT_NEAR(test.p_value, 0.0480, 5e-5);
}

TEST(BinnedTestTest, ProbabilitiesOfNoiseAreEven) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0.0, 1.0);
  int below = 0;
  for (int replica = 0; replica < 400; ++replica) {
    std::vector<double> x, r;
    for (int k = 0; k < 200; ++k) {
      x.push_back(normal(random));
      r.push_back(normal(random));
    }
    below += TestBins(x, r, 20).p_value < 0.1 ? 1 : 0;
  }
  // 40 are expected, with a standard deviation of 6.
  EXPECT_GT(below, 40 - 24);
  EXPECT_LT(below, 40 + 24);
}

TEST(BinnedTestTest, WithoutARangeThereIsNoTest) {
  EXPECT_TRUE(TestBins(std::vector<double>(50, 1.0), std::vector<double>(50, 2.0), 20).at.empty());
  EXPECT_TRUE(TestBins({}, {}, 20).at.empty());
}

}  // namespace
}  // namespace tangible
