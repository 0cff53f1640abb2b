// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/segment_flow.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/simulation/stepping/joint_projection.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

Scene WithIntegrator(const std::string& bodies, const char* integrator, double dt,
                     double duration) {
  return SceneOf("{" + bodies + R"(, "simulation": {"stepping": "event", "integrator": ")" +
                 integrator + R"(", "dt": )" + std::to_string(dt) + R"(, "duration": )" +
                 std::to_string(duration) + "}}");
}

State<double> Final(const Scene& scene) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  const RolloutReport report = Rollout(model, state, nullptr, &state);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  return state;
}

TEST(NystromTableauTest, IsConsistent) {
  for (const Integrator integrator : {Integrator::kTrapezoidal, Integrator::kRungeKutta4}) {
    const NystromTableau& t = NystromTableau::Of(integrator);
    double b = 0.0;
    double b_hat = 0.0;
    for (int i = 0; i < t.stages; ++i) {
      b += t.b[i];
      b_hat += t.b_hat[i];
      double a = 0.0;
      for (int j = 0; j < t.stages; ++j) {
        a += t.a[i][j];
      }
      EXPECT_DOUBLE_EQ(a, t.c[i]);
    }
    EXPECT_DOUBLE_EQ(b, 1.0);
    EXPECT_DOUBLE_EQ(b_hat, 0.5);
  }
}

TEST(SegmentFlowTest, AParabolaIsExact) {
  const std::string ball = R"("bodies": [{"name": "a", "shape": {"circle": {"radius": 0.1}},
      "mass": 1, "position": [0, 0], "velocity": [2, 3]}])";
  for (const char* integrator : {"trapezoidal", "runge_kutta_4"}) {
    const State<double> end = Final(WithIntegrator(ball, integrator, 0.07, 1.0));
    EXPECT_NEAR(end.pose[0], 2.0, 1e-14);
    EXPECT_NEAR(end.pose[1], 3.0 - 0.5 * 9.81, 1e-14);
    EXPECT_NEAR(end.twist[1], 3.0 - 9.81, 1e-14);
  }
}

// A driven, damped double pendulum: error against dt.
TEST(SegmentFlowTest, OrdersOfConvergence) {
  const std::string pendulum = R"("bodies": [
      {"name": "a", "mass": 1, "inertia": 0.02, "position": [0.5, 0]},
      {"name": "b", "mass": 0.7, "inertia": 0.01, "position": [1.4, 0]}],
    "joints": [
      {"name": "p", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0], "damping": 0.1},
      {"name": "q", "type": "revolute", "bodies": ["b", "a"], "anchor": [1, 0], "rate": 1.5}],
    "springs": [{"name": "s", "bodies": ["b", "world"], "anchors": [[1.4, 0], [1, 1]],
                 "stiffness": 3, "damping": 0.2, "rest_length": 0.5}])";
  const State<double> exact = Final(WithIntegrator(pendulum, "runge_kutta_4", 0.0005, 0.5));
  const struct {
    const char* integrator;
    double order;
  } cases[] = {{"trapezoidal", 1.9}, {"runge_kutta_4", 3.8}};
  for (const auto& c : cases) {
    double error[2];
    for (int k = 0; k < 2; ++k) {
      const State<double> end =
          Final(WithIntegrator(pendulum, c.integrator, k == 0 ? 0.02 : 0.01, 0.5));
      error[k] = std::hypot(end.pose[2] - exact.pose[2], end.twist[5] - exact.twist[5]);
    }
    EXPECT_GE(std::log2(error[0] / error[1]), c.order) << c.integrator << " " << error[1];
    EXPECT_GT(error[1], 1e-13);
  }
}

TEST(SegmentFlowTest, ProjectionKeepsJointsAndContacts) {
  Scene scene = SceneOf(R"({"bodies": [
      {"name": "wheel", "shape": {"circle": {"radius": 0.2}}, "mass": 1, "position": [0, 0.2],
       "velocity": [1, 0], "angular_velocity": -5, "friction": 1},
      {"name": "bob", "mass": 0.5, "inertia": 0.01, "position": [0.5, 0.2], "velocity": [1, 0]},
      {"name": "floor", "static": true, "friction": 1,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "joints": [{"name": "arm", "type": "revolute", "bodies": ["bob", "wheel"], "anchor": [0.0, 0.2]}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.02, "duration": 0.4,
                   "joint_correction": "projection"}})");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  double drift = 0.0;
  double height = 0.0;
  const RolloutReport report = Rollout(
      model, state,
      [&](long, double, const State<double>& s, Stepper*) {
        drift = std::max(drift, JointDrift(model, s));
        height = std::max(height, std::abs(s.pose[1] - 0.2));
      },
      &state);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_LE(drift, 1e-12);
  EXPECT_LE(height, 1e-14);
  // It rolls: x' = −ω r.
  EXPECT_NEAR(state.twist[0], -0.2 * state.twist[2], 1e-12);
}

}  // namespace
}  // namespace tangible
