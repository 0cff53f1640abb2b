// SPDX-License-Identifier: Apache-2.0
//
// Segments of no length: what derivatives need at instants that no search finds.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "../../support/gradients.h"
#include "../../support/scenes.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::Jacobian;

std::vector<GradientMethod> Methods() {
  std::vector<GradientMethod> methods = {GradientMethod::kAdjoint, GradientMethod::kTangent};
  if (testing::HaveJets()) {
    methods.push_back(GradientMethod::kJetImplicit);
    methods.push_back(GradientMethod::kJet);
  }
  return methods;
}

// Equal elastic discs meet after 0.3 s, the end of a step; and so near to it that rounding says on
// which side: x_b = x_a + v_a T + 2 r.
TEST(EventInstantTest, AnImpactOnAStepsBoundaryIsAnEventInTime) {
  for (const int ulps : {0, -40, -12, -5, -3, -2, -1, 1, 2, 3, 5, 12, 40}) {
    for (const double dt : {0.025, 0.3}) {
      Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
          {"name": "a", "shape": {"circle": {"radius": 0.2}}, "mass": 1, "position": [0, 0],
           "velocity": [2, 0], "restitution": 1},
          {"name": "b", "shape": {"circle": {"radius": 0.2}}, "mass": 1, "position": [1, 0],
           "restitution": 1}],
        "simulation": {"stepping": "event", "integrator": "trapezoidal", "duration": 0.9}})");
      scene.bodies[1].position[0] += ulps * 1.1102230246251565e-16;
      scene.simulation.dt = dt;
      for (const GradientMethod method : Methods()) {
        const RowMatrixXd jacobian = Jacobian(scene,
                                              {"bodies/a/position/x", "bodies/b/position/x",
                                               "bodies/a/velocity/x", "bodies/b/velocity/x"},
                                              method, CertificatePass::kSkip)
                                         .jacobian;
        const double expected[] = {1.0, 0.0, 0.9, 0.0};
        for (int k = 0; k < 4; ++k) {
          EXPECT_NEAR(jacobian(6, k), expected[k], 1e-7)
              << "parameter " << k << ", method " << static_cast<int>(method) << ", dt " << dt
              << ", " << ulps << " ulps";
        }
      }
    }
  }
}

// A disc that rolls down. Spin added at the start slips for an instant and is shared, with k = I /
// m r²: v = (v0 − k r w0) / (1 + k), w = −v / r.
TEST(EventInstantTest, SpinAddedToARollingDiscIsSharedAtOnce) {
  const Scene scene = SceneOf(R"({"gravity": [3, -9], "bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.2}}, "mass": 1, "inertia": 0.03,
       "position": [0, 0.2], "friction": 0.8},
      {"name": "floor", "static": true, "friction": 0.8,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.1, "duration": 0.7}})");
  const double k = 0.03 / 0.04;
  const double slower = -k * 0.2 / (1.0 + k);
  for (const GradientMethod method : Methods()) {
    const RowMatrixXd jacobian =
        Jacobian(scene, {"bodies/disc/angular_velocity"}, method, CertificatePass::kSkip).jacobian;
    EXPECT_NEAR(jacobian(0, 0), 0.7 * slower, 1e-7) << static_cast<int>(method);
    EXPECT_NEAR(jacobian(2, 0), -0.7 * slower / 0.2, 1e-7) << static_cast<int>(method);
    EXPECT_NEAR(jacobian(3, 0), slower, 1e-7) << static_cast<int>(method);
  }
}

// A flat box that slides and turns by less than rounding shows rocks to rest: all that its contacts
// carry, they carry with friction, v = v0 − μ g t.
TEST(EventInstantTest, ABoxThatRocksToRestKeepsItsFriction) {
  for (const double turn : {0.0, 1e-6, -1e-6, 1e-5, -1e-5, 1e-4, -1e-4}) {
    Scene scene = SceneOf(R"({"gravity": [0, -10], "bodies": [
        {"name": "box", "shape": {"box": {"size": [0.44, 0.48]}}, "mass": 0.5, "inertia": 0.018,
         "position": [0, 0.24], "velocity": [-0.85, 0], "friction": 0.45},
        {"name": "floor", "static": true, "friction": 0.45,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.06}})");
    scene.bodies[0].angular_velocity = turn;
    Model<double> model;
    State<double> state;
    BuildModel(scene, &model, &state);
    State<double> final;
    ASSERT_EQ(Rollout(model, state, {}, &final).status, StepStatus::kDone);
    // What is left is that of a fall by the touching tolerance.
    EXPECT_NEAR(final.twist[0], -0.85 + 0.45 * 10.0 * 0.06, 1e-9) << turn;
  }
}

// Two discs slide off their ledges at the same instant, a step's end. From x = d on each falls:
// y = r − g (T − d / v)² / 2.
TEST(EventInstantTest, TwoDiscsLeaveTheirFacesAtOnce) {
  const Scene scene = SceneOf(R"({"gravity": [0, -5], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.25}}, "mass": 2, "position": [0, 20.25],
       "velocity": [3, 0]},
      {"name": "left", "static": true, "shape": {"box": {"size": [10, 0.5]}},
       "position": [-4.1, 19.75]},
      {"name": "b", "shape": {"circle": {"radius": 0.25}}, "mass": 2, "position": [10, 40.25],
       "velocity": [-3, 0]},
      {"name": "right", "static": true, "shape": {"box": {"size": [10, 0.5]}},
       "position": [14.1, 39.75]}],
    "simulation": {"stepping": "event", "dt": 0.1, "duration": 0.56}})");
  for (const GradientMethod method : Methods()) {
    const GradientResult result =
        Jacobian(scene, {"bodies/a/velocity/x", "bodies/b/velocity/x"}, method);
    EXPECT_NEAR(result.values[4], -5.0 * 0.26, 1e-9);
    EXPECT_NEAR(result.values[10], -5.0 * 0.26, 1e-9);
    for (int disc = 0; disc < 2; ++disc) {
      const double sign = disc == 0 ? 1.0 : -1.0;  // of the speed
      SCOPED_TRACE(std::to_string(disc) + ", method " + std::to_string(static_cast<int>(method)));
      EXPECT_NEAR(result.jacobian(6 * disc + 1, disc), -5.0 * 0.26 * 0.1 * sign, 1e-7);
      EXPECT_NEAR(result.jacobian(6 * disc + 4, disc), -5.0 * 0.1 * sign, 1e-7);
      EXPECT_NEAR(result.jacobian(6 * disc + 4, 1 - disc), 0.0, 1e-9);
    }
  }
}

// A slider stops at 0.2 s, m v / 3, and is drawn back at 2 m/s²; at that instant a wheel breaks
// loose, whose effort grows to its friction, or a ball lands.
TEST(EventInstantTest, ASlipEndsAtTheInstantOfAnotherEvent) {
  for (const bool lands : {false, true}) {
    for (const bool slider_first : {true, false}) {
      Scene scene = SceneOf(R"({"gravity": [0, -10], "bodies": [
          {"name": "slider", "mass": 0.5, "inertia": 1, "position": [0, 3], "velocity": [1.2, 0]},
          {"name": "wheel", "mass": 1, "inertia": 0.5, "position": [10, 3]},
          {"name": "ball", "shape": {"circle": {"radius": 0.25}}, "mass": 1, "position": [20, 0.45],
           "restitution": 0.5},
          {"name": "floor", "static": true, "restitution": 0.5,
           "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
        "joints": [
          {"name": "rail", "type": "prismatic", "bodies": ["slider", "world"], "anchor": [0, 3],
           "axis": [1, 0], "friction": 1, "effort": -2},
          {"name": "axle", "type": "revolute", "bodies": ["wheel", "world"], "anchor": [10, 3],
           "friction": 2}],
        "simulation": {"stepping": "event", "dt": 0.05, "duration": 0.4}})");
      Signal effort;
      effort.file = "effort.csv";
      effort.interpolation = Signal::Interpolation::kLinear;
      effort.time = {0.0, 1.0};
      effort.value = {0.0, lands ? 1.0 : 10.0};
      scene.joints[1].effort_signal = effort;
      if (!lands) scene.bodies[2].position.y() = 5.0;
      if (!slider_first) std::swap(scene.joints[0], scene.joints[1]);
      for (const GradientMethod method : Methods()) {
        SCOPED_TRACE(std::to_string(lands) + std::to_string(slider_first) + ", method " +
                     std::to_string(static_cast<int>(method)));
        const GradientResult result = Jacobian(
            scene, {"bodies/slider/velocity/x", "joints/axle/friction", "bodies/ball/position/y"},
            method, CertificatePass::kSkip);
        EXPECT_NEAR(result.values[3], -2.0 * 0.2, 1e-10);
        EXPECT_NEAR(result.jacobian(0, 0), 0.2 + 2.0 * 0.2 * 0.5 / 3.0, 1e-8);
        EXPECT_NEAR(result.jacobian(3, 0), 2.0 * 0.5 / 3.0, 1e-8);
        EXPECT_NEAR(result.jacobian(3, 1), 0.0, 1e-8);
        EXPECT_NEAR(result.jacobian(3, 2), 0.0, 1e-8);
        if (lands) {
          // v = e √(2 g h) − g (T − √(2 h / g)), h = 0.2
          EXPECT_NEAR(result.jacobian(16, 2), 0.5 * 10.0 / 2.0 + 10.0 * 0.1 / 0.2, 1e-7);
        } else {
          // ω = k (T − F / k)² / (2 I)
          EXPECT_NEAR(result.jacobian(11, 1), -0.2 / 0.5, 1e-8);
        }
      }
    }
  }
}

}  // namespace
}  // namespace tangible
