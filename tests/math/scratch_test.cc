// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/scratch.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

namespace tangible {
namespace {

TEST(ScratchTest, HasItsSizeAndKeepsItsMemory) {
  std::vector<double> numbers(100, 1.0);
  const double* const memory = numbers.data();
  SizeScratch(40, &numbers);
  EXPECT_EQ(numbers.size(), 40u);
  EXPECT_EQ(numbers.data(), memory);
}

// Old numbers too: they are left over from the step before.
TEST(ScratchTest, IsPoisonedWhereTheBuildSaysSo) {
  std::vector<double> numbers(2, 1.0);
  SizeScratch(3, &numbers);
  for (const double x : numbers) {
    EXPECT_EQ(std::isnan(x), kPoison);
  }
  if (kPoison) {
    EXPECT_TRUE(std::isnan(Eigen::VectorXd(2)[1])) << "Eigen's matrices";
  }
}

}  // namespace
}  // namespace tangible
