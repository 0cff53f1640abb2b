// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/reference_extension.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../support/scenes.h"
#include "tangible/control/engine_step.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

constexpr double kStep = 0.01;
constexpr double kGravity = 9.81;

// A ball that falls from 0.4 m above the floor, and a rod on a hinge beside it that turns freely.
Scene FallingBall() {
  return SceneOf(R"({"bodies": [
    {"name": "floor", "static": true, "restitution": 0.8,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 0.2, "position": [0, 0.5],
     "velocity": [0.3, 0], "restitution": 0.8},
    {"name": "rod", "shape": {"box": {"size": [0.05, 0.4]}}, "mass": 0.5, "position": [3, 2.8]}],
    "joints": [{"name": "hinge", "type": "revolute", "bodies": ["rod", "world"], "anchor": [3, 3],
                "rate": 2, "damping": 0.02}],
    "forces": [{"name": "push", "body": "ball", "force": [0, 0]}],
    "simulation": {"dt": 0.01, "duration": 0.5, "stepping": "event"}})");
}

class ReferenceExtensionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(function_.Create(FallingBall(), {}, {"forces/push/force/y"}, {}), "");
    map_ = std::make_unique<EngineStep>(function_);
    const long steps = function_.num_steps();
    plan_.controls = RowMatrixXd::Constant(steps, 1, 0.1);
    plan_.states.resize(steps + 1, map_->num_states());
    plan_.states.row(0) = map_->initial().transpose();
    std::string error;
    for (long k = 0; k < steps; ++k) {
      VectorX<double> next;
      ASSERT_TRUE(map_->Step(k, plan_.states.row(k), plan_.controls.row(k), &next, &error));
      plan_.states.row(k + 1) = next.transpose();
      plan_.impacts.push_back(map_->impacts());
      if (!plan_.impacts.back().empty()) impact_step_ = k;
    }
  }

  // The ball's height and speed a time after it had those, under gravity and the control.
  static Vector2<double> Flight(double height, double speed, double t) {
    const double acceleration = -kGravity + 0.1 / 0.2;
    return {height + speed * t + 0.5 * acceleration * t * t, speed + acceleration * t};
  }

  RolloutFunction function_;
  std::unique_ptr<EngineStep> map_;
  Plan plan_;
  long impact_step_ = -1;
};

TEST_F(ReferenceExtensionTest, TheStepsImpactsAreKnown) {
  // √(2 · 0.4 / 9.31) = 0.293 s.
  EXPECT_EQ(impact_step_, 29);
  size_t impacts = 0;
  for (const std::vector<int>& of_step : plan_.impacts) impacts += of_step.size();
  EXPECT_EQ(impacts, 1u);
  StepMap* without = map_->Without(plan_.impacts[29][0]);
  ASSERT_NE(without, nullptr);
  VectorX<double> next;
  std::string error;
  ASSERT_TRUE(without->Step(29, plan_.states.row(29), plan_.controls.row(29), &next, &error));
  EXPECT_TRUE(without->impacts().empty());
  EXPECT_LT(next[1], 0.1);
  EXPECT_LT(next[4], -2.7);
}

TEST_F(ReferenceExtensionTest, AgreesWithThePlanInItsOwnMode) {
  ExtendedReference reference(map_.get(), 0, plan_);
  const std::vector<int> one = plan_.impacts[impact_step_];
  for (const long k : {0L, 29L}) {
    EXPECT_EQ(reference.At(k, {}).state, plan_.states.row(k).transpose());
    EXPECT_EQ(reference.At(k, {}).gain, k);
  }
  EXPECT_EQ(reference.At(30, one).state, plan_.states.row(30).transpose());
}

// A late run is compared with the fall that goes on, an early one with the rebound traced back.
TEST_F(ReferenceExtensionTest, IsTheFlightWithoutTheImpact) {
  ExtendedReference reference(map_.get(), 0, plan_);
  const std::vector<int> one = plan_.impacts[impact_step_];
  for (const int steps : {1, 2, 5}) {
    const ExtendedReference::Point late = reference.At(29 + steps, {});
    const Vector2<double> falling = Flight(plan_.states(29, 1), plan_.states(29, 4), steps * kStep);
    EXPECT_NEAR(late.state[1], falling[0], 1e-12);
    EXPECT_NEAR(late.state[4], falling[1], 1e-12);
    EXPECT_EQ(late.gain, 29);
    const ExtendedReference::Point early = reference.At(30 - steps, one);
    const Vector2<double> rising = Flight(plan_.states(30, 1), plan_.states(30, 4), -steps * kStep);
    EXPECT_NEAR(early.state[1], rising[0], 1e-12);
    EXPECT_NEAR(early.state[4], rising[1], 1e-12);
    EXPECT_EQ(early.gain, 30);
    // The rod, which is bound to its hinge, is where the plan has it.
    for (const int i : {8, 11}) {
      // An error of fourth order, of each step.
      EXPECT_NEAR(late.state[i], plan_.states(29 + steps, i), 1e-7);
      EXPECT_NEAR(early.state[i], plan_.states(30 - steps, i), 1e-7);
    }
  }
}

TEST_F(ReferenceExtensionTest, OfAModeThatThePlanIsNeverInIsThePlansOwn) {
  ExtendedReference reference(map_.get(), 0, plan_);
  const std::vector<int> other = {plan_.impacts[impact_step_][0] + 1};
  const std::vector<int> twice(2, plan_.impacts[impact_step_][0]);
  for (const long k : {10L, 40L}) {
    EXPECT_EQ(reference.At(k, other).state, plan_.states.row(k).transpose());
    EXPECT_EQ(reference.At(k, twice).state, plan_.states.row(k).transpose());
    EXPECT_EQ(reference.At(k, twice).gain, k);
  }
}

// A ball with thrusters that is to be at rest at a place after one bounce: the controls act on
// after the impact, so that states of the other side in the feedback throw the search off.
TEST(ReferenceExtension, LowersTheCostThroughABounce) {
  const Scene scene = SceneOf(R"({"bodies": [
    {"name": "floor", "static": true, "restitution": 0.8,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
    {"name": "ball", "shape": {"circle": {"radius": 0.05}}, "mass": 0.2, "position": [0, 1.2],
     "velocity": [0.5, 0], "restitution": 0.8}],
    "forces": [{"name": "push", "body": "ball", "force": [0, 0]}],
    "simulation": {"dt": 0.01, "duration": 1.2, "stepping": "event"}})");
  RolloutFunction function;
  ASSERT_EQ(function.Create(scene, {}, {"forces/push/force/x", "forces/push/force/y"}, {}), "");
  EngineStep map(function);
  std::vector<CostTerm> terms;
  for (const int i : {0, 1}) {
    terms.push_back({CostTerm::Kind::kControl, i, 0, {0, 0}, 0.0, 0.1, false});
    terms.push_back({CostTerm::Kind::kState, i, 0, {0, 0}, i == 0 ? 1.5 : 0.3, 100.0, true});
    terms.push_back({CostTerm::Kind::kState, 3 + i, 0, {0, 0}, 0.0, 10.0, true});
  }
  const Cost cost(6, 2, kStep, terms);
  const VectorX<double> bound = VectorX<double>::Constant(2, 3.0);
  const ControlProblem problem{&map, &cost, map.initial(), -bound, bound};
  double costs[2];
  for (const bool extended : {false, true}) {
    const IlqrResult result = SolveIlqr(problem, RowMatrixXd::Zero(120, 2),
                                        {.max_iterations = 100, .reference_extension = extended});
    ASSERT_NE(result.status, IlqrStatus::kFailed) << result.message;
    costs[extended ? 1 : 0] = result.plan.cost;
  }
  std::printf("cost %.6f, with the reference extended %.6f\n", costs[0], costs[1]);
  EXPECT_LT(costs[1], 0.97 * costs[0]);
}

}  // namespace
}  // namespace tangible
