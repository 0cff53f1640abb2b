// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/closed_forms/comparison.h"

#include <limits>

#include "bounds.h"

namespace tangible::closed_forms {
namespace {

TEST(Comparison, OrderIsTheSlope) {
  EXPECT_NEAR(Order({0.1, 0.05, 0.025}, {3e-2, 7.5e-3, 1.875e-3}, 1e-11), 2.0, 1e-12);
  // Rounding says nothing.
  EXPECT_TRUE(std::isnan(Order({0.1, 0.05, 0.025}, {1e-15, 2e-15, 1e-3}, 1e-11)));
}

TEST(Comparison, FindsAWrongEntry) {
  const ClosedForm form = FormNamed("drop, one bounce");
  const Outcome exact = Exact(form);
  Outcome wrong = exact;
  wrong.jacobian(1, 2) *= 1.0 + 5e-9;
  const Errors errors = Compare(form, wrong, exact);
  EXPECT_NEAR(errors.over_bound, 5.0, 0.01);
  EXPECT_EQ(errors.worst, "d v_T / d e");
  EXPECT_EQ(errors.value, 0.0);
  EXPECT_GT(errors.derivative, 1e-10);
  wrong = exact;
  wrong.values[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Compare(form, wrong, exact).over_bound <= 1.0);
}

TEST(Comparison, FixedStepsAreOfFirstOrderWithoutImpacts) {
  const Study study =
      RunStudy(FormNamed("slope, slips from rest"), AllSchemes()[0], {25, 50, 100, 200});
  ASSERT_EQ(study.message, "");
  ASSERT_EQ(study.errors.size(), 4U);
  EXPECT_NEAR(study.value_order, 1.0, 0.05);
  EXPECT_NEAR(study.derivative_order, 1.0, 0.05);
}

}  // namespace
}  // namespace tangible::closed_forms
