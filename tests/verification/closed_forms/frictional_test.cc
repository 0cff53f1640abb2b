// SPDX-License-Identifier: Apache-2.0
#include "bounds.h"

namespace tangible::closed_forms {
namespace {

TEST(Frictional, EventSteppingIsExact) { ExpectAllExact(Kind::kFrictional); }

TEST(Frictional, StoppingDistanceHasItsTextbookDerivatives) {
  const ClosedForm form =
      SlidingBlock("", {{"x0", 0}, {"v0", 3}, {"mu", 0.4}, {"g", 9.81}, {"m", 2}, {"T", 1.5}});
  const Outcome got = Simulate(form, kTrapezoidal, 30, Method::kAdjoint);
  ASSERT_EQ(got.message, "");
  EXPECT_NEAR(got.values[0], 9.0 / (2.0 * 0.4 * 9.81), 1e-12);
  EXPECT_NEAR(Derivative(form, got, "x_T", "v0"), 3.0 / (0.4 * 9.81), 1e-12);
  EXPECT_NEAR(Derivative(form, got, "x_T", "mu"), -9.0 / (2.0 * 0.16 * 9.81), 1e-11);
  EXPECT_NEAR(Derivative(form, got, "x_T", "m"), 0.0, 1e-12);
}

// The four motions of a pushed box are all among the cases.
TEST(Frictional, BoxStandsSlidesTipsOrBoth) {
  const Eigen::VectorXd stands = Exact(FormNamed("box pushed, stands")).values;
  EXPECT_EQ(stands[0], 0.0);
  EXPECT_EQ(stands[2], 0.0);
  const Eigen::VectorXd slides = Exact(FormNamed("box pushed, slides")).values;
  EXPECT_GT(slides[0], 0.1);
  EXPECT_EQ(slides[2], 0.0);
  const Eigen::VectorXd tips = Exact(FormNamed("box pushed, tips")).values;
  EXPECT_LT(tips[2], -0.1);
  EXPECT_LT(-tips[4], 0.9 * tips[3]);
  const Eigen::VectorXd both = Exact(FormNamed("box pushed, tips and slides")).values;
  EXPECT_LT(both[2], -0.1);
  EXPECT_NEAR(-both[4], 0.05 * both[3], 1e-12);
}

}  // namespace
}  // namespace tangible::closed_forms
