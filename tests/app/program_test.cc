// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/program.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <random>
#include <vector>

namespace tangible {
namespace {

std::string ByPrintf(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

TEST(FormatNumberTest, IsPrintfsToTheByte) {
  using Limits = std::numeric_limits<double>;
  for (const double value : {0.0, -0.0, 1.0, 0.1, -1.5, 100000.0, 1e16, 1e17, 123456789012345678.0,
                             1e22, 1e23, 1e-4, 1e-5, 0.00012345, Limits::max(), Limits::min(),
                             Limits::denorm_min(), Limits::infinity(), -Limits::infinity()}) {
    EXPECT_EQ(FormatNumber(value), ByPrintf(value));
  }
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> near_one(-10.0, 10.0);
  for (int i = 0; i < 20000; ++i) {
    const double any = std::bit_cast<double>(random());
    EXPECT_EQ(FormatNumber(any), ByPrintf(any));
    const double usual = near_one(random);
    EXPECT_EQ(FormatNumber(usual), ByPrintf(usual));
  }
  std::string text = "x=";
  AppendNumber(2.5, &text);
  EXPECT_EQ(text, "x=2.5");
}

TEST(WholeNumbersAtCommasTest, AreAllOrNone) {
  using Numbers = std::vector<int>;
  EXPECT_EQ(WholeNumbersAtCommas("20,25,-3", -3, 25), (Numbers{20, 25, -3}));
  EXPECT_EQ(WholeNumbersAtCommas("7", 7, 7), Numbers{7});
  for (const char* text : {"", "20,", ",20", "20,x", "20x", "2.5", " 20", "19", "26", "20,26",
                           "99999999999999999999"}) {
    EXPECT_EQ(WholeNumbersAtCommas(text, 20, 25), Numbers{}) << text;
  }
}

TEST(FirstOutsideTest, NamesTheFirstFlagThatIsOutsideItsRange) {
  EXPECT_EQ(FirstOutside({{"--a", 1, 1, 1}, {"--b", 0.5, 0}}), "");
  EXPECT_EQ(FirstOutside({{"--a", 1, 1, 2}, {"--b", -1, 0}, {"--c", 9, 0, 1}}),
            "--b: expected a number >= 0, got -1");
  EXPECT_EQ(FirstOutside({{"--c", 257, 0, 256}}), "--c: expected a number from 0 to 256, got 257");
  EXPECT_EQ(FirstOutside({{"--c", -2, 0, 1e150}}),
            "--c: expected a number from 0 to 1e+150, got -2");
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(FirstOutside({{"--d", infinite, 0}}), "--d: expected a number >= 0, got inf");
  EXPECT_EQ(FirstOutside({{"--d", std::nan(""), 0, 1}}),
            "--d: expected a number from 0 to 1, got nan");
}

}  // namespace
}  // namespace tangible
