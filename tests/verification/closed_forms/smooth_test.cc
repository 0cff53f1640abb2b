// SPDX-License-Identifier: Apache-2.0
#include "bounds.h"

namespace tangible::closed_forms {
namespace {

TEST(Smooth, IntegratorsHaveTheirOrders) {
  for (const ClosedForm& form : AllClosedForms()) {
    if (form.kind != Kind::kSmooth) continue;
    const Study second = RunStudy(form, kTrapezoidal, {100, 200, 400, 800});
    ASSERT_EQ(second.message, "") << form.name;
    EXPECT_GE(second.value_order, 1.9) << form.name;
    EXPECT_GE(second.derivative_order, 1.9) << form.name;
    // Twice as few steps: at 400 the box that tips is at rounding.
    const Study fourth = RunStudy(form, kRungeKutta, {50, 75, 100, 150, 200});
    ASSERT_EQ(fourth.message, "") << form.name;
    EXPECT_GE(fourth.value_order, 3.8) << form.name;
    EXPECT_GE(fourth.derivative_order, 3.8) << form.name;
  }
}

// State and sensitivities after 1 s, in steps of 1 ms.
TEST(Smooth, DoublePendulumIsRightTo1e8) {
  const ClosedForm form = FormNamed("double pendulum");
  const Outcome exact = Exact(form);
  for (const Method method : {Method::kAdjoint, Method::kTangent}) {
    const Outcome got = Simulate(form, kRungeKutta, 1000, method);
    ASSERT_EQ(got.message, "");
    const Errors errors = Compare(form, got, exact);
    EXPECT_LE(errors.value, 1e-8);
    EXPECT_LE(errors.derivative, 1e-8);
  }
}

TEST(Smooth, PendulumOfSmallAmplitudeIsHarmonic) {
  const double w = std::sqrt(9.81 / 0.8);
  const ClosedForm form = PhysicalPendulum(
      "", {{"m", 1}, {"L", 0.8}, {"Ic", 0}, {"g", 9.81}, {"theta0", 1e-6}, {"T", 1.3}});
  const Outcome exact = Exact(form);
  EXPECT_NEAR(exact.values[0], 1e-6 * std::cos(1.3 * w), 1e-17);
  EXPECT_NEAR(exact.values[1], -1e-6 * w * std::sin(1.3 * w), 1e-16);
  EXPECT_NEAR(Derivative(form, exact, "theta_T", "T"), exact.values[1], 1e-17);
}

}  // namespace
}  // namespace tangible::closed_forms
