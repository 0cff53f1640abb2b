// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/random.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

constexpr int kDraws = 10000;

// Moments scatter by 1 / √draws of the deviation of what is averaged: four of these.
constexpr double kScatter = 4.0 / 100.0;

TEST(Random, UniformNumbersFillTheirRange) {
  std::mt19937_64 random = Generator(1, 0);
  double sum = 0.0, least = 1.0, largest = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = Uniform(&random);
    ASSERT_GT(x, 0.0);
    ASSERT_LT(x, 1.0);
    sum += x;
    least = std::min(least, x);
    largest = std::max(largest, x);
  }
  EXPECT_NEAR(sum / kDraws, 0.5, kScatter * std::sqrt(1.0 / 12.0));
  EXPECT_LT(least, 1e-3);
  EXPECT_GT(largest, 1.0 - 1e-3);
  EXPECT_GT(Uniform(3.0, 5.0, &random), 3.0);
}

TEST(Random, NormalNumbersHaveTheirMoments) {
  std::mt19937_64 random = Generator(2, 0);
  double sum = 0.0, squares = 0.0, fourth = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = Normal(&random);
    sum += x;
    squares += x * x;
    fourth += x * x * x * x;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, kScatter);
  EXPECT_NEAR(squares / kDraws, 1.0, kScatter * std::sqrt(2.0));
  EXPECT_NEAR(fourth / kDraws, 3.0, kScatter * std::sqrt(96.0));
}

TEST(Random, TasksOfASeedDiffer) {
  EXPECT_EQ(Generator(1, 2)(), Generator(1, 2)());
  EXPECT_NE(Generator(1, 2)(), Generator(1, 3)());
  EXPECT_NE(Generator(1, 2)(), Generator(2, 2)());
}

}  // namespace
}  // namespace tangible
