// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/parameter_entry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/estimation/problem/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible {
namespace {

const ParameterEntry kMass{"mass", 2.0, 0.5, 20.0, true, 2.0};
const ParameterEntry kLength{"length", 0.3, -1.0, kInfinity, false, 0.5};

TEST(ParameterEntryTest, TheInternalVariableIsALogarithmOrAMultipleOfTheScale) {
  EXPECT_DOUBLE_EQ(ToInternal(kMass, 4.0), std::log(2.0));
  EXPECT_DOUBLE_EQ(ToInternal(kLength, 0.25), 0.5);
  for (const ParameterEntry& entry : {kMass, kLength}) {
    const double p = 1.1 * entry.initial;
    const double q = ToInternal(entry, p);
    EXPECT_NEAR(ToParameter(entry, q), p, 1e-15);
    const double h = 1e-6;
    const double difference = (ToParameter(entry, q + h) - ToParameter(entry, q - h)) / (2.0 * h);
    EXPECT_NEAR(ParameterByInternal(entry, p), difference, 1e-9);
  }
}

TEST(ParameterEntryTest, WhatGoesBeyondABoundStopsThere) {
  EXPECT_EQ(ToParameter(kMass, 100.0), 20.0);
  EXPECT_EQ(ToParameter(kMass, -100.0), 0.5);
  EXPECT_EQ(ToParameter(kLength, -100.0), -1.0);
}

TEST(ParameterEntryTest, ABoundIsReachedWithinRounding) {
  EXPECT_TRUE(IsAtBound(kMass, ToParameter(kMass, ToInternal(kMass, 0.5))));
  EXPECT_TRUE(IsAtBound(kMass, 20.0));
  EXPECT_FALSE(IsAtBound(kMass, 0.5 + 1e-9));
  EXPECT_TRUE(IsAtBound(kLength, -1.0));
}

// A logarithm never reaches 0. What runs there is at its bound, at a value that a run can have; ten
// decades below the start nothing is determined. The scale, whatever it is, has no part in it.
TEST(ParameterEntryTest, ALogarithmThatRunsToZeroIsAtItsBound) {
  for (const double initial : {1.0, 0.01, 3e7}) {
    for (const double scale : {1e-6, 1.0, 1e6}) {
      const ParameterEntry positive{"positive", initial, 0.0, kInfinity, true, scale};
      for (const double q : {-25.0, -395.0, -1e6, -kInfinity}) {
        const double p = ToParameter(positive, q);
        EXPECT_EQ(p, kVanished * initial);
        EXPECT_TRUE(IsAtBound(positive, p));
      }
      EXPECT_FALSE(IsAtBound(positive, 1.001 * kVanished * initial));
      EXPECT_EQ(ToParameter(positive, -20.0), initial * std::exp(-20.0));
    }
  }
  // A bound of one's own may be lower.
  const ParameterEntry bounded{"bounded", 1.0, 1e-20, kInfinity, true, 1e-20};
  EXPECT_EQ(ToParameter(bounded, -100.0), 1e-20);
  EXPECT_FALSE(IsAtBound(bounded, 1e-12));
}

}  // namespace
}  // namespace tangible
