// SPDX-License-Identifier: Apache-2.0
//
// Friction where nothing else acts, or next to nothing: joints that coast, stop and are pushed
// again, contacts that only a force presses together, and impacts after which nothing acts.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/sanitizers.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using test_scenes::Text;
using testing::ExpectOthersAgree;
using testing::Jacobian;

State<double> StateAfter(const Scene& scene) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  const RolloutReport report = Rollout(model, state, {}, &state);
  EXPECT_EQ(report.message, "");
  return state;
}

const std::vector<double> kGravities =
    testing::kSanitized ? std::vector<double>{0.0, 1e-7}
                        : std::vector<double>{0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-4};

std::string Head(double gravity) { return R"({"gravity": [0, )" + Text(-gravity) + "], "; }
std::string ByEventsFor(double duration, const std::string& more = "") {
  return R"(, "simulation": {"stepping": "event", "dt": 0.01, "duration": )" + Text(duration) +
         more + "}}";
}

Scene Flywheel(double gravity, double speed, double friction, double radius, double duration,
               const std::string& more = "", const std::string& of_joint = "") {
  return SceneOf(Head(gravity) + R"("bodies": [{"name": "w", "mass": 1,
      "inertia": )" +
                 Text(0.5 * radius * radius) + R"(, "shape": {"circle": {"radius": )" +
                 Text(radius) + R"(}}, "position": [0, 0], "angular_velocity": )" + Text(speed) +
                 R"(}], "joints": [{"name": "p", "type": "revolute", "bodies": ["w", "world"],
      "anchor": [0, 0], "friction": )" +
                 Text(friction) + of_joint + "}]" + more + ByEventsFor(duration));
}

// The speed falls at F / I, and the wheel stays where it has stopped.
TEST(UnloadedFrictionTest, AFlywheelCoastsToRest) {
  for (const double gravity : kGravities) {
    for (const double radius : {1e-3, 0.1, 10.0}) {
      const double inertia = 0.5 * radius * radius;
      for (const double stop : {0.6137, 7.0}) {  // s
        const double speed = -5.0;
        const double friction = std::abs(speed) / stop * inertia;
        const Scene scene = Flywheel(gravity, speed, friction, radius, 1.0);
        const std::vector<std::string> paths = {"bodies/w/angular_velocity", "joints/p/friction",
                                                "bodies/w/inertia"};
        const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
        const double slope = friction / inertia;
        const double t = std::min(1.0, stop);
        SCOPED_TRACE(Text(gravity) + " m/s², " + Text(radius) + " m, " + Text(stop) + " s");
        EXPECT_NEAR(result.values[2], speed * t + 0.5 * slope * t * t, 1e-10);
        EXPECT_NEAR(result.values[5], speed + slope * t, 1e-10);
        // The angle: (|ω| t − a t²/2) with t = |ω| / a where it stops, and signs.
        EXPECT_NEAR(result.jacobian(2, 0), t, 1e-8);
        EXPECT_NEAR(result.jacobian(2, 1) * inertia, 0.5 * t * t, 1e-8);
        EXPECT_NEAR(result.jacobian(2, 2) * inertia, -0.5 * slope * t * t, 1e-8 * (1.0 + slope));
        ExpectOthersAgree(scene, paths, result);
      }
    }
  }
}

// A body without a shape has no radius.
TEST(UnloadedFrictionTest, AFlywheelWithoutAShape) {
  for (const double gravity : kGravities) {
    const Scene scene = SceneOf(Head(gravity) + R"("bodies": [{"name": "w", "mass": 3,
        "inertia": 0.005, "position": [0, 0], "angular_velocity": 5}], "joints": [{"name": "p",
        "type": "revolute", "bodies": ["w", "world"], "anchor": [0, 0], "friction": 0.04}])" +
                                ByEventsFor(1.0));
    const State<double> rollout = StateAfter(scene);
    EXPECT_NEAR(rollout.pose[2], 0.5 * 25.0 / 8.0, 1e-10) << gravity;
    EXPECT_NEAR(rollout.twist[2], 0.0, 1e-12) << gravity;
  }
}

TEST(UnloadedFrictionTest, ASliderCoastsToRest) {
  for (const double gravity : kGravities) {
    for (const double friction : {0.5, 3.7}) {
      // Gravity is along the slider's normal.
      const Scene scene = SceneOf(Head(gravity) + R"("bodies": [{"name": "c", "mass": 2,
          "shape": {"box": {"size": [0.2, 0.2]}}, "position": [0, 0], "velocity": [2, 0]}],
          "joints": [{"name": "p", "type": "prismatic", "bodies": ["c", "world"],
          "anchor": [0, 0], "axis": [1, 0], "friction": )" +
                                  Text(friction) + "}]" + ByEventsFor(2.0));
      const std::vector<std::string> paths = {"bodies/c/velocity/x", "joints/p/friction",
                                              "bodies/c/mass"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      const double a = friction / 2.0;
      const double t = std::min(2.0, 2.0 / a);
      SCOPED_TRACE(Text(gravity) + " m/s², " + Text(friction) + " N");
      EXPECT_NEAR(result.values[0], 2.0 * t - 0.5 * a * t * t, 1e-10);
      EXPECT_NEAR(result.values[3], 2.0 - a * t, 1e-10);
      EXPECT_NEAR(result.jacobian(0, 0), t, 1e-8);
      EXPECT_NEAR(result.jacobian(0, 1), -0.25 * t * t, 1e-8);
      EXPECT_NEAR(result.jacobian(0, 2), 0.25 * a * t * t, 1e-8);
      ExpectOthersAgree(scene, paths, result);
    }
  }
}

// The arm swings on while the slider stands still, and pulls it.
TEST(UnloadedFrictionTest, ASliderWithAnArm) {
  const auto arm = [](double gravity, const std::string& stepping, double dt) {
    return SceneOf(Head(gravity) + R"("bodies": [
        {"name": "c", "mass": 1, "shape": {"box": {"size": [0.2, 0.2]}}, "position": [0, 0],
         "velocity": [2, 0]},
        {"name": "a", "mass": 0.5, "shape": {"box": {"size": [0.6, 0.1]}}, "position": [0.4, 0],
         "velocity": [2, 0.4], "angular_velocity": 1.3333333333333333}],
        "joints": [{"name": "p", "type": "prismatic", "bodies": ["c", "world"], "anchor": [0, 0],
          "axis": [1, 0], "friction": 3},
         {"name": "m", "type": "revolute", "bodies": ["a", "c"], "anchor": [0.1, 0]}],
        "no_contact": [["a", "c"]], "simulation": {"stepping": ")" +
                   stepping + R"(", "duration": 1.5, "dt": )" + Text(dt) + "}}");
  };
  const State<double> fixed = StateAfter(arm(0.0, "fixed", 1e-4));
  for (const double gravity : kGravities) {
    const State<double> rollout = StateAfter(arm(gravity, "event", 0.01));
    for (size_t i = 0; i < 6; ++i) {
      // The fixed steps are of first order, and the arm falls in small gravity.
      EXPECT_NEAR(rollout.pose[i], fixed.pose[i], 1e-3 + 4.0 * gravity) << gravity << ", " << i;
    }
  }
}

// A pulse of effort τ up to t1 and the friction F: the wheel turns at (τ − F) t1 / I, then coasts.
TEST(UnloadedFrictionTest, AReactionWheelAfterItsPulse) {
  for (const double gravity : kGravities) {
    for (const double t1 : {0.2, 0.1037}) {
      const Scene scene = Flywheel(
          gravity, 0.0, 0.01, 0.1, 1.0,
          R"(, "forces": [{"name": "f", "body": "w", "torque": 0.03, "end": )" + Text(t1) + "}]");
      const double inertia = 0.005;
      const double top = 0.02 * t1 / inertia;
      const double coasts = top * inertia / 0.01;  // s
      ASSERT_LT(t1 + coasts, 1.0);
      const std::vector<std::string> paths = {"forces/f/end", "joints/p/friction",
                                              "forces/f/torque"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      SCOPED_TRACE(Text(gravity) + " m/s², " + Text(t1) + " s");
      // The angle at rest is (τ − F) τ t1² / (2 I F).
      EXPECT_NEAR(result.values[2], 0.02 * 0.03 * t1 * t1 / (2.0 * inertia * 0.01), 1e-10);
      EXPECT_NEAR(result.values[5], 0.0, 1e-12);
      EXPECT_NEAR(result.jacobian(2, 0), 0.02 * 0.03 * t1 / (inertia * 0.01), 1e-8);
      EXPECT_NEAR(result.jacobian(2, 1), -0.03 * 0.03 * t1 * t1 / (2.0 * inertia * 1e-4), 1e-8);
      EXPECT_NEAR(result.jacobian(2, 2), (2.0 * 0.03 - 0.01) * t1 * t1 / (2.0 * inertia * 0.01),
                  1e-8);
      ExpectOthersAgree(scene, paths, result);
    }
  }
}

// Two links that are free but for their elbow: momentum is kept, and the elbow stops.
TEST(UnloadedFrictionTest, FreeLinksWithAnElbow) {
  const auto links = [](const std::string& stepping, double dt, double friction) {
    return SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "a", "mass": 1, "shape": {"box": {"size": [1, 0.1]}}, "position": [-0.5, 0]},
        {"name": "b", "mass": 1, "shape": {"box": {"size": [1, 0.1]}}, "position": [0.5, 0]}],
        "joints": [{"name": "e", "type": "revolute", "bodies": ["b", "a"], "anchor": [0, 0],
          "friction": )" +
                   Text(friction) + R"(}], "no_contact": [["a", "b"]],
        "forces": [{"name": "t", "body": "a", "torque": 1, "start": 0, "end": 0.1}],
        "simulation": {"duration": 1, "dt": )" +
                   Text(dt) + R"(, "stepping": ")" + stepping + "\"}}");
  };
  for (const double friction : {0.01, 0.2}) {
    const State<double> fixed = StateAfter(links("fixed", 1e-4, friction));
    const State<double> rollout = StateAfter(links("event", 0.01, friction));
    for (size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(rollout.pose[i], fixed.pose[i], 1e-3) << i;
      EXPECT_NEAR(rollout.twist[i], fixed.twist[i], 1e-3) << i;
    }
    const std::vector<std::string> paths = {"joints/e/friction", "forces/t/end", "bodies/a/mass"};
    const GradientResult result =
        Jacobian(links("event", 0.01, friction), paths, GradientMethod::kAdjoint);
    ExpectOthersAgree(links("event", 0.01, friction), paths, result);
  }
}

// With Stribeck's decay the wheel stops faster at low speed: the fixed steps do not have it, so the
// speed is integrated here.
TEST(UnloadedFrictionTest, AFlywheelWithStribecksDecay) {
  const double friction = 0.02, kinetic = 0.01, stribeck = 1.0, inertia = 0.005;
  double speed = 5.0;
  const auto rate = [&](double v) {
    return -(kinetic + (friction - kinetic) * std::exp(-v * v / (stribeck * stribeck))) / inertia;
  };
  constexpr int kSteps = 100000;
  const double h = 2.0 / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    const double a = rate(speed), b = rate(speed + 0.5 * h * a), c = rate(speed + 0.5 * h * b);
    speed += h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(speed + h * c));
  }
  for (const double gravity : kGravities) {
    const auto wheel = [&](double duration) {
      return Flywheel(gravity, 5.0, friction, 0.1, duration, "",
                      R"(, "kinetic_friction": 0.01, "stribeck_speed": 1)");
    };
    EXPECT_NEAR(StateAfter(wheel(2.0)).twist[2], speed, 1e-6) << gravity;
    EXPECT_NEAR(StateAfter(wheel(3.0)).twist[2], 0.0, 1e-12) << gravity;
  }
}

// A force presses the box onto a wall: friction μ N stops it.
TEST(UnloadedFrictionTest, ABoxThatOnlyAForcePresses) {
  for (const double gravity : kGravities) {
    for (const double pressure : {1e-6, 5.0, 1e6}) {
      const double friction = 0.25;
      const double speed = friction * pressure * 0.6137;  // m/s: it stops at 0.6137 s
      const Scene scene = SceneOf(Head(gravity) + R"("bodies": [
          {"name": "b", "mass": 1, "shape": {"box": {"size": [0.5, 0.25]}},
           "position": [0, 0.125], "velocity": [)" +
                                  Text(speed) + R"(, 0], "friction": 0.25},
          {"name": "wall", "static": true, "friction": 0.25,
           "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
          "forces": [{"name": "f", "body": "b", "force": [0, )" +
                                  Text(-pressure) + "]}]" + ByEventsFor(1.0));
      const double a = friction * (pressure + gravity);
      SCOPED_TRACE(Text(gravity) + " m/s², " + Text(pressure) + " N");
      const double t = std::min(1.0, speed / a);
      const std::vector<std::string> paths = {"bodies/b/velocity/x", "forces/f/force/y"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      EXPECT_NEAR(result.values[0], speed * t - 0.5 * a * t * t, 1e-10 * (1.0 + speed));
      EXPECT_NEAR(result.values[3], 0.0, 1e-10 * speed);
      EXPECT_NEAR(result.jacobian(0, 0), t, 1e-8);
      EXPECT_NEAR(result.jacobian(0, 1), 0.5 * friction * t * t, 1e-8);
      // Differences would reverse the slowest and are too coarse for the fastest.
      if (pressure == 5.0) ExpectOthersAgree(scene, paths, result);
    }
  }
}

// Friction stops a wheel, and an effort that grows at the rate k sets it in motion again within the
// same step, or just before it would have stopped:
//
//   I ω = I ω0 − F t + k t² / 2, which falls to 0 if ω0 < F² / (2 k I);   from rest at t = F / k
TEST(UnloadedFrictionTest, AGrowingEffortMovesAWheelAgain) {
  constexpr double kFriction = 0.5, kRate = 8.0, kInertia = 0.005, kEnd = 0.25;
  for (const double speed : {1e-6, 1e-3, 1.0, 3.0, 3.12, 3.13, 4.0}) {
    for (const double dt : {0.25, 0.125, 0.05}) {
      SCOPED_TRACE(Text(speed) + " rad/s, dt " + Text(dt));
      Scene scene = Flywheel(0.0, speed, kFriction, std::sqrt(2.0 * kInertia), kEnd);
      scene.simulation.dt = dt;
      Signal effort;
      effort.file = "effort.csv";
      effort.interpolation = Signal::Interpolation::kLinear;
      effort.time = {0.0, 1.0};
      effort.value = {0.0, kRate};
      scene.joints[0].effort_signal = effort;
      const double root = kFriction * kFriction - 2.0 * kRate * kInertia * speed;
      const double stops =
          root > 0.0 ? 2.0 * kInertia * speed / (kFriction + std::sqrt(root)) : 0.0;
      const double moves = kEnd - kFriction / kRate;
      const double angle =
          root > 0.0
              ? speed * stops + (kRate * stops / 6.0 - 0.5 * kFriction) * stops * stops / kInertia +
                    kRate * moves * moves * moves / (6.0 * kInertia)
              : speed * kEnd + (kRate * kEnd / 6.0 - 0.5 * kFriction) * kEnd * kEnd / kInertia;
      const std::vector<std::string> paths = {"bodies/w/angular_velocity"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      EXPECT_NEAR(result.values[2], angle, 1e-12);
      EXPECT_NEAR(result.values[5],
                  root > 0.0 ? 0.5 * kRate * moves * moves / kInertia
                             : speed + (0.5 * kRate * kEnd - kFriction) * kEnd / kInertia,
                  1e-11);
      EXPECT_NEAR(result.jacobian(2, 0), root > 0.0 ? stops : kEnd, 1e-9);
      EXPECT_NEAR(result.jacobian(5, 0), root > 0.0 ? 0.0 : 1.0, 1e-9);
      if (speed == 1.0 || speed == 4.0) ExpectOthersAgree(scene, paths, result);
    }
  }
}

// The same of a box on a floor that a growing force pushes.
TEST(UnloadedFrictionTest, AGrowingForceMovesABoxAgain) {
  for (const double speed : {1e-5, 0.01, 0.3}) {
    SCOPED_TRACE(Text(speed) + " m/s");
    Scene scene = SceneOf(Head(10.0) + R"("bodies": [
        {"name": "b", "mass": 1, "shape": {"box": {"size": [0.5, 0.25]}},
         "position": [0, 0.125], "velocity": [)" +
                          Text(speed) + R"(, 0], "friction": 0.5},
        {"name": "floor", "static": true, "friction": 0.5,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
        "forces": [{"name": "f", "body": "b", "force": [0, 0], "at": [0, -0.125]}])" +
                          ByEventsFor(0.5));
    scene.simulation.dt = 0.5;
    Signal force;
    force.file = "force.csv";
    force.interpolation = Signal::Interpolation::kLinear;
    force.time = {0.0, 1.0};
    force.x = {0.0, 40.0};
    force.y = {0.0, 0.0};
    scene.forces[0].force_signal = force;
    const GradientResult result =
        Jacobian(scene, {"bodies/b/velocity/x"}, GradientMethod::kTangent);
    EXPECT_NEAR(result.values[3], 20.0 * 0.375 * 0.375, 1e-10);
    EXPECT_NEAR(result.jacobian(3, 0), 0.0, 1e-9);
    EXPECT_NEAR(result.jacobian(0, 0), (5.0 - std::sqrt(25.0 - 80.0 * speed)) / 40.0, 1e-9);
  }
}

// A heavy wheel of small inertia on a cart that moves: what counts as rounding of the friction's
// torque follows from the inertia, not from the mass. It breaks loose at t = F / k.
TEST(UnloadedFrictionTest, AHeavyWheelOfSmallInertiaBreaksLoose) {
  for (const double friction : {5e-6, 5.05e-6}) {
    for (const double mass : {1.0, 1e3, 1e6}) {
      Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
          {"name": "cart", "mass": 1, "inertia": 1e-3, "position": [0, 0], "velocity": [10, 0]},
          {"name": "wheel", "mass": )" +
                            Text(mass) + R"(, "inertia": 1e-3, "shape": {"circle": {"radius": 0.1}},
           "position": [0, 0], "velocity": [10, 0]}],
          "joints": [
          {"name": "level", "type": "fixed_angle", "bodies": ["cart", "world"]},
          {"name": "axle", "type": "revolute", "bodies": ["wheel", "cart"], "anchor": [0, 0],
           "friction": )" + Text(friction) +
                            "}]" + ByEventsFor(1.0));
      Signal effort;
      effort.file = "effort.csv";
      effort.interpolation = Signal::Interpolation::kLinear;
      effort.time = {0.0, 1.0};
      effort.value = {0.0, 1e-5};
      scene.joints[1].effort_signal = effort;
      const double moves = 1.0 - friction / 1e-5;
      EXPECT_NEAR(StateAfter(scene).twist[5], 1e-5 * moves * moves / 2e-3, 1e-13)
          << friction << " N m, " << mass << " kg";
    }
  }
}

// Links that coast without any load until the friction of their joints has stopped them, whatever
// rounding is left of their speeds.
TEST(UnloadedFrictionTest, LinksCoastToRest) {
  for (const double turn : {1.0, 2.0}) {
    for (const double friction : {0.1, 1.0}) {
      for (const double dt : {0.01, 0.05}) {
        Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
            {"name": "a", "mass": 1, "inertia": 0.1, "position": [0, 0], "angular_velocity": )" +
                              Text(turn) + R"(},
            {"name": "b", "mass": 0.5, "inertia": 1e-4, "position": [0.5, 0],
             "angular_velocity": -1},
            {"name": "c", "mass": 1e-3, "inertia": 0.01, "position": [1, 0]}],
            "joints": [
            {"name": "pin", "type": "revolute", "bodies": ["a", "world"], "anchor": [-0.25, 0],
             "friction": 0.1},
            {"name": "elbow", "type": "revolute", "bodies": ["a", "b"], "anchor": [0.25, 0],
             "friction": )" + Text(friction) +
                              R"(},
            {"name": "wrist", "type": "revolute", "bodies": ["b", "c"], "anchor": [0.75, 0],
             "friction": 0.01}])" +
                              ByEventsFor(12.0));
        scene.simulation.dt = dt;
        SCOPED_TRACE(Text(turn) + " rad/s, " + Text(friction) + " N m, dt " + Text(dt));
        for (const double speed : StateAfter(scene).twist) EXPECT_NEAR(speed, 0.0, 1e-12);
      }
    }
  }
}

// What an inelastic impact has stopped has only the rounding of its speed left, which is no other
// impact: a disc at a wall, a link at its limit, a tether that is taut, two discs that go on as
// one.
TEST(UnloadedImpactTest, AnInelasticImpactIsOneEvent) {
  for (const double speed : {1.0, 1.1, 0.7, 2.0, 3e-7, 4e5}) {
    const std::string still = R"({"name": "a", "mass": 1, "inertia": 0.1, "position": [1, 0], )";
    const std::string moves = R"("velocity": [)" + Text(speed) + ", 0]}], ";
    const std::string scenes[] = {
        R"("bodies": [{"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 0.3,
           "position": [0.1, 0], )" +
            moves.substr(0, moves.size() - 3) +
            R"(, {"name": "w", "static": true, "shape": {"half_plane": {"normal": [-1, 0],
           "offset": )" +
            Text(-0.2 - 0.6137 * speed) + "}}}]",
        R"("bodies": [{"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 0.3,
           "position": [0.1, 0], )" +
            moves.substr(0, moves.size() - 3) +
            R"(, {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 2, "position": [)" +
            Text(0.3 + 0.6137 * speed) + ", 0]}]",
        R"("bodies": [)" + still + moves +
            R"("joints": [{"name": "j", "type": "distance", "bodies": ["a", "world"],
           "anchors": [[1, 0], [0, 0]], "limits": [0, )" +
            Text(1.0 + 0.6137 * speed) + "]}]",
        R"("bodies": [)" + still + R"("velocity": [0, )" + Text(speed) +
            R"(], "angular_velocity": )" + Text(speed) +
            R"(}], "joints": [{"name": "j", "type": "revolute", "bodies": ["a", "world"],
           "anchor": [0, 0], "limits": [-9, )" +
            Text(0.6137 * speed) + "]}]"};
    for (const std::string& scene : scenes) {
      // A hinge does not turn by 40 000 rad in a step.
      if (speed > 1e3 && scene == scenes[3]) continue;
      SCOPED_TRACE(scene);
      Model<double> model;
      State<double> state;
      BuildModel(SceneOf(Head(0.0) + scene + ByEventsFor(1.5)), &model, &state);
      const RolloutReport report = Rollout(model, state, {}, &state);
      EXPECT_EQ(report.message, "");
      EXPECT_EQ(report.events, 1);
    }
  }
}

}  // namespace
}  // namespace tangible
