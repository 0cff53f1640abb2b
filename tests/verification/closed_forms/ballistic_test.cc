// SPDX-License-Identifier: Apache-2.0
#include "bounds.h"

namespace tangible::closed_forms {
namespace {

TEST(Ballistic, EventSteppingIsExact) { ExpectAllExact(Kind::kBallistic); }

// Dropped from 1 m, elastic, its height after 0.6 s: higher starts are lower then.
TEST(Ballistic, HeightOverStartOfABounceIsNegative) {
  const ClosedForm form = FormNamed("drop, elastic");
  const double u = std::sqrt(2.0 * 9.81);
  const double exact = 2.0 * 9.81 * (0.6 - u / 9.81) / u - 1.0;
  EXPECT_NEAR(exact, -0.342, 5e-4);
  EXPECT_NEAR(Derivative(form, Exact(form), "y_T", "y0"), exact, 1e-13);
  const Outcome got = Simulate(form, kTrapezoidal, 60, Method::kAdjoint);
  ASSERT_EQ(got.message, "");
  EXPECT_NEAR(Derivative(form, got, "y_T", "y0"), exact, 1e-11);
  // Fixed steps: the derivative of their map is another one, whatever dt.
  const Outcome fixed = Simulate(form, AllSchemes()[0], 600, Method::kAdjoint);
  ASSERT_EQ(fixed.message, "");
  EXPECT_GT(std::abs(Derivative(form, fixed, "y_T", "y0") - exact), 0.5);
}

// Equal elastic discs exchange their velocities: x2 = x1 + v1 T + r1 + r2.
TEST(Ballistic, EqualDiscsHandTheirMotionOver) {
  const ClosedForm form = FormNamed("two discs, equal, elastic");
  for (const Scheme& scheme : {kTrapezoidal, kRungeKutta}) {
    const Outcome got = Simulate(form, scheme, 50, Method::kAdjoint);
    ASSERT_EQ(got.message, "");
    EXPECT_NEAR(Derivative(form, got, "x2_T", "x1"), 1.0, 1e-12);
    EXPECT_NEAR(Derivative(form, got, "x2_T", "x2"), 0.0, 1e-12);
    EXPECT_NEAR(Derivative(form, got, "x2_T", "vx1"), 0.9, 1e-12);
    EXPECT_NEAR(Derivative(form, got, "x2_T", "vx2"), 0.0, 1e-12);
  }
}

}  // namespace
}  // namespace tangible::closed_forms
