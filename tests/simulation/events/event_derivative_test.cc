// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_derivative.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/gradients.h"
#include "../../support/scenes.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::Jacobian;

// The five methods on a scene.
void ExpectAllAgree(const std::string& text, const std::vector<std::string>& paths, int events) {
  const Scene scene = SceneOf(text);
  const GradientResult adjoint = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(adjoint.certificate.verdict, "trustworthy");
  EXPECT_GE(adjoint.certificate.events, events);
  testing::ExpectOthersAgree(scene, paths, adjoint);
}

TEST(EventDerivativeTest, ABouncingBallHasThePhysicsDerivative) {
  // Dropped from h, e = 1: z = 2 u t − 2 h − g t²/2 − ..., dz/dh = 2 g τ / u − 1 at t = 0.6 s.
  const Scene scene = SceneOf(R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1.1],
       "restitution": 1},
      {"name": "floor", "static": true, "restitution": 1,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.01, "duration": 0.6}})");
  const double u = std::sqrt(2.0 * 9.81);
  const double tau = 0.6 - u / 9.81;
  const GradientResult result =
      Jacobian(scene, {"bodies/ball/position/y"}, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.jacobian(1, 0), 2.0 * 9.81 * tau / u - 1.0, 1e-12);
  EXPECT_NEAR(result.jacobian(1, 0), -0.342, 5e-4);
}

// Bodies that have nothing to do with each other have events of their own though they happen at
// one instant: each body's derivatives are those that it has alone, and those of the formula.
TEST(EventDerivativeTest, BodiesThatLandAtTheSameInstantHaveTimesOfTheirOwn) {
  const auto scene = [](const char* stepping) {
    return std::string(R"({"bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.125}}, "mass": 1, "position": [0, 0.2],
       "friction": 0.3, "restitution": 0.5, "velocity": [0.3, 0]},
      {"name": "rail", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 2, "position": [1, 0.05],
       "friction": 0.3},
      {"name": "b", "shape": {"circle": {"radius": 0.125}}, "mass": 3, "position": [2, 0.2],
       "friction": 0.3, "restitution": 0.5, "velocity": [0.3, 0]},
      {"name": "floor", "static": true, "restitution": 0.5, "friction": 0.3,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.2)") +
           stepping + "}}";
  };
  const std::vector<std::string> paths = {"bodies/a/position/y", "bodies/b/position/y"};
  for (const char* law : {"", R"(, "impact_law": "poisson")"}) {
    ExpectAllAgree(scene(law), paths, 2);
    const GradientResult r = Jacobian(SceneOf(scene(law)), paths, GradientMethod::kTangent);
    // v = e u − g (T − u / g) with u = √(2 g h):  dv/dh = (1 + e) g / u.
    const double expected = 1.5 * 9.81 / std::sqrt(2.0 * 9.81 * 0.075);
    EXPECT_NEAR(r.jacobian(4, 0), expected, 1e-11);
    EXPECT_NEAR(r.jacobian(16, 1), expected, 1e-11);
    EXPECT_NEAR(r.jacobian(4, 1), 0.0, 1e-13);
    EXPECT_NEAR(r.jacobian(16, 0), 0.0, 1e-13);
  }
}

TEST(EventDerivativeTest, BodiesThatStopAtTheSameInstantHaveTimesOfTheirOwn) {
  const auto box = [](const char* name, double x) {
    return R"({"name": ")" + std::string(name) +
           R"(", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1, "friction": 0.3,
        "velocity": [0.7, 0], "position": [)" +
           std::to_string(x) + ", 0.05]}";
  };
  const Scene scene = SceneOf(R"({"bodies": [)" + box("a", 0.0) + ", " + box("b", 1.0) + ", " +
                              box("c", 2.0) + R"(, {"name": "floor", "static": true,
      "friction": 0.3, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.5}})");
  const std::vector<std::string> paths = {"bodies/a/velocity/x", "bodies/b/velocity/x",
                                          "bodies/c/velocity/x"};
  const GradientResult r = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(r.certificate.verdict, "trustworthy");
  EXPECT_EQ(r.certificate.events, 3);
  testing::ExpectOthersAgree(scene, paths, r);
  // x = v² / (2 μ g)
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      EXPECT_NEAR(r.jacobian(6 * i, j), i == j ? 0.7 / (0.3 * 9.81) : 0.0, 1e-12);
    }
  }
}

TEST(EventDerivativeTest, TwoEqualElasticBallsSwap) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0],
       "velocity": [1, 0], "restitution": 1},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [1, 0],
       "restitution": 1}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.01, "duration": 1.5}})");
  const GradientResult r =
      Jacobian(scene, {"bodies/a/velocity/x", "bodies/b/velocity/x"}, GradientMethod::kTangent);
  EXPECT_NEAR(r.jacobian(3, 0), 0.0, 1e-14);
  EXPECT_NEAR(r.jacobian(9, 0), 1.0, 1e-14);
  EXPECT_NEAR(r.jacobian(3, 1), 1.0, 1e-14);
  EXPECT_NEAR(r.jacobian(9, 1), 0.0, 1e-14);
}

TEST(EventDerivativeTest, ASpinningBallOnASlope) {
  ExpectAllAgree(
      R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1.3, "position": [0, 0.6],
       "velocity": [1, 0.3], "angular_velocity": 5, "restitution": 0.7, "friction": 0.2},
      {"name": "floor", "static": true, "friction": 0.4, "restitution": 0.5,
       "shape": {"half_plane": {"normal": [0.1, 1], "offset": 0}}}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.01, "duration": 0.9}})",
      {"bodies/ball/position/y", "bodies/ball/velocity/x", "bodies/ball/angular_velocity",
       "bodies/*/friction", "bodies/floor/restitution", "bodies/ball/shape/radius", "gravity/y",
       "bodies/floor/shape/normal/x", "bodies/ball/mass"},
      2);
}

TEST(EventDerivativeTest, ABoxThatLandsOnACornerAndSlides) {
  for (const char* integrator : {"trapezoidal", "runge_kutta_4"}) {
    ExpectAllAgree(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1.3, "position": [0, 0.6],
       "angle": 0.3, "velocity": [1, 0.3], "angular_velocity": 1, "friction": 0.2,
       "linear_damping": 0.1},
      {"name": "floor", "static": true, "friction": 0.4,
       "shape": {"half_plane": {"normal": [0.1, 1], "offset": 0}}}],
    "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.5, "integrator": ")" +
                       std::string(integrator) + R"("}})",
                   {"bodies/box/position/y", "bodies/box/angle", "bodies/box/friction",
                    "bodies/box/shape/size/x", "gravity/y", "bodies/box/mass",
                    "bodies/box/linear_damping", "bodies/floor/shape/normal/x"},
                   1);
  }
}

TEST(EventDerivativeTest, SlidingThatEndsAndForcesThatBegin) {
  ExpectAllAgree(R"({"bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.2}}, "mass": 2, "position": [0, 0.2],
       "velocity": [2, 0], "friction": 0.3},
      {"name": "floor", "static": true, "friction": 0.3,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "forces": [{"name": "push", "body": "disc", "force": [1, -1], "torque": 0.1, "at": [0, 0.05],
                "start": 0.033, "end": 0.187}],
    "simulation": {"stepping": "event", "integrator": "runge_kutta_4", "dt": 0.01,
                   "duration": 0.6}})",
                 {"bodies/disc/velocity/x", "bodies/*/friction", "gravity/y", "bodies/disc/mass",
                  "forces/push/force/x", "forces/push/start", "forces/push/end",
                  "forces/push/torque", "forces/push/at/y"},
                 3);
}

TEST(EventDerivativeTest, JointsWithALimitASpringAndAJerkedPin) {
  for (const char* correction : {"none", "projection"}) {
    ExpectAllAgree(R"({"bodies": [
      {"name": "a", "mass": 1, "inertia": 0.02, "position": [0.5, 0]},
      {"name": "b", "mass": 1, "inertia": 0.02, "position": [1.5, 0]}],
    "joints": [{"name": "p", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "damping": 0.05, "limits": [-0.6, 1.2], "angle": 0.2},
               {"name": "q", "type": "revolute", "bodies": ["b", "a"], "anchor": [1, 0],
                "rate": 0.5, "effort": 0.1}],
    "springs": [{"name": "s", "bodies": ["b", "world"], "anchors": [[1.5, 0], [1, 1]],
                 "stiffness": 3, "damping": 0.2, "rest_length": 0.5}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.01, "duration": 0.7,
                   "joint_correction": ")" +
                       std::string(correction) + R"("}})",
                   {"bodies/a/mass", "bodies/b/inertia", "gravity/y", "joints/p/angle",
                    "joints/q/rate", "joints/p/damping", "joints/q/effort", "joints/q/anchor/x",
                    "springs/s/stiffness", "springs/s/damping", "springs/s/rest_length"},
                   1);
  }
}

// F = 6 t, pushed above the middle: the front carries more than the back. What the two corners
// share of the friction is not determined; that the box slides is, at t = μ m g / 6. A pendulum
// beside it, whose steps an event within them would split.
TEST(EventDerivativeTest, BothEndsOfAFaceBeginToSlideAsOne) {
  Scene scene = SceneOf(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
       "friction": 0.4},
      {"name": "rod", "mass": 1, "inertia": 0.02, "position": [2.3, 1]},
      {"name": "floor", "static": true, "friction": 0.4,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [2, 1]}],
    "forces": [{"name": "push", "body": "box", "force": [0, 0], "at": [0, 0.06]}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.01,
                   "duration": 1.5}})");
  Signal ramp;
  ramp.interpolation = Signal::Interpolation::kLinear;
  ramp.time = {0.0, 10.0};
  ramp.x = {0.0, 60.0};
  scene.forces[0].force_signal = ramp;
  const std::vector<std::string> paths = {"bodies/*/friction", "bodies/box/mass", "gravity/y"};
  const GradientResult adjoint = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(adjoint.certificate.verdict, "trustworthy");
  EXPECT_EQ(adjoint.certificate.events, 1);
  // v = 6 (T − s)² / (2 m), s = μ m g / 6.
  const double left = 1.5 - 0.4 * 2.0 * 9.81 / 6.0;
  EXPECT_NEAR(adjoint.values[3], 6.0 * left * left / 4.0, 1e-12);
  EXPECT_NEAR(adjoint.jacobian(3, 0), -9.81 * left, 1e-11);
  testing::ExpectOthersAgree(scene, paths, adjoint);
}

}  // namespace
}  // namespace tangible
