// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/engine_step.h"

#include <gtest/gtest.h>

#include "../support/scenes.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

// A cart on a rail with a pole, and beside it a ball that bounces on a floor and is pushed.
Scene CartAndBall(const std::string& stepping) {
  return SceneOf(R"({"bodies": [
    {"name": "cart", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 2]},
    {"name": "pole", "shape": {"box": {"size": [0.05, 1]}}, "mass": 0.2, "position": [0, 2.5]},
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 0.5, "position": [3, 0.1004],
     "velocity": [0.3, -1], "restitution": 0.6, "friction": 0.4},
    {"name": "lift", "kinematic": true, "shape": {"box": {"size": [0.2, 0.2]}},
     "position": [9, 0], "velocity": [0, 0.5]},
    {"name": "floor", "static": true, "restitution": 0.6, "friction": 0.4,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "joints": [
      {"name": "rail", "type": "prismatic", "bodies": ["cart", "world"], "anchor": [0, 2],
       "axis": [1, 0]},
      {"name": "hinge", "type": "revolute", "bodies": ["pole", "cart"], "anchor": [0, 2]}],
    "no_contact": [["cart", "*"], ["pole", "*"]],
    "forces": [{"name": "push", "body": "ball", "force": [0, 0], "torque": 0}],
    "simulation": {"dt": 0.001, "duration": 0.05, "stepping": ")" +
                 stepping + "\"}}");
}

std::vector<std::string> Controls() {
  return {"joints/rail/effort", "forces/push/force/x", "forces/push/torque"};
}

TEST(EngineStep, StepsAreThoseOfARollout) {
  for (const std::string stepping : {"fixed", "event"}) {
    RolloutFunction function;
    ASSERT_EQ(function.Create(CartAndBall(stepping), {}, Controls(), {}), "");
    RolloutInput input = function.Defaults();
    for (Eigen::Index k = 0; k < input.controls.rows(); ++k) {
      input.controls.row(k) << std::sin(0.3 * k), 0.1, 0.02 * k;
    }
    RolloutWorker worker(function);
    const RolloutOutput expected = worker.Run(input);
    ASSERT_EQ(expected.status, RolloutStatus::kDone) << expected.message;
    EngineStep step(function);
    VectorX<double> x = step.initial(), next;
    std::string error;
    for (long k = 0; k < function.num_steps(); ++k) {
      ASSERT_TRUE(step.Step(k, x, input.controls.row(k), &next, &error)) << error;
      x = next;
    }
    EXPECT_LT((x - expected.states.row(0).transpose()).norm(), 1e-10) << stepping;
  }
}

// At the ball's impact (step 0) and away from it, against central differences of two sizes.
TEST(EngineStep, JacobiansAreThoseOfDifferences) {
  for (const std::string stepping : {"fixed", "event"}) {
    RolloutFunction function;
    ASSERT_EQ(function.Create(CartAndBall(stepping), {}, Controls(), {}), "");
    EngineStep step(function);
    const int n = step.num_states(), m = step.num_controls();
    VectorX<double> x = step.initial(), next;
    VectorX<double> u(3);
    u << 0.7, 0.2, 0.01;
    std::string error;
    for (const long k : {0L, 1L, 2L}) {
      MatrixX<double> a, b;
      ASSERT_TRUE(step.Linearise(k, x, u, &next, &a, &b, &error)) << error;
      ASSERT_EQ(a.rows(), n);
      ASSERT_EQ(b.cols(), m);
      for (int j = 0; j < n + m; ++j) {
        // Poses of joined bodies are moved off their joints: the map has derivatives there too.
        for (const double h : {1e-6, 1e-7}) {
          VectorX<double> plus_x = x, minus_x = x, plus_u = u, minus_u = u, plus, minus;
          (j < n ? plus_x[j] : plus_u[j - n]) += h;
          (j < n ? minus_x[j] : minus_u[j - n]) -= h;
          ASSERT_TRUE(step.Step(k, plus_x, plus_u, &plus, &error)) << error;
          ASSERT_TRUE(step.Step(k, minus_x, minus_u, &minus, &error)) << error;
          const VectorX<double> difference = (plus - minus) / (2.0 * h);
          const VectorX<double> column =
              j < n ? VectorX<double>(a.col(j)) : VectorX<double>(b.col(j - n));
          EXPECT_LT((column - difference).norm(), 2e-6 * (1.0 + column.norm()))
              << stepping << " step " << k << " column " << j;
        }
      }
      x = next;
    }
  }
}

TEST(EngineStep, SaysWhyAStepCannotBeMade) {
  RolloutFunction function;
  ASSERT_EQ(function.Create(CartAndBall("fixed"), {}, Controls(), {}), "");
  EngineStep step(function);
  VectorX<double> next, u = VectorX<double>::Zero(3);
  std::string error;
  u[0] = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(step.Step(3, step.initial(), u, &next, &error));
  EXPECT_EQ(error, "step 3: expected finite states and controls");
}

}  // namespace
}  // namespace tangible
