// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/step.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/allocation_counter.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

// The final state of a scene and its model.
State<double> Simulate(const Scene& scene, Model<double>* model) {
  State<double> state;
  BuildModel(scene, model, &state);
  const RolloutReport report = Rollout(*model, state, {}, &state);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  return state;
}

TEST(StepTest, FreeFallIsTheDiscreteSum) {
  Scene scene = SceneOf(test_scenes::FallingBall(100.0, R"({"dt": 0.01, "duration": 1})"));
  Model<double> model;
  const State<double> state = Simulate(scene, &model);
  // v_k = −k h g; y = y0 − h² g (1 + ... + 100); rounding of 100 sums.
  EXPECT_NEAR(state.twist[1], -9.81, 1e-13);
  EXPECT_NEAR(state.pose[1], 100.1 - 9.81e-4 * 5050.0, 1e-12);
}

TEST(StepTest, CollisionsWithoutGravityConserveMomentum) {
  Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0],
       "velocity": [2, 0.1], "angular_velocity": 3, "friction": 0.4, "restitution": 0.6},
      {"name": "b", "shape": {"box": {"size": [0.2, 0.3]}}, "mass": 2.5, "position": [0.5, 0.05],
       "angle": 0.3, "friction": 0.4, "restitution": 0.6},
      {"name": "c", "shape": {"capsule": {"length": 0.2, "radius": 0.05}}, "mass": 0.7,
       "position": [0.9, 0], "velocity": [-1, 0], "friction": 0.4, "restitution": 0.6}],
    "simulation": {"dt": 0.01, "duration": 1}})");
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  const Vector3<double> before = Momentum(model, initial);
  const State<double> state = Simulate(scene, &model);
  EXPECT_GT(std::abs(state.twist[3]), 0.1);  // they met
  const Vector3<double> after = Momentum(model, state);
  EXPECT_NEAR(after.x(), before.x(), 1e-13);
  EXPECT_NEAR(after.y(), before.y(), 1e-13);
  // Impulses act at one point, midway, and poses move along the twist, so angular momentum about
  // the origin is kept to rounding too: h v × m v = 0.
  EXPECT_NEAR(after.z(), before.z(), 1e-13);
}

TEST(StepTest, FrictionStopsABoxWithinOneStepOfTheClosedForm) {
  for (const double h : {0.01, 0.001}) {
    Scene scene = SceneOf(R"({"bodies": [
        {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
         "velocity": [2, 0], "friction": 0.3},
        {"name": "floor", "static": true, "friction": 0.3,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"duration": 1}})");
    scene.simulation.dt = h;
    Model<double> model;
    const State<double> state = Simulate(scene, &model);
    const double distance = 4.0 / (2.0 * 0.3 * 9.81);
    // The sum of v_k h is short by h v0 / 2 and by at most one step of the last speed.
    EXPECT_NEAR(state.pose[0], distance - h, 0.3 * 9.81 * h * h);
    EXPECT_NEAR(state.twist[0], 0.0, 1e-14);
    EXPECT_NEAR(state.pose[1], 0.1, 1e-14);
  }
}

TEST(StepTest, RestingStaysAtRest) {
  Scene scene = SceneOf(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
       "friction": 0.5},
      {"name": "upper", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 1, "position": [0.05, 0.3],
       "friction": 0.5},
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [1, 0.1],
       "friction": 0.5},
      {"name": "floor", "static": true, "friction": 0.5,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 10}})");
  Model<double> model;
  const State<double> state = Simulate(scene, &model);
  const double expected[] = {0.0, 0.1, 0.0, 0.05, 0.3, 0.0, 1.0, 0.1, 0.0};
  for (int i = 0; i < 9; ++i) {
    EXPECT_NEAR(state.pose[i], expected[i], 1e-12) << i;  // 1000 roundings, no drift
  }
}

TEST(StepTest, BounceHasTheSpeedOfRestitution) {
  Scene scene = SceneOf(test_scenes::FallingBall(0.05, R"({"dt": 0.001})"));
  scene.bodies[0].velocity.y() = -2.0;
  scene.bodies[0].restitution = 0.8;
  scene.bodies[1].restitution = 0.4;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  double before = 0.0;
  for (int k = 0; k < 100 && state.twist[1] <= 0.0; ++k) {
    before = state.twist[1];
    ASSERT_EQ(stepper.Step(model, k * 0.001, 0.001, &state).status, StepStatus::kDone);
  }
  EXPECT_NEAR(state.twist[1], -0.6 * before, 1e-15);
  EXPECT_LT(before, -2.0);
}

TEST(StepTest, ARollingDiscRolls) {
  // v = −ω r at the contact (x right, floor below): friction brings a sliding disc to 2/3 of v0.
  Scene scene = SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.001, "duration": 1})"));
  scene.bodies[0].velocity.x() = 1.0;
  Model<double> model;
  const State<double> state = Simulate(scene, &model);
  EXPECT_NEAR(state.twist[0], 2.0 / 3.0, 1e-12);
  EXPECT_NEAR(state.twist[2], -20.0 / 3.0, 1e-11);
}

TEST(StepTest, KinematicBodiesKeepTheirTwist) {
  Scene scene = SceneOf(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
       "friction": 1},
      {"name": "belt", "kinematic": true, "velocity": [0.5, 0], "friction": 1,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 1}})");
  Model<double> model;
  const State<double> state = Simulate(scene, &model);
  EXPECT_NEAR(state.pose[3], 0.5, 1e-13);
  EXPECT_EQ(state.twist[3], 0.5);
  EXPECT_NEAR(state.twist[0], 0.5, 1e-13);  // carried along
}

TEST(StepTest, AStuckWedgeIsUnsolvedAndNamed) {
  // A kinematic press that comes down on a ball on the floor.
  Scene scene = SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01, "duration": 0.1})"));
  BasicBody<double> press = scene.bodies[1];
  press.name = "press";
  press.motion = Motion::kKinematic;
  press.shape.numbers = {0.0, -1.0, -0.2};
  press.velocity = Vector2<double>(0.0, -1.0);
  scene.bodies.push_back(press);
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  const State<double> initial = state;
  const RolloutReport report = Rollout(model, initial, {}, &state);
  EXPECT_EQ(report.status, StepStatus::kUnsolved);
  EXPECT_NE(report.message.find("contact of ball and "), std::string::npos) << report.message;
  EXPECT_GT(report.residual, 1e-3);
  EXPECT_EQ(report.message.find("(scaled residual 0)"), std::string::npos) << report.message;
}

TEST(StepTest, NoAllocationAfterTheFirstStep) {
  Scene scene = SceneOf(test_scenes::Mixture());
  BasicBody<double> slider = scene.bodies[1];
  slider.name = "slider";
  slider.angle = 0.0;
  slider.position = Vector2<double>(-4.0, 0.1);
  slider.velocity = Vector2<double>(-3.0, 0.0);
  scene.bodies.push_back(slider);
  scene.bodies[0].position.y() = 5.0;  // no new contact within the steps
  scene.bodies[1].position.y() = 5.0;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  for (int k = 0; k < 2; ++k) {
    ASSERT_EQ(stepper.Step(model, 0.01 * k, 0.01, &state).status, StepStatus::kDone);
  }
  const long before = testing::NumAllocations();
  int sliding = 0;
  for (int k = 2; k < 20; ++k) {
    stepper.Step(model, 0.01 * k, 0.01, &state);
    sliding += stepper.record().solution.modes[0] != ContactMode::kOpen ? 1 : 0;
  }
  EXPECT_EQ(testing::NumAllocations(), before);
  EXPECT_EQ(sliding, 18);
}

TEST(StepTest, NoAllocationInAChainThatWhips) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(test_scenes::WhippingChain(2.0)), &model, &state);
  Stepper stepper(model);
  ASSERT_EQ(stepper.Step(model, 0.0, 0.01, &state).status, StepStatus::kDone);
  const long before = testing::NumAllocations();
  for (int k = 1; k < 200; ++k) {
    const StepReport report = stepper.Step(model, 0.01 * k, 0.01, &state);
    ASSERT_EQ(report.status, StepStatus::kDone) << k << " " << report.message;
  }
  EXPECT_EQ(testing::NumAllocations(), before);
}

// A disc rolls over joints of a polyline and through its valley.
TEST(StepTest, NoAllocationOnAPolyline) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(R"({"bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "friction": 0.5,
       "position": [-1, 0.6]},
      {"name": "track", "static": true, "friction": 0.5, "shape": {"polyline": {
       "points": [[-2, 1], [-0.5, 0.25], [-0.4, 0.2], [0, 0], [1, 0.1], [2, 1]],
       "solid": "right"}}}]})"),
             &model, &state);
  Stepper stepper(model);
  ASSERT_EQ(stepper.Step(model, 0.0, 0.01, &state).status, StepStatus::kDone);
  const long before = testing::NumAllocations();
  for (int k = 1; k < 150; ++k) {
    ASSERT_EQ(stepper.Step(model, 0.01 * k, 0.01, &state).status, StepStatus::kDone);
  }
  EXPECT_EQ(testing::NumAllocations(), before);
  EXPECT_GT(state.pose[0], 0.1);
}

// A staple falls onto a post and rests there: edges of both outlines.
TEST(StepTest, NoAllocationOnConcavePolygons) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(R"({"bodies": [
      {"name": "staple", "shape": {"polygon": {"vertices": [[-0.25, -0.35], [-0.15, -0.35],
       [-0.15, 0.15], [0.15, 0.15], [0.15, -0.35], [0.25, -0.35], [0.25, 0.25], [-0.25, 0.25]]}},
       "mass": 1, "friction": 0.5, "position": [0.02, 0], "angle": 0.1},
      {"name": "post", "static": true, "friction": 0.5, "shape": {"polygon": {
       "vertices": [[-1, -1], [1, -1], [1, -0.8], [0.1, -0.8], [0.1, 0], [-0.1, 0], [-0.1, -0.8],
                    [-1, -0.8]]}}}]})"),
             &model, &state);
  Stepper stepper(model);
  for (int k = 0; k < 30; ++k) {
    ASSERT_EQ(stepper.Step(model, 0.01 * k, 0.01, &state).status, StepStatus::kDone);
  }
  const long before = testing::NumAllocations();
  for (int k = 30; k < 150; ++k) {
    ASSERT_EQ(stepper.Step(model, 0.01 * k, 0.01, &state).status, StepStatus::kDone);
  }
  EXPECT_EQ(testing::NumAllocations(), before);
  EXPECT_NEAR(state.pose[1], -0.15, 1e-6);
}

// Six stacks of two discs: islands, each of which had its memory from its first step on.
TEST(StepTest, NoAllocationWithIslandsThatRest) {
  std::string bodies;
  for (int i = 0; i < 12; ++i) {
    bodies += R"({"name": "d)" + std::to_string(i) +
              R"(", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "friction": 0.5,
                "position": [)" +
              std::to_string(0.5 * (i / 2)) + ", " + (i % 2 == 0 ? "0.1" : "0.3") + "]},";
  }
  const Scene scene = SceneOf(R"({"bodies": [)" + bodies + R"({"name": "floor", "static": true,
      "friction": 0.5, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}]})");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  for (int k = 0; k < 2; ++k) {
    const StepReport report = stepper.Step(model, 0.01 * k, 0.01, &state);
    ASSERT_EQ(report.status, StepStatus::kDone);
    EXPECT_EQ(report.islands, 6);
    EXPECT_EQ(report.contacts, 12);
  }
  const long before = testing::NumAllocations();
  for (int k = 2; k < 20; ++k) {
    EXPECT_EQ(stepper.Step(model, 0.01 * k, 0.01, &state).factorisations, 1);
  }
  EXPECT_EQ(testing::NumAllocations(), before);
}

TEST(StepTest, TimesAreNotAccumulated) {
  SimulationSettings settings;
  settings.dt = 0.1;
  settings.duration = 0.35;
  EXPECT_EQ(NumSteps(settings), 4);
  EXPECT_EQ(StepTime(settings, 3), 3 * 0.1);
  EXPECT_EQ(StepTime(settings, 4), 0.35);
  EXPECT_NEAR(StepLength(settings, 3), 0.05, 1e-15);
  settings.duration = 0.3;
  EXPECT_EQ(NumSteps(settings), 3);
  EXPECT_EQ(StepLength(settings, 2), 0.1);
  settings.duration = 0.0;
  EXPECT_EQ(NumSteps(settings), 0);
}

TEST(StepTest, AnAdjointWithoutFactorsHasTheSameBits) {
  Scene scene = SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01})"));
  scene.bodies[0].velocity.x() = 1.0;
  Model<double> model;
  RowMatrixXd w_bar[2];
  for (const bool keeps : {true, false}) {
    State<double> state;
    BuildModel(scene, &model, &state);
    Stepper stepper(model);
    stepper.Step(model, 0.0, 0.01, &state);
    StepTape tape;
    stepper.Take(model, keeps, &tape);
    EXPECT_EQ(tape.has_factors, keeps);
    if (!keeps) {
      EXPECT_TRUE(tape.record.problem.contacts.empty() && tape.record.problem.load.empty());
    }
    w_bar[keeps ? 0 : 1].setOnes(model.structure->num_variables(), 2);
    stepper.Adjoint(model, &tape, &w_bar[keeps ? 0 : 1]);
  }
  EXPECT_EQ(w_bar[0], w_bar[1]);
  EXPECT_NE(w_bar[0], RowMatrixXd::Ones(w_bar[0].rows(), w_bar[0].cols()));
}

}  // namespace
}  // namespace tangible
