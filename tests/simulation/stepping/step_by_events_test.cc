// SPDX-License-Identifier: Apache-2.0
//
// What the stepper reports of an event step: impulses and counts of all its parts.
#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace {

// A ball that bounces twice in one step of 1 s, and then flies: impacts at 0.1 and 0.9 s.
TEST(StepByEventsTest, TheRecordHasTheImpulsesOfTheWholeStep) {
  const Scene scene = test_scenes::SceneOf(R"({"gravity": [0, -10], "bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 2, "position": [0, 0.45],
       "velocity": [0, -3], "restitution": 1},
      {"name": "floor", "static": true, "restitution": 1,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 1, "duration": 1}})");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  const StepReport report = stepper.Step(model, 0.0, 1.0, &state);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  const StepRecord& record = stepper.record();
  ASSERT_EQ(record.contacts.size(), 1u);
  // Both impacts reverse 4 m/s; momentum: 2 · (v − (−3)) = impulses − 2 · 10 · 1.
  EXPECT_NEAR(record.solution.normal_impulse[0], 32.0, 1e-9);
  EXPECT_NEAR(2.0 * (state.twist[1] + 3.0), 32.0 - 20.0, 1e-9);
  EXPECT_EQ(record.new_twist, state.twist);
  EXPECT_EQ(record.before.twist[1], -3.0);
  EXPECT_EQ(report.events, 2);
  EXPECT_EQ(report.contacts, 1);
  EXPECT_EQ(report.lcp_rows, 1);  // no friction
  EXPECT_EQ(report.single_rows, 1);
  EXPECT_GE(report.pairs_near, 1);
  EXPECT_GE(report.pairs_compared, report.pairs_near);
  EXPECT_NEAR(report.impact_energy_gain, 0.0, 1e-12);
}

TEST(StepByEventsTest, ARunThatCannotGoOnKeepsTheStateItHad) {
  const Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "ball", "mass": 1, "inertia": 1, "position": [0, 0], "linear_damping": 1e300}],
    "simulation": {"stepping": "event", "integrator": "runge_kutta_4", "dt": 1, "duration": 1}})");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  state.twist[0] = 1.0;
  Stepper stepper(model);
  const StepReport report = stepper.Step(model, 0.0, 1.0, &state);
  EXPECT_NE(report.status, StepStatus::kDone);
  EXPECT_GT(report.halved_motions, 0);
  EXPECT_EQ(state.twist[0], 1.0);
  EXPECT_NE(report.message, "");
}

}  // namespace
}  // namespace tangible
