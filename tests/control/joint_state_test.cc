// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/joint_state.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "../support/scenes.h"
#include "tangible/control/engine_step.h"

namespace tangible {
namespace {

// A cart on a rail with a pole on a hinge, hanging at an angle and turning.
Scene CartPole(double length) {
  const std::string half = std::to_string(length / 2);
  return test_scenes::SceneOf(R"({"bodies": [
      {"name": "cart", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 0]},
      {"name": "pole", "shape": {"box": {"size": [0.05, )" +
                              std::to_string(length) + R"(]}}, "mass": 0.2, "position": [0, )" +
                              half + R"(]}],
    "joints": [
      {"name": "rail", "type": "prismatic", "bodies": ["cart", "world"], "anchor": [0, 0],
       "axis": [1, 0], "rate": 0.3},
      {"name": "pin", "type": "revolute", "bodies": ["pole", "cart"], "anchor": [0, 0],
       "angle": 2.5, "rate": 4}],
    "no_contact": [["cart", "pole"]],
    "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
}

class Made {
 public:
  explicit Made(double length) {
    EXPECT_EQ(function_.Create(CartPole(length), {}, {"joints/rail/effort"}, {}), "");
    step_ = std::make_unique<EngineStep>(function_);
  }
  EngineStep& step() { return *step_; }

 private:
  RolloutFunction function_;
  std::unique_ptr<EngineStep> step_;
};

enum { kCartX, kCartY, kCartAngle, kCartVx, kCartVy, kCartOmega, kPole };

TEST(JointState, AStateOnTheJointsKeepsItsBits) {
  Made model(1.0);
  const VectorX<double> before = model.step().initial();
  VectorX<double> x = before;
  double error = -1.0;
  EXPECT_EQ(model.step().ProjectOntoJoints(0, &x, &error), JointState::Outcome::kOnJoints);
  EXPECT_EQ(x, before);
  EXPECT_LE(error, 1e-10);
}

// The longer pole's centre is 0.1 m from where the model's hinge holds it. Afterwards the hinge is
// closed in position and speed, the pole's angle and rate are the observed ones to 0.1 %, and the
// cart has moved by at most its share of the masses.
TEST(JointState, ALongerPoleShiftsAndKeepsItsAngleAndRate) {
  Made model(1.0), plant(1.2);
  const VectorX<double> seen = plant.step().initial();
  VectorX<double> x = seen;
  double error = 0.0;
  ASSERT_EQ(model.step().ProjectOntoJoints(0, &x, &error), JointState::Outcome::kProjected);
  EXPECT_NEAR(error, 0.1 * std::abs(std::cos(2.5)), 1e-9);  // the larger of its two rows
  const double angle = x[kPole + 2], omega = x[kPole + 5];
  EXPECT_NEAR(x[kPole] - x[kCartX], -0.5 * std::sin(angle), 1e-9);
  EXPECT_NEAR(x[kPole + 1] - x[kCartY], 0.5 * std::cos(angle), 1e-9);
  EXPECT_NEAR(x[kPole + 3] - x[kCartVx], -0.5 * std::cos(angle) * omega, 1e-9);
  EXPECT_NEAR(x[kPole + 4] - x[kCartVy], -0.5 * std::sin(angle) * omega, 1e-9);
  EXPECT_NEAR(x[kCartY], 0.0, 1e-10);
  EXPECT_NEAR(x[kCartVy], 0.0, 1e-10);
  EXPECT_NEAR(angle, seen[kPole + 2], 1e-3);
  EXPECT_NEAR(omega, seen[kPole + 5], 1e-3 * std::abs(seen[kPole + 5]));
  EXPECT_NE(omega, seen[kPole + 5]);
  EXPECT_LE(std::abs(x[kCartX] - seen[kCartX]), 0.1 * 0.2 / 1.2);
  // From there a step can be made, and from the observed state it cannot.
  VectorX<double> next;
  std::string why;
  EXPECT_TRUE(model.step().Step(0, x, VectorX<double>::Zero(1), &next, &why)) << why;
  EXPECT_FALSE(model.step().Step(0, seen, VectorX<double>::Zero(1), &next, &why));
}

}  // namespace
}  // namespace tangible
