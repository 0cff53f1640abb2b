// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/extrapolation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible {
namespace {

std::vector<double> Oscillator(const std::vector<double>& y) { return {y[1], -y[0]}; }

TEST(Extrapolation, SolvesTheOscillator) {
  const std::vector<double> y = Extrapolate<double>(&Oscillator, {1.0, 0.0}, 2.0, 4);
  EXPECT_NEAR(y[0], std::cos(2.0), 1e-14);
  EXPECT_NEAR(y[1], -std::sin(2.0), 1e-14);
}

TEST(Extrapolation, IsOfHighOrder) {
  const double coarse = Extrapolate<double>(&Oscillator, {1.0, 0.0}, 8.0, 1)[0] - std::cos(8.0);
  const double fine = Extrapolate<double>(&Oscillator, {1.0, 0.0}, 8.0, 2)[0] - std::cos(8.0);
  EXPECT_GT(std::abs(coarse), 1e-9);  // or there is nothing to measure
  EXPECT_GT(std::abs(coarse / fine), std::pow(2.0, 13));
}

}  // namespace
}  // namespace tangible
