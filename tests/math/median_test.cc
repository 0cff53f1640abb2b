// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/median.h"

#include <gtest/gtest.h>

namespace tangible {
namespace {

TEST(MedianTest, IsTheValueInTheMiddle) {
  EXPECT_EQ(Median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(UpperMedian({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(Median({4.0, 1.0, 2.0, 3.0}), 2.5);
  EXPECT_EQ(UpperMedian({4.0, 1.0, 2.0, 3.0}), 3.0);
  EXPECT_TRUE(std::isnan(Median({})));
  EXPECT_TRUE(std::isnan(UpperMedian({})));
}

}  // namespace
}  // namespace tangible
