// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/number_kind.h"

#include <gtest/gtest.h>

#include <limits>

namespace tangible {
namespace {

TEST(NumberKindTest, RangesAndTheirEnds) {
  constexpr double kTiny = std::numeric_limits<double>::denorm_min();
  EXPECT_TRUE(IsAllowed(NumberKind::kFree, -1e300));
  EXPECT_TRUE(IsAllowed(NumberKind::kPositive, kTiny));
  EXPECT_FALSE(IsAllowed(NumberKind::kPositive, 0.0));
  EXPECT_FALSE(IsAllowed(NumberKind::kPositive, -1.0));
  EXPECT_TRUE(IsAllowed(NumberKind::kNonNegative, 0.0));
  EXPECT_FALSE(IsAllowed(NumberKind::kNonNegative, -kTiny));
  EXPECT_TRUE(IsAllowed(NumberKind::kFraction, 0.0));
  EXPECT_TRUE(IsAllowed(NumberKind::kFraction, 1.0));
  EXPECT_FALSE(IsAllowed(NumberKind::kFraction, 1.0 + 1e-15));
  EXPECT_FALSE(IsAllowed(NumberKind::kFraction, -kTiny));
}

TEST(NumberKindTest, NothingAllowsInfinityOrNan) {
  for (const NumberKind kind : {NumberKind::kFree, NumberKind::kPositive, NumberKind::kNonNegative,
                                NumberKind::kFraction}) {
    EXPECT_FALSE(IsAllowed(kind, std::numeric_limits<double>::infinity())) << Describe(kind);
    EXPECT_FALSE(IsAllowed(kind, -std::numeric_limits<double>::infinity())) << Describe(kind);
    EXPECT_FALSE(IsAllowed(kind, std::numeric_limits<double>::quiet_NaN())) << Describe(kind);
  }
}

}  // namespace
}  // namespace tangible
