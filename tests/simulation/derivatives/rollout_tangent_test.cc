// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/derivatives/rollout_tangent.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/dynamics/model/parameter_map.h"

namespace tangible {
namespace {

// The derivative of the final state of a scene with respect to one number.
struct Derivative {
  Model<double> model;
  State<double> final;
  RowMatrixXd w_dot;
};
Derivative Differentiate(const Scene& scene, const std::string& path) {
  Derivative d;
  State<double> initial;
  BuildModel(scene, &d.model, &initial);
  ParameterPath parameter;
  std::string error;
  EXPECT_TRUE(ResolveParameter(scene, path, &parameter, &error)) << error;
  d.w_dot = VariableJacobian(scene, d.model.structure, {DirectionOf(parameter)});
  EXPECT_EQ(RolloutTangent(d.model, initial, {}, &d.w_dot, &d.final).status, StepStatus::kDone);
  return d;
}

// A ball that slides on the floor for N steps: v_k = v0 − μ g k h, so
//   ∂x_N/∂μ = −g h² N (N + 1) / 2 times ½ (the mean of two coefficients), ∂x_N/∂m = 0.
TEST(RolloutTangentTest, SlidingBallIsTheDiscreteClosedForm) {
  Scene scene =
      test_scenes::SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01, "duration": 0.3})"));
  scene.bodies[0].velocity.x() = 3.0;
  const int n = 30;
  const double sum = 1e-4 * n * (n + 1) / 2.0;
  Derivative d = Differentiate(scene, "bodies/ball/friction");
  EXPECT_NEAR(d.final.pose[0], 3.0 * 0.3 - 0.15 * 9.81 * sum, 1e-13);
  EXPECT_NEAR(d.w_dot(0, 0), -0.5 * 9.81 * sum, 1e-12);
  EXPECT_LT(d.w_dot(0, 0), -0.2);  // and not +: the sign that is easily lost
  EXPECT_NEAR(d.w_dot(2, 0), -0.5 * 9.81 * sum * 0.1 / 0.005, 1e-10);
  d = Differentiate(scene, "bodies/ball/mass");
  EXPECT_NEAR(d.w_dot(0, 0), 0.0, 1e-14);
  d = Differentiate(scene, "gravity/y");
  EXPECT_NEAR(d.w_dot(0, 0), 0.15 * sum, 1e-13);
  EXPECT_NEAR(d.w_dot(1, 0), 0.0, 1e-13);
  d = Differentiate(scene, "bodies/ball/velocity/x");
  EXPECT_NEAR(d.w_dot(0, 0), 0.3, 1e-13);
}

TEST(RolloutTangentTest, AForceOnASlidingBoxShowsItsMass) {
  Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
       "velocity": [2, 0], "friction": 0.3},
      {"name": "floor", "static": true, "friction": 0.3,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "forces": [{"name": "push", "body": "box", "force": [1.5, 0], "at": [0, -0.1]}],
    "simulation": {"dt": 0.01, "duration": 0.2}})");
  const double sum = 1e-4 * 20 * 21 / 2.0;
  EXPECT_NEAR(Differentiate(scene, "bodies/box/mass").w_dot(0, 0), -1.5 / 4.0 * sum, 1e-12);
  EXPECT_NEAR(Differentiate(scene, "forces/push/force/x").w_dot(0, 0), 0.5 * sum, 1e-12);
}

TEST(RolloutTangentTest, ARestingBodyFollowsTheFloor) {
  Scene scene =
      test_scenes::SceneOf(test_scenes::FallingBall(0.0, R"({"dt": 0.01, "duration": 0.3})"));
  const Derivative offset = Differentiate(scene, "bodies/floor/shape/offset");
  EXPECT_NEAR(offset.w_dot(1, 0), 1.0, 1e-12);
  EXPECT_NEAR(offset.w_dot(0, 0), 0.0, 1e-12);
  EXPECT_NEAR(Differentiate(scene, "bodies/ball/position/y").w_dot(1, 0), 0.0, 1e-12);
  // It sticks at once, so it rolls: two thirds of h² N (N + 1) / 2.
  EXPECT_NEAR(Differentiate(scene, "gravity/x").w_dot(0, 0), 2.0 / 3.0 * 1e-4 * 465.0, 1e-12);
}

TEST(RolloutTangentTest, NumbersThatNoColumnVariesAreLeftOut) {
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  std::vector<ParameterDirection> parameters;
  for (const char* path : {"bodies/crate/friction", "bodies/rod/mass", "bodies/ball/velocity/x"}) {
    ParameterPath parameter;
    std::string error;
    ASSERT_TRUE(ResolveParameter(scene, path, &parameter, &error)) << error;
    parameters.push_back(DirectionOf(parameter));
  }
  RowMatrixXd reduced = VariableJacobian(scene, model.structure, parameters);
  RowMatrixXd full = reduced;
  const RolloutReport report = RolloutTangent(model, initial, {}, &reduced, &final);
  ASSERT_EQ(report.status, StepStatus::kDone);
  // Friction, the rod's mass and inertia; the rest of the model's numbers is fixed.
  EXPECT_EQ(report.fixed_numbers, model.structure->num_parameters - 3);
  StepTangent tangent;
  Rollout(
      model, initial,
      [&](long, double, const State<double>&, Stepper* stepper) {
        if (stepper != nullptr) tangent.Apply(model, stepper, &full);
      },
      &final);
  EXPECT_EQ(reduced, full);  // to the last bit
  EXPECT_GT(reduced.col(1).head(6 * model.structure->num_bodies()).norm(), 1e-3);
}

TEST(RolloutTangentTest, ObserverSeesTheTangentOfEachState) {
  const Scene scene =
      test_scenes::SceneOf(test_scenes::FallingBall(10.0, R"({"dt": 0.01, "duration": 0.1})"));
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  RowMatrixXd w_dot = RowMatrixXd::Zero(model.structure->num_variables(), 1);
  w_dot(model.structure->ParameterVariable(kGravityY), 0) = 1.0;
  long calls = 0;
  RolloutTangent(
      model, initial,
      [&](long k, double, const State<double>&, const RowMatrixXd& w) {
        EXPECT_NEAR(w(1, 0), 1e-4 * k * (k + 1) / 2.0, 1e-15);
        ++calls;
      },
      &w_dot, &final);
  EXPECT_EQ(calls, 11);
}

}  // namespace
}  // namespace tangible
