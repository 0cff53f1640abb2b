// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/whiteness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace tangible {
namespace {

std::vector<ResidualPlace> Places(int series, int samples) {
  std::vector<ResidualPlace> places;
  for (int i = 0; i < samples; ++i) {
    for (int s = 0; s < series; ++s) {
      places.push_back({0, s, 0.01 * i, 0.0});
    }
  }
  return places;
}

TEST(WhitenessTest, ProbabilitiesOfIndependentResidualsAreUniform) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 1.0);
  int below = 0;
  constexpr int kReplicas = 2000;
  for (int replica = 0; replica < kReplicas; ++replica) {
    Eigen::VectorXd residuals(200);
    for (Eigen::Index i = 0; i < residuals.size(); ++i) {
      residuals[i] = (i % 2 == 0 ? 5.0 : 0.1) * (1.0 + 0.01 * i) * normal(random);
    }
    below += TestWhiteness(residuals, Places(2, 100)).p_value < 0.1 ? 1 : 0;
  }
  // Binomial: 200 ± 4 sqrt(180), and a few for so short series.
  EXPECT_NEAR(below, 200, 70);
}

TEST(WhitenessTest, FindsASmoothPartWhateverTheScaleAndTheOrder) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0.0, 1.0);
  const std::vector<ResidualPlace> places = Places(3, 100);
  Eigen::VectorXd residuals(300);
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    residuals[i] = normal(random) + std::sin(10.0 * places[i].time + places[i].series);
  }
  const Whiteness found = TestWhiteness(residuals, places);
  EXPECT_LT(found.p_value, 1e-4);
  EXPECT_GT(found.correlation, 0.2);
  const Whiteness scaled = TestWhiteness(1e-9 * residuals, places);
  EXPECT_NEAR(scaled.correlation, found.correlation, 1e-12);
  std::vector<ResidualPlace> reversed(places.rbegin(), places.rend());
  EXPECT_NEAR(TestWhiteness(residuals.reverse(), reversed).correlation, found.correlation, 1e-12);
}

TEST(WhitenessTest, NeighboursOfOtherCoordinatesAndRecordingsAreNone) {
  // Equal within a time, independent from time to time.
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<ResidualPlace> places = Places(4, 100);
  Eigen::VectorXd residuals(400);
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    residuals[i] = i % 4 == 0 ? normal(random) : residuals[i - 1];
  }
  EXPECT_LT(std::abs(TestWhiteness(residuals, places).correlation), 0.3);
  for (size_t i = 0; i < places.size(); ++i) {
    places[i].recording = static_cast<int>(i);
  }
  EXPECT_EQ(TestWhiteness(residuals, places).p_value, 1.0);
}

TEST(WhitenessTest, RoundingIsNotTested) {
  std::vector<ResidualPlace> places = Places(1, 50);
  for (ResidualPlace& place : places) {
    place.least = 1e-9;
  }
  const Whiteness found = TestWhiteness(Eigen::VectorXd::Constant(50, 1e-10), places);
  EXPECT_TRUE(std::isnan(found.correlation));
  EXPECT_EQ(found.p_value, 1.0);
  EXPECT_EQ(TestWhiteness(Eigen::VectorXd::Zero(0), {}).p_value, 1.0);
}

}  // namespace
}  // namespace tangible
