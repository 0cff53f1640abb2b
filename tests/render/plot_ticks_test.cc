// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "tangible/render/plot.h"

namespace tangible {
namespace {

void ExpectTicks(const std::vector<double>& ticks, const std::vector<double>& expected) {
  ASSERT_EQ(ticks.size(), expected.size());
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    EXPECT_NEAR(ticks[i], expected[i], 1e-12 * std::abs(expected[i]));  // products of few roundings
  }
}

TEST(PlotTicksTest, LinearAtRoundNumbers) {
  ExpectTicks(PlotTicks(0.0, 1.0, AxisScale::kLinear, 5), {0.0, 0.2, 0.4, 0.6, 0.8, 1.0});
  ExpectTicks(PlotTicks(-0.013, 0.012, AxisScale::kLinear, 5), {-0.01, -0.005, 0.0, 0.005, 0.01});
  ExpectTicks(PlotTicks(997.0, 1003.5, AxisScale::kLinear, 4), {998.0, 1000.0, 1002.0});
}

TEST(PlotTicksTest, LogarithmicAtPowersOfTen) {
  ExpectTicks(PlotTicks(0.5, 2000.0, AxisScale::kLogarithmic, 5), {1.0, 10.0, 100.0, 1000.0});
  ExpectTicks(PlotTicks(0.9, 30.0, AxisScale::kLogarithmic, 5), {1.0, 2.0, 5.0, 10.0, 20.0});
  EXPECT_LE(PlotTicks(1e-300, 1e300, AxisScale::kLogarithmic, 6).size(), 7U);
}

TEST(PlotTicksTest, EveryIntervalHasAFewTicksInside) {
  for (double low : {-1e12, -3.7, 0.0, 1e-9, 1.0, 123456.0}) {
    for (double span : {1e-6, 0.013, 1.0, 7.77, 1e9}) {
      for (int count : {3, 6, 10}) {
        const double high = low + span * std::max(1.0, 1e-3 * std::abs(low));
        const std::vector<double> ticks = PlotTicks(low, high, AxisScale::kLinear, count);
        EXPECT_GE(ticks.size(), 1U) << low << " " << high;
        EXPECT_LE(ticks.size(), static_cast<std::size_t>(count) + 1) << low << " " << high;
        for (const double tick : ticks) {
          EXPECT_GE(tick, low - 1e-8 * (high - low));
          EXPECT_LE(tick, high + 1e-8 * (high - low));
        }
      }
    }
  }
}

TEST(PlotTicksTest, LinearStepsAreOneTwoOrFive) {
  ExpectTicks(PlotTicks(0.0, 10.0, AxisScale::kLinear, 5), {0, 2, 4, 6, 8, 10});
  ExpectTicks(PlotTicks(0.0, 1.0, AxisScale::kLinear, 5), {0, 0.2, 0.4, 0.6, 0.8, 1.0});
  ExpectTicks(PlotTicks(-3.0, 9.5, AxisScale::kLinear, 5), {0, 5});
  ExpectTicks(PlotTicks(0.3, 3.7, AxisScale::kLinear, 4), {1, 2, 3});
}

TEST(PlotTicksTest, ARangeBelowTheSpacingOfDoublesEnds) {
  const double low = 1e17;
  EXPECT_LE(PlotTicks(low, std::nextafter(low, 2e17), AxisScale::kLinear, 5).size(), 11u);
}

TEST(PlotTicksTest, EveryThirdPowerOfTenWhereThereAreMany) {
  ExpectTicks(PlotTicks(1e-12, 1e0, AxisScale::kLogarithmic, 4), {1e-12, 1e-9, 1e-6, 1e-3, 1.0});
}

TEST(PlotTicksTest, LessThanADecadeHasLinearTicks) {
  ExpectTicks(PlotTicks(3.0, 4.0, AxisScale::kLogarithmic, 5), {3.0, 3.2, 3.4, 3.6, 3.8, 4.0});
}

TEST(PlotTicksTest, NoneForRangesThatAreNone) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const AxisScale scale : {AxisScale::kLinear, AxisScale::kLogarithmic}) {
    EXPECT_TRUE(PlotTicks(2.0, 2.0, scale, 5).empty());
    EXPECT_TRUE(PlotTicks(2.0, 1.0, scale, 5).empty());
    EXPECT_TRUE(PlotTicks(1.0, infinity, scale, 5).empty());
    EXPECT_TRUE(PlotTicks(NAN, 1.0, scale, 5).empty());
    EXPECT_TRUE(PlotTicks(1.0, 2.0, scale, 0).empty());
  }
  EXPECT_TRUE(PlotTicks(0.0, 1.0, AxisScale::kLogarithmic, 5).empty());
  EXPECT_TRUE(PlotTicks(-1.0, 1.0, AxisScale::kLogarithmic, 5).empty());
}

}  // namespace
}  // namespace tangible
