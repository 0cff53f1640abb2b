// SPDX-License-Identifier: Apache-2.0
//
// Motors of joints, servos, ropes, and limits with restitution, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/gradient/batch.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::kGravity;
using test_scenes::SceneOf;
using testing::ExpectOthersAgree;
using testing::Jacobian;

std::string Tail(const std::string& stepping, double dt, double duration) {
  return R"(, "simulation": {"stepping": ")" + stepping + R"(", "dt": )" + std::to_string(dt) +
         R"(, "duration": )" + std::to_string(duration) + "}}";
}

// A wheel of inertia 0.5 that turns at −1 rad/s.
Scene Wheel(const std::string& of_joint, const std::string& stepping, double dt = 0.01) {
  return SceneOf(R"({"bodies": [{"name": "w", "mass": 2, "inertia": 0.5,
      "shape": {"circle": {"radius": 0.3}}, "position": [0, 0], "angular_velocity": -1}],
      "joints": [{"name": "h", "type": "revolute", "bodies": ["w", "world"], "anchor": [0, 0], )" +
                 of_joint + "}]" + Tail(stepping, dt, 1.0));
}

// The speed grows at L / I to w, which it reaches at t = (w + 1) I / L, and stays there.
TEST(MotorTest, AWheelReachesItsSpeedAndKeepsIt) {
  // (5 + 1) / (4 / 0.5) = 0.75 s is the end of a step, 6 / (3.7 / 0.5) is not.
  for (const double limit : {4.0, 3.7}) {
    const double w = 5.0;
    const Scene scene =
        Wheel(R"("motor": {"speed": 5, "limit": )" + std::to_string(limit) + "}", "event");
    const std::vector<std::string> paths = {"joints/h/motor/speed", "joints/h/motor/limit",
                                            "bodies/w/inertia", "bodies/w/angular_velocity"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    const double slope = limit / 0.5;
    const double t = (w + 1.0) / slope;
    // θ(1) = w − (w + 1)² / (2 L / I).
    EXPECT_NEAR(result.values[2], w - 0.5 * (w + 1.0) * t, 1e-10);
    EXPECT_NEAR(result.values[5], w, 1e-12);
    EXPECT_NEAR(result.jacobian(2, 0), 1.0 - t, 1e-8);
    EXPECT_NEAR(result.jacobian(2, 1), 0.5 * (w + 1.0) * t / limit, 1e-8);
    EXPECT_NEAR(result.jacobian(2, 2), -0.5 * (w + 1.0) * t / 0.5, 1e-8);
    EXPECT_NEAR(result.jacobian(2, 3), t, 1e-8);
    EXPECT_EQ(result.certificate.verdict, "trustworthy");
    ExpectOthersAgree(scene, paths, result);
  }
}

TEST(MotorTest, FixedStepsReachTheSpeedToo) {
  const Scene scene = Wheel(R"("motor": {"speed": 5, "limit": 3.7})", "fixed");
  const std::vector<std::string> paths = {"joints/h/motor/speed", "joints/h/motor/limit",
                                          "bodies/w/inertia", "bodies/w/angular_velocity"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.values[5], 5.0, 1e-12);
  EXPECT_NEAR(result.values[2], 5.0 - 0.5 * 36.0 / 7.4, 0.05);  // first order in dt
  EXPECT_NEAR(result.jacobian(5, 0), 1.0, 1e-12);
  ExpectOthersAgree(scene, paths, result);
}

// Against friction the motor has what is left; a brake is a motor of speed 0.
TEST(MotorTest, ActsBesideFriction) {
  for (const char* stepping : {"event", "fixed"}) {
    const bool exact = stepping[0] == 'e';
    const std::vector<std::string> paths = {"joints/h/friction", "joints/h/motor/limit"};
    const Scene drives = Wheel(R"("friction": 0.8, "motor": {"speed": 5, "limit": 3})", stepping);
    const GradientResult result = Jacobian(drives, paths, GradientMethod::kAdjoint);
    // Both slow the wheel from −1 rad/s at 7.6 rad/s²; then 4.4 rad/s² are left.
    EXPECT_NEAR(result.values[5], 4.4 * (1.0 - 1.0 / 7.6), exact ? 1e-10 : 0.05);
    ExpectOthersAgree(drives, paths, result);
    const Scene brakes = Wheel(R"("friction": 0.8, "motor": {"speed": 0, "limit": 3})", stepping);
    const GradientResult stopped = Jacobian(brakes, paths, GradientMethod::kAdjoint);
    EXPECT_NEAR(stopped.values[5], 0.0, 1e-12);
    EXPECT_NEAR(stopped.values[2], -0.5 / 7.6, exact ? 1e-10 : 0.01);
    for (int column = 0; exact && column < 2; ++column) {
      EXPECT_NEAR(stopped.jacobian(2, column), 0.5 / 7.6 / 3.8, 1e-8);
    }
    ExpectOthersAgree(brakes, paths, stopped);
  }
}

// A brake and friction share a load that neither holds alone, and give way to one that both
// together do not hold.
TEST(MotorTest, ABrakeAndFrictionHoldALoadTogether) {
  for (const char* stepping : {"event", "fixed"}) {
    for (const double effort : {3.5, -3.7, 4.2}) {
      Scene scene = Wheel(R"("friction": 0.8, "motor": {"speed": 0, "limit": 3}, "effort": )" +
                              std::to_string(effort),
                          stepping);
      scene.bodies[0].angular_velocity = 0.0;
      Model<double> model;
      State<double> state;
      BuildModel(scene, &model, &state);
      const RolloutReport report = Rollout(model, state, {}, &state);
      EXPECT_EQ(report.message, "");
      const double left = std::max(0.0, std::abs(effort) - 3.8) / 0.5;
      EXPECT_NEAR(state.twist[2], left, 1e-10) << stepping << " " << effort;
    }
  }
}

// A motor that is at its speed from the start, one that can do nothing, and no gravity.
TEST(MotorTest, NothingToDo) {
  for (const char* stepping : {"event", "fixed"}) {
    for (const char* motor :
         {R"("motor": {"speed": -1, "limit": 4})", R"("motor": {"speed": 5, "limit": 0})"}) {
      Scene scene = Wheel(motor, stepping);
      for (const double gravity : {-9.81, 0.0}) {
        scene.gravity.y() = gravity;
        const std::vector<std::string> paths = {"bodies/w/inertia"};
        const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
        EXPECT_NEAR(result.values[2], -1.0, 1e-12) << stepping << motor;
        EXPECT_NEAR(result.values[5], -1.0, 1e-12) << stepping << motor;
        EXPECT_NEAR(result.jacobian(2, 0), 0.0, 1e-12) << stepping << motor;
      }
    }
  }
}

// A slider that a motor lifts, or that falls because the motor is too weak.
TEST(MotorTest, LiftsALoad) {
  for (const double limit : {30.0, 15.0}) {
    const Scene scene = SceneOf(R"({"bodies": [{"name": "c", "mass": 2,
        "shape": {"box": {"size": [0.2, 0.2]}}, "position": [0, 0]}],
        "joints": [{"name": "rail", "type": "prismatic", "bodies": ["c", "world"],
        "anchor": [0, 0], "axis": [0, 1], "motor": {"speed": 0.5, "limit": )" +
                                std::to_string(limit) + "}}]" + Tail("event", 0.01, 1.0));
    const std::vector<std::string> paths = {"joints/rail/motor/speed", "joints/rail/motor/limit",
                                            "bodies/c/mass"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    const double a = limit / 2.0 - kGravity;
    const double t = std::min(1.0, a > 0.0 ? 0.5 / a : 1.0);
    EXPECT_NEAR(result.values[1], 0.5 * a * t * t + a * t * (1.0 - t), 1e-10);
    EXPECT_NEAR(result.values[4], a * t, 1e-10);
    ExpectOthersAgree(scene, paths, result);
  }
}

// The motor's speed is not in the state at the step's start, and is counted where a step looks for
// what may touch: from rest the slider meets a wall within one step, and is held against it.
TEST(MotorTest, MeetsAWallWithinAStep) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "c", "mass": 1, "shape": {"box": {"size": [0.2, 0.2]}}, "position": [0, 0]},
      {"name": "wall", "static": true, "shape": {"box": {"size": [0.02, 1]}},
       "position": [0.16, 0]}],
      "joints": [{"name": "rail", "type": "prismatic", "bodies": ["c", "world"],
      "anchor": [0, 0], "axis": [1, 0], "motor": {"speed": 50, "limit": 2000}}])" +
                              Tail("event", 0.1, 0.1));
  const std::vector<std::string> paths = {"bodies/wall/position/x", "joints/rail/motor/limit"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.values[0], 0.05, 1e-10);
  EXPECT_NEAR(result.values[3], 0.0, 1e-12);
  EXPECT_NEAR(result.jacobian(0, 0), 1.0, 1e-9);
  EXPECT_NEAR(result.jacobian(0, 1), 0.0, 1e-9);
  ExpectOthersAgree(scene, paths, result);
}

// A ball rebounds while a motor beside it does work, which is none of the impact's.
TEST(MotorTest, ItsWorkIsNotAnImpacts) {
  const Scene scene = SceneOf(R"({"bodies": [
      {"name": "floor", "static": true, "restitution": 0.5,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "ball", "mass": 1, "restitution": 0.5, "shape": {"circle": {"radius": 0.1}},
       "position": [0, 0.2]},
      {"name": "w", "mass": 2, "inertia": 0.5, "position": [3, 3]}],
      "joints": [{"name": "h", "type": "revolute", "bodies": ["w", "world"], "anchor": [3, 3],
      "motor": {"speed": 500, "limit": 40}}])" +
                              Tail("fixed", 0.01, 0.2));
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  const RolloutReport report = Rollout(model, state, {}, &state);
  EXPECT_EQ(report.message, "");
  EXPECT_NEAR(state.twist[8], 40.0 / 0.5 * 0.2, 1e-9);
  EXPECT_GT(state.twist[4], 0.0);  // it has rebounded
  EXPECT_LE(report.impact_energy_gain, 0.0);
}

struct Phase {
  double x = 0.0, v = 0.0;
};

// An oscillator with damping, m ë = −k e − d ė, about a target that moves at a rate, after a time.
Phase Oscillate(const Phase& start, double m, double k, double d, double target, double rate,
                double t) {
  const double e = start.x - target, w = start.v - rate;
  const double decay = d / (2.0 * m), omega = std::sqrt(k / m - decay * decay);
  const double c = std::cos(omega * t), s = std::sin(omega * t) / omega;
  const double left = std::exp(-decay * t);
  return {target + rate * t + left * (e * c + (w + decay * e) * s),
          rate + left * (w * c - (k / m * e + decay * w) * s)};
}

using Numbers = std::vector<double>;
using ClosedForm = std::function<Phase(const Numbers&)>;

// Position and speed of coordinate `row` of the first body, and their derivatives, against a closed
// form at the values of the parameters, and every method against each other.
void ExpectClosedForm(const Scene& scene, const std::vector<std::string>& paths, int row,
                      const Numbers& at, const ClosedForm& form) {
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.values[row], form(at).x, 1e-9);
  EXPECT_NEAR(result.values[row + 3], form(at).v, 1e-9);
  for (size_t i = 0; i < paths.size(); ++i) {
    const double h = 1e-5;
    Numbers above = at, below = at;
    above[i] += h;
    below[i] -= h;
    const double by_x = (form(above).x - form(below).x) / (2.0 * h);
    const double by_v = (form(above).v - form(below).v) / (2.0 * h);
    EXPECT_NE(by_x, 0.0);
    EXPECT_NEAR(result.jacobian(row, static_cast<int>(i)), by_x, 1e-7) << paths[i];
    EXPECT_NEAR(result.jacobian(row + 3, static_cast<int>(i)), by_v, 1e-7) << paths[i];
  }
  EXPECT_EQ(result.certificate.verdict, "trustworthy") << result.certificate.margin_where;
  ExpectOthersAgree(scene, paths, result);
}

// A body of mass 2 and inertia 0.5 with a force, and one on a rail.
Scene Pushed(const std::string& force, const std::string& stepping, double dt, double duration) {
  return SceneOf(R"({"gravity": [0, 0], "bodies": [{"name": "m", "mass": 2, "inertia": 0.5,
      "position": [0.1, 0], "velocity": [0.4, 0]}],
      "forces": [{"name": "f", "body": "m", )" +
                 force + "}]" + Tail(stepping, dt, duration));
}
Scene OnRail(const std::string& effort, const std::string& stepping, double dt, double duration) {
  return SceneOf(R"({"gravity": [0, 0], "bodies": [{"name": "m", "mass": 1, "inertia": 1,
      "position": [0, 0]}],
      "joints": [{"name": "r", "type": "prismatic", "bodies": ["m", "world"], "anchor": [0, 0],
      "axis": [1, 0], "effort": )" +
                 effort + "}]" + Tail(stepping, dt, duration));
}

TEST(ServoTest, AMassIsADampedOscillator) {
  const std::string f = "forces/f/force/x/";
  ExpectClosedForm(Pushed(R"("force": [{"target": 0.3, "stiffness": 8, "damping": 1.6}, 0])",
                          "event", 0.005, 0.8),
                   {f + "target", f + "stiffness", f + "damping", "bodies/m/mass"}, 0,
                   {0.3, 8.0, 1.6, 2.0}, [](const Numbers& p) {
                     return Oscillate({0.1, 0.4}, p[3], p[1], p[2], p[0], 0.0, 0.8);
                   });
}

// Bounded until −k (x − r) − d v falls to L, at k L t² / 2 m + d L t / m = k r − L.
Phase OutOfTheBound(const Numbers& p, double duration) {
  const double r = p[0], k = p[1], d = p[2], limit = p[3];
  const double a = 0.5 * k * limit, b = d * limit;
  const double t = (std::sqrt(b * b + 4.0 * a * (k * r - limit)) - b) / (2.0 * a);
  return Oscillate({0.5 * limit * t * t, limit * t}, 1.0, k, d, r, 0.0, duration - t);
}

TEST(ServoTest, LeavesItsBound) {
  const std::string e = "joints/r/effort/";
  ExpectClosedForm(
      OnRail(R"({"target": 1, "stiffness": 4, "damping": 0.8, "limit": 2})", "event", 0.005, 1.2),
      {e + "target", e + "stiffness", e + "damping", e + "limit"}, 0, {1.0, 4.0, 0.8, 2.0},
      [](const Numbers& p) { return OutOfTheBound(p, 1.2); });
  // Without damping it comes to the other bound, and the certificate knows of both events.
  const GradientResult result =
      Jacobian(OnRail(R"({"target": 1, "stiffness": 4, "limit": 2})", "event", 0.01, 2.0),
               {e + "limit"}, GradientMethod::kAdjoint);
  EXPECT_EQ(result.certificate.events, 2);
}

// It stays on its bound: a constant force, of which neither stiffness nor target are part.
TEST(ServoTest, OnItsBoundItIsAConstantForce) {
  const std::string e = "joints/r/effort/";
  const std::vector<std::string> paths = {e + "target", e + "stiffness", e + "limit"};
  for (const char* stepping : {"event", "fixed"}) {
    const Scene scene =
        OnRail(R"({"target": -9, "stiffness": 40, "damping": 3, "limit": 2})", stepping, 0.01, 0.5);
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.values[3], -1.0, 1e-12);
    EXPECT_NEAR(result.jacobian(3, 0), 0.0, 1e-12);
    EXPECT_NEAR(result.jacobian(3, 1), 0.0, 1e-12);
    EXPECT_NEAR(result.jacobian(3, 2), -0.5, 1e-12);
    ExpectOthersAgree(scene, paths, result);
  }
}

// A target that rests, moves at 0.5 rad/s from 0.203 s to 0.603 s and rests again.
constexpr char kRamp[] =
    R"({"time": [0.203, 0.603], "value": [0, 0.2], "interpolation": "linear"})";

TEST(ServoTest, FollowsASeries) {
  const std::string servo =
      std::string(R"({"target": )") + kRamp + R"(, "stiffness": 6, "damping": 0.7})";
  const std::string f = "forces/f/torque/";
  ExpectClosedForm(Pushed(R"("torque": )" + servo, "event", 0.005, 0.9),
                   {f + "stiffness", f + "damping", "bodies/m/inertia"}, 2, {6.0, 0.7, 0.5},
                   [](const Numbers& p) {
                     const auto go = [&](const Phase& from, double target, double rate, double t) {
                       return Oscillate(from, p[2], p[0], p[1], target, rate, t);
                     };
                     return go(go(go({0.0, 0.0}, 0.0, 0.0, 0.203), 0.0, 0.5, 0.4), 0.2, 0.0, 0.297);
                   });
}

// All methods agree in either stepping where several servos act, with windows and bounds, and fixed
// steps come to the motion by events.
TEST(ServoTest, AllMethodsAgreeAndFixedStepsConverge) {
  const std::string force = std::string(R"("at": [0.2, 0.1], "start": 0.0513, "end": 0.7571,
      "force": [{"target": 0.5, "stiffness": 30, "damping": 2, "limit": 3}, 0.5],
      "torque": {"target": )") +
                            kRamp + R"(, "stiffness": 6, "damping": 0.4, "limit": 0.3})";
  const std::vector<std::string> paths = {"forces/f/force/x/target",  "forces/f/force/x/stiffness",
                                          "forces/f/force/x/damping", "forces/f/force/x/limit",
                                          "forces/f/force/y",         "forces/f/torque/stiffness",
                                          "forces/f/torque/limit",    "forces/f/at/x",
                                          "forces/f/start",           "forces/f/end"};
  const Scene events = Pushed(force, "event", 0.01, 0.8);
  const GradientResult exact = Jacobian(events, paths, GradientMethod::kAdjoint);
  EXPECT_GE(exact.certificate.events, 2);
  ExpectOthersAgree(events, paths, exact);
  double last = 0.0;
  for (const double dt : {0.004, 0.002}) {
    const Scene fixed = Pushed(force, "fixed", dt, 0.8);
    const GradientResult result = Jacobian(fixed, paths, GradientMethod::kAdjoint);
    const double error = (result.values - exact.values).cwiseAbs().maxCoeff();
    if (last > 0.0) {
      EXPECT_NEAR(error / last, 0.5, 0.2);
    }
    last = error;
    if (dt == 0.004) ExpectOthersAgree(fixed, paths, result);
  }
  EXPECT_LT(last, 0.05);
}

Scene Rope(const std::string& limits, const std::string& start, const std::string& stepping,
           double dt, double duration) {
  return SceneOf(R"({"bodies": [{"name": "m", "mass": 2, "inertia": 0.5, )" + start +
                 R"(}], "joints": [{"name": "r", "type": "distance", "bodies": ["m", "world"],
      "anchors": [[0, 0], [0, 0]], )" +
                 limits + "}]" + Tail(stepping, dt, duration));
}

// From where both ends meet the mass falls to the rope's length and rebounds.
TEST(RopeTest, AFallIsCaught) {
  const double length = 0.8;
  const double e = 0.5;
  const double duration = 0.7;
  const Scene scene = Rope(R"("limits": [0, 0.8], "limit_restitution": 0.5)",
                           R"("position": [0, 0])", "event", 0.01, duration);
  const std::vector<std::string> paths = {"joints/r/limits/1", "joints/r/limit_restitution",
                                          "joints/r/limits/0", "gravity/y"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  const double v = std::sqrt(2.0 * kGravity * length);
  const double t = duration - v / kGravity;
  EXPECT_NEAR(result.values[1], -length + e * v * t - 0.5 * kGravity * t * t, 1e-10);
  EXPECT_NEAR(result.values[4], e * v - kGravity * t, 1e-10);
  // dv/dL = g / v, dt/dL = −1 / v.
  EXPECT_NEAR(result.jacobian(1, 0), -1.0 + e * (kGravity / v * t - 1.0) + kGravity * t / v, 1e-7);
  EXPECT_NEAR(result.jacobian(1, 1), v * t, 1e-8);
  EXPECT_NEAR(result.jacobian(1, 2), 0.0, 0.0);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  ExpectOthersAgree(scene, {paths[0], paths[1], paths[3]},
                    Jacobian(scene, {paths[0], paths[1], paths[3]}, GradientMethod::kAdjoint));
}

// Thrown upwards it is slack until it is taut; without restitution only the speed across the rope
// is left, and the motion goes on as that of a pendulum, whose energy is kept.
TEST(RopeTest, APendulumGoesSlackAndTaut) {
  const Scene scene = SceneOf(R"({"bodies": [{"name": "m", "mass": 2, "inertia": 0.5,
      "position": [0.5, 0]}], "joints": [{"name": "r", "type": "distance",
      "bodies": ["m", "world"], "anchors": [[0.5, 0], [0, 0]], "limits": [null, 0.8]}])" +
                              Tail("event", 0.01, 1.0));
  const std::vector<std::string> paths = {"joints/r/limits/1", "gravity/y", "bodies/m/velocity/x"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  // It falls to y = −√(0.8² − 0.5²) with v² = 2 g |y|, of which the share (0.5 / 0.8)² is left.
  const double y = -std::sqrt(0.8 * 0.8 - 0.5 * 0.5);
  const double energy = kGravity * y - kGravity * y * 0.5 * 0.5 / (0.8 * 0.8);
  const auto& x = result.values;
  EXPECT_NEAR(std::hypot(x[0], x[1]), 0.8, 1e-9);
  EXPECT_NEAR(0.5 * (x[3] * x[3] + x[4] * x[4]) + kGravity * x[1], energy, 1e-6);
  ExpectOthersAgree(scene, paths, result);
}

// What stands exactly at a boundary: a rope that becomes taut at the end of a step, or starts taut.
TEST(RopeTest, BecomesTautAtTheEndOfAStep) {
  const double length = 0.5 * kGravity * 0.4 * 0.4;  // after 0.4 s
  for (const double e : {0.0, 0.5}) {
    const Scene scene = Rope(R"("limits": [0, 0.7848], "limit_restitution": )" + std::to_string(e),
                             R"("position": [0, 0])", "event", 0.01, 0.5);
    const std::vector<std::string> paths = {"joints/r/limits/1", "gravity/y"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    const double v = kGravity * 0.4;
    const double t = 0.1;
    const bool rebounds = e > 0.0;
    EXPECT_NEAR(result.values[1], rebounds ? -length + e * v * t - 0.5 * kGravity * t * t : -length,
                1e-9);
    EXPECT_NEAR(result.jacobian(1, 0),
                rebounds ? -1.0 + e * (kGravity / v * t - 1.0) + kGravity * t / v : -1.0, 1e-7);
    ExpectOthersAgree(scene, paths, result);
  }
}

TEST(RopeTest, HangsStillWhereItStartsTaut) {
  for (const char* stepping : {"event", "fixed"}) {
    const Scene scene = SceneOf(R"({"bodies": [{"name": "m", "mass": 2, "inertia": 0.5,
        "position": [0, -0.8]}], "joints": [{"name": "r", "type": "distance",
        "bodies": ["m", "world"], "anchors": [[0, -0.8], [0, 0]], "limits": [0, 0.8],
        "limit_restitution": 1}])" +
                                Tail(stepping, 0.01, 0.3));
    const GradientResult result =
        Jacobian(scene, {"joints/r/limits/1", "bodies/m/mass"}, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.values[1], -0.8, 1e-15) << stepping;
    EXPECT_NEAR(result.values[4], 0.0, 1e-15) << stepping;
    EXPECT_NEAR(result.jacobian(1, 1), 0.0, 1e-12) << stepping;
  }
}

// A low limit of 0 cannot be reached; as a parameter it may become one that can.
TEST(RopeTest, ALowLimitGrowsFromZero) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [{"name": "m", "mass": 2,
      "inertia": 0.5, "position": [0.5, 0], "velocity": [-1, 0]}],
      "joints": [{"name": "r", "type": "distance", "bodies": ["m", "world"],
      "anchors": [[0.5, 0], [0, 0]], "limits": [0, 0.8], "limit_restitution": 0.5}])" +
                              Tail("event", 0.01, 0.4));
  RowMatrixXd values(3, 1);
  values << 0.0, 0.3, 0.0;
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    Scene stepped = scene;
    stepped.simulation.stepping = stepping;
    const BatchResult batch =
        RunBatch(stepped, testing::Resolve(stepped, {"joints/r/limits/0"}), values, {.threads = 1});
    ASSERT_EQ(batch.message, "");
    const double error = stepping == Stepping::kFixed ? 0.02 : 1e-9;
    EXPECT_NEAR(batch.rows[0].final.pose[0], 0.1, error);
    EXPECT_NEAR(batch.rows[1].final.pose[0], 0.3 + 0.5 * 0.2, error);
    EXPECT_EQ(batch.rows[2].final.pose[0], batch.rows[0].final.pose[0]);
  }
}

// The ends of a rope may meet and part again, also where they meet on a step's end.
TEST(RopeTest, PassesThroughItsAnchor) {
  for (const char* stepping : {"event", "fixed"}) {
    for (const double dt : {0.01, 0.0075}) {
      const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [{"name": "m", "mass": 2,
          "inertia": 0.5, "position": [0.5, 0], "velocity": [-1, 0]}],
          "joints": [{"name": "r", "type": "distance", "bodies": ["m", "world"],
          "anchors": [[0.5, 0], [0, 0]], "limits": [0, 0.8], "limit_restitution": 0.5}])" +
                                  Tail(stepping, dt, 1.0));
      const std::vector<std::string> paths = {"bodies/m/velocity/x", "bodies/m/position/x"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      EXPECT_NEAR(result.values[0], -0.5, 1e-12) << stepping << dt;
      EXPECT_EQ(result.values[3], -1.0) << stepping << dt;
      EXPECT_NEAR(result.jacobian(0, 0), 1.0, 1e-12) << stepping << dt;
      EXPECT_NEAR(result.jacobian(3, 0), 1.0, 1e-12) << stepping << dt;
      ExpectOthersAgree(scene, paths, result);
    }
  }
}

// Both ends move: the centre of mass of two balls on a rope flies on, and they turn about it.
TEST(RopeTest, TwoBallsOnARope) {
  for (const char* stepping : {"event", "fixed"}) {
    const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "a", "mass": 1, "shape": {"circle": {"radius": 0.05}}, "position": [0, 0],
         "velocity": [-1, 0.3]},
        {"name": "b", "mass": 3, "shape": {"circle": {"radius": 0.05}}, "position": [0.4, 0],
         "velocity": [1, -0.2]}],
        "joints": [{"name": "r", "type": "distance", "bodies": ["a", "b"],
        "anchors": [[0, 0], [0.4, 0]], "limits": [0, 0.57], "limit_restitution": 0.6}])" +
                                Tail(stepping, 0.01, 0.5));
    const std::vector<std::string> paths = {"joints/r/limits/1", "joints/r/limit_restitution",
                                            "bodies/a/mass", "bodies/b/velocity/y"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    const auto& x = result.values;
    EXPECT_NEAR(0.25 * x[0] + 0.75 * x[6], 0.3 + 0.5 * 0.5, 1e-10);
    EXPECT_NEAR(0.25 * x[3] + 0.75 * x[9], 0.5, 1e-12);
    ExpectOthersAgree(scene, paths, result);
  }
}

// A rod that swings against stops and rebounds; a stop at one side only.
TEST(LimitTest, RestitutionOfAStop) {
  for (const char* limits : {"[-0.5, 0.5]", "[null, 0.5]"}) {
    const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [{"name": "rod", "mass": 1,
        "shape": {"box": {"size": [0.1, 1]}}, "position": [0, -0.5]}],
        "joints": [{"name": "h", "type": "revolute", "bodies": ["rod", "world"],
        "anchor": [0, 0], "rate": 2, "limit_restitution": 0.4, "limits": )" +
                                std::string(limits) + "}]" + Tail("event", 0.01, 1.0));
    const std::vector<std::string> paths = {"joints/h/limits/1", "joints/h/limit_restitution",
                                            "joints/h/rate"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    // 0.25 s to the stop, then back at 0.8 rad/s.
    EXPECT_NEAR(result.values[2], 0.5 - 0.8 * 0.75, 1e-9);
    EXPECT_NEAR(result.jacobian(2, 0), 1.0 + 0.8 / 2.0, 1e-7);
    EXPECT_NEAR(result.jacobian(2, 1), -2.0 * 0.75, 1e-7);
    EXPECT_NEAR(result.jacobian(2, 2), -0.4 * 0.75 - 0.8 * 0.25 / 2.0, 1e-7);
    ExpectOthersAgree(scene, paths, result);
  }
}

}  // namespace
}  // namespace tangible
