// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/model_predictive.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../support/scenes.h"
#include "tangible/control/engine_step.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

// A pendulum that is to be held upright; gravity pulls it over.
Scene Inverted(double mass) {
  return SceneOf(R"({"bodies": [
    {"name": "rod", "shape": {"box": {"size": [0.05, 1]}}, "mass": )" +
                 std::to_string(mass) +
                 R"(, "position": [0, 0.5]}],
    "joints": [{"name": "hinge", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0]}],
    "simulation": {"dt": 0.02, "duration": 0.4}})");
}

// From 0.3 rad, with a model that is a fifth too light.
VectorX<double> BalancedFor(int steps, const PredictiveOptions& options, int* failed) {
  RolloutFunction of_model, of_plant;
  EXPECT_EQ(of_model.Create(Inverted(0.8), {}, {"joints/hinge/effort"}, {}), "");
  EXPECT_EQ(of_plant.Create(Inverted(1.0), {}, {"joints/hinge/effort"}, {}), "");
  EngineStep model(of_model), plant(of_plant);
  const Cost cost(6, 1, 0.02,
                  {{CostTerm::Kind::kState, 2, 0, {0, 0}, 0.0, 20.0, false},
                   {CostTerm::Kind::kState, 5, 0, {0, 0}, 0.0, 1.0, false},
                   {CostTerm::Kind::kControl, 0, 0, {0, 0}, 0.0, 0.01, false},
                   {CostTerm::Kind::kState, 2, 0, {0, 0}, 0.0, 20.0, true},
                   {CostTerm::Kind::kState, 5, 0, {0, 0}, 0.0, 5.0, true}});
  const VectorX<double> bound = VectorX<double>::Constant(1, 8.0);
  PredictiveController controller({&model, &cost, plant.initial(), -bound, bound},
                                  RowMatrixXd::Zero(20, 1), options);
  VectorX<double> x = plant.initial(), next;
  x.head(3) << -0.5 * std::sin(0.3), 0.5 * std::cos(0.3), 0.3;
  std::string error;
  *failed = 0;
  for (int k = 0; k < steps; ++k) {
    const VectorX<double> u = controller.Control(k, x);
    *failed += controller.last().status == IlqrStatus::kFailed ? 1 : 0;
    EXPECT_LE(std::abs(u[0]), 8.0);
    EXPECT_TRUE(plant.Step(k, x, u, &next, &error)) << error;
    x = next;
  }
  return x;
}

TEST(PredictiveController, BalancesAPlantOfAnotherMass) {
  int failed = 0;
  const VectorX<double> x = BalancedFor(150, {}, &failed);
  EXPECT_EQ(failed, 0);
  EXPECT_NEAR(x[2], 0.0, 0.02);
  EXPECT_NEAR(x[5], 0.0, 0.02);
  // A budget of iterations is reproducible.
  EXPECT_EQ(x, BalancedFor(150, {}, &failed));
}

TEST(PredictiveController, ABudgetOfTimePlaysTheBestPlanSoFar) {
  int failed = 0;
  PredictiveOptions options;
  options.ilqr.max_iterations = 1000;
  options.ilqr.gradient_tolerance = 0.0;
  options.budget = 1e-3;
  const VectorX<double> x = BalancedFor(100, options, &failed);
  EXPECT_EQ(failed, 0);
  EXPECT_NEAR(x[2], 0.0, 0.05);
}

}  // namespace
}  // namespace tangible
