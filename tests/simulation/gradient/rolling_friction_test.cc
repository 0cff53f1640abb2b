// SPDX-License-Identifier: Apache-2.0
//
// Rolling friction of discs against closed forms, in both steppings and by all methods.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace {

using test_scenes::kGravity;
using test_scenes::SceneOf;
using testing::ExpectOthersAgree;
using testing::Jacobian;

constexpr double kRadius = 0.1;
constexpr double kInertiaShare = 0.5;  // I = m R² / 2

struct Ball {
  double y = kRadius;
  double vx = 0.0, vy = 0.0, omega = 0.0;
  double friction = 1.0, rolling = 0.002, restitution = 0.0;
  std::string simulation;  // keys of the simulation
};

Scene SceneOfBall(const Ball& ball, const std::string& normal = "[0, 1]") {
  const auto text = [](double x) {
    char buffer[32];
    std::snprintf(buffer, sizeof(buffer), "%.17g", x);
    return std::string(buffer);
  };
  const std::string surface = R"("friction": )" + text(ball.friction) +
                              R"(, "rolling_friction": )" + text(ball.rolling) +
                              R"(, "restitution": )" + text(ball.restitution);
  return SceneOf(R"({"bodies": [
      {"name": "ball", "mass": 3, "shape": {"circle": {"radius": 0.1}}, "position": [0, )" +
                 text(ball.y) + R"(], "velocity": [)" + text(ball.vx) + ", " + text(ball.vy) +
                 R"(], "angular_velocity": )" + text(ball.omega) + ", " + surface + R"(},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": )" +
                 normal + R"(, "offset": 0}}, )" + surface + R"(}], "simulation": {)" +
                 ball.simulation + "}}");
}

const std::string kByEvents = R"("stepping": "event", "dt": 0.01, "duration": 1)";

// v̇ = ρ g / (R (1 + I / (m R²))) until it rests, after a time that is no multiple of dt.
TEST(RollingFrictionTest, ABallRollsToRest) {
  Ball ball;
  ball.vx = 0.1;
  ball.omega = -1.0;
  ball.simulation = kByEvents;
  const double slows = ball.rolling * kGravity / (kRadius * (1.0 + kInertiaShare));
  const double way = ball.vx * ball.vx / (2.0 * slows);
  const std::vector<std::string> paths = {"bodies/*/rolling_friction", "bodies/ball/velocity/x",
                                          "bodies/ball/angular_velocity"};
  const Scene scene = SceneOfBall(ball);
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.values[0], way, 1e-9);
  EXPECT_NEAR(result.values[2], -way / kRadius, 1e-9);
  EXPECT_NEAR(result.values[3], 0.0, 1e-15);
  EXPECT_NEAR(result.jacobian(0, 0), -way / ball.rolling, 1e-7);
  // A change of the start's velocity or spin alone is shared at once by the contact's friction.
  EXPECT_NEAR(result.jacobian(0, 1), 2.0 / 3.0 * ball.vx / slows, 1e-7);
  EXPECT_NEAR(result.jacobian(0, 2), -kRadius / 3.0 * ball.vx / slows, 1e-7);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  ExpectOthersAgree(scene, paths, result);
}

// Fixed steps converge at first order, and agree with each other by all methods.
TEST(RollingFrictionTest, FixedStepsConverge) {
  Ball ball;
  ball.vx = 0.1;
  ball.omega = -1.0;
  const double slows = ball.rolling * kGravity / (kRadius * (1.0 + kInertiaShare));
  const double way = ball.vx * ball.vx / (2.0 * slows);
  double last = 0.0;
  for (const double dt : {0.01, 0.005, 0.0025}) {
    ball.simulation = R"("duration": 1, "dt": )" + std::to_string(dt);
    const std::vector<std::string> paths = {"bodies/*/rolling_friction", "bodies/ball/velocity/x",
                                            "bodies/ball/mass"};
    const Scene scene = SceneOfBall(ball);
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    const double error = std::abs(result.values[0] - way);
    EXPECT_LT(error, ball.vx * dt);
    EXPECT_NEAR(result.values[3], 0.0, 1e-15);
    if (last > 0.0) {
      EXPECT_NEAR(error / last, 0.5, 0.05);
    }
    last = error;
    ExpectOthersAgree(scene, paths, result);
  }
}

// On a slope a ball rests as long as R sin θ ≤ ρ cos θ, and rolls with what is left.
TEST(RollingFrictionTest, ASlopeHoldsUpToRho) {
  const double slope = 0.03;
  const double norm = std::sqrt(1.0 + slope * slope);
  char normal[64];
  std::snprintf(normal, sizeof(normal), "[%.17g, %.17g]", -slope / norm, 1.0 / norm);
  for (const char* stepping : {"event", "fixed"}) {
    Ball ball;
    ball.y = kRadius * norm;
    ball.simulation =
        R"("dt": 0.01, "duration": 0.5, "stepping": ")" + std::string(stepping) + "\"";
    ball.rolling = 1.01 * slope * kRadius;
    const GradientResult holds = Jacobian(SceneOfBall(ball, normal), {"bodies/*/rolling_friction"},
                                          GradientMethod::kAdjoint);
    EXPECT_NEAR(holds.values[0], 0.0, 1e-14);
    EXPECT_NEAR(holds.values[5], 0.0, 1e-14);
    EXPECT_NEAR(holds.jacobian.cwiseAbs().maxCoeff(), 0.0, 1e-12);
    ball.rolling = 0.6 * slope * kRadius;
    const Scene scene = SceneOfBall(ball, normal);
    const GradientResult rolls =
        Jacobian(scene, {"bodies/*/rolling_friction"}, GradientMethod::kAdjoint);
    const double gravity = kGravity / norm / (1.0 + kInertiaShare);
    const double a = gravity * (slope - ball.rolling / kRadius);
    EXPECT_NEAR(std::hypot(rolls.values[3], rolls.values[4]), 0.5 * a, 1e-10);
    EXPECT_NEAR(rolls.jacobian(5, 0), -gravity / kRadius / kRadius * 0.5, 1e-7) << stepping;
    ExpectOthersAgree(scene, {"bodies/*/rolling_friction"}, rolls);
  }
}

// A push that grows breaks it loose where F R = ρ m g.
TEST(RollingFrictionTest, AGrowingPushBreaksItLoose) {
  Ball ball;
  ball.rolling = 0.004;
  ball.simulation = kByEvents;
  Scene scene = SceneOfBall(ball);
  BasicBody<double> cart;
  cart.name = "cart";
  cart.motion = Motion::kKinematic;
  cart.position = {1.0, kRadius};
  cart.velocity = {0.3, 0.0};
  scene.bodies.push_back(cart);
  BasicSpring<double> spring;
  spring.name = "s";
  spring.bodies[1] = 2;
  spring.bodies[0] = 0;
  spring.anchors[0] = {0.0, kRadius};
  spring.anchors[1] = {1.0, kRadius};
  spring.stiffness = 10.0;
  spring.rest_length = 1.0;
  scene.springs.push_back(spring);
  const std::vector<std::string> paths = {"bodies/*/rolling_friction", "springs/s/stiffness"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  // After t0 = ρ m g / (R k u): m (1 + I / m R²) ẍ = k (u t − x) − ρ m g / R.
  const double mass = 3.0 * (1.0 + kInertiaShare);
  const auto at_end = [&](double rolling, double k) {
    const double held = rolling * 3.0 * kGravity / kRadius;
    const double start = held / (k * 0.3);
    const double w = std::sqrt(k / mass);
    const double s = 1.0 - start;
    return 0.3 * (s - std::sin(w * s) / w);
  };
  EXPECT_NEAR(result.values[0], at_end(0.004, 10.0), 1e-8);
  const double h = 1e-6;
  EXPECT_NEAR(result.jacobian(0, 0),
              (at_end(0.004 + h, 10.0) - at_end(0.004 - h, 10.0)) / (2.0 * h), 1e-6);
  EXPECT_NEAR(result.jacobian(0, 1),
              (at_end(0.004, 10.0 + h) - at_end(0.004, 10.0 - h)) / (2.0 * h), 1e-7);
  ExpectOthersAgree(scene, paths, result);
}

// An impact turns a ball without sliding friction by at most ρ λn, whichever way it rebounds.
TEST(RollingFrictionTest, AnImpactSlowsTheSpin) {
  for (const char* law : {"newton", "poisson"}) {
    for (const double e : {0.0, 0.5}) {
      Ball ball;
      ball.y = kRadius + 0.5 * kGravity * 0.4 * 0.4;  // falls onto the floor at 0.4 s
      ball.friction = 0.0;
      ball.restitution = e;
      ball.rolling = 0.004;
      ball.omega = 20.0;
      ball.simulation = R"("stepping": "event", "dt": 0.03, "duration": 0.45, "impact_law": ")" +
                        std::string(law) + "\"";
      const Scene scene = SceneOfBall(ball);
      const std::vector<std::string> paths = {"bodies/*/rolling_friction",
                                              "bodies/ball/angular_velocity", "gravity/y"};
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      const double u = kGravity * 0.4;
      const double inertia = kInertiaShare * kRadius * kRadius;
      // Where it stays on the floor the friction goes on.
      const double after = e == 0.0 ? kGravity * 0.05 : 0.0;
      EXPECT_NEAR(result.values[5], 20.0 - ball.rolling * (u * (1.0 + e) + after) / inertia, 1e-9)
          << law << e;
      EXPECT_NEAR(result.jacobian(5, 0), -(u * (1.0 + e) + after) / inertia, 1e-7);
      EXPECT_NEAR(result.jacobian(5, 1), 1.0, 1e-9);
      ExpectOthersAgree(scene, paths, result);
      Ball slow = ball;
      slow.omega = 1.0;
      EXPECT_NEAR(Jacobian(SceneOfBall(slow), paths, GradientMethod::kTangent).values[5], 0.0,
                  1e-12);
    }
  }
}

// Of a body alone it is mixed with 0, of a pair it is the pair's.
TEST(RollingFrictionTest, MixesAndBelongsToPairs) {
  Ball ball;
  ball.vx = 0.1;
  ball.omega = -1.0;
  ball.simulation = R"("stepping": "event", "dt": 0.01, "duration": 0.3)";
  const auto way = [&](double rolling) {
    const double slows = rolling * kGravity / (kRadius * (1.0 + kInertiaShare));
    return 0.1 * 0.3 - 0.5 * slows * 0.09;
  };
  Scene scene = SceneOfBall(ball);
  scene.bodies[1].rolling_friction.reset();
  const std::string path = "bodies/ball/rolling_friction";
  const GradientResult mixed = Jacobian(scene, {path}, GradientMethod::kAdjoint);
  EXPECT_NEAR(mixed.values[0], way(0.001), 1e-12);
  EXPECT_NEAR(mixed.jacobian(0, 0), 0.5 * (way(1.0) - way(0.0)), 1e-9);
  scene.simulation.friction_mixing = Mixing::kGeometricMean;
  EXPECT_NEAR(Jacobian(scene, {path}, GradientMethod::kTangent).values[0], way(0.0), 1e-12);
  BasicPair<double> pair;
  pair.bodies[0] = "ball";
  pair.bodies[1] = "floor";
  pair.rolling_friction = 0.003;
  scene.pairs.push_back(pair);
  const GradientResult own =
      Jacobian(scene, {"pairs/ball:floor/rolling_friction"}, GradientMethod::kAdjoint);
  EXPECT_NEAR(own.values[0], way(0.003), 1e-12);
  ExpectOthersAgree(scene, {"pairs/ball:floor/rolling_friction"}, own);
}

// A wheel that a hinged arm presses onto a belt: the torque changes the load that limits it. The
// belt drags the wheel by f = ρ N / R, and moments about the arm's hinge give:
//   N (L + (H − R) ρ / R) = (m L + m_arm L / 2) g,
// with the belt's direction as the sign of ρ.
TEST(RollingFrictionTest, TheLoadFollowsTheTorque) {
  constexpr double kLength = 0.5, kHeight = 0.4, kRolling = 0.03;
  for (const double side : {1.0, -1.0}) {
    const Scene scene = SceneOf(
        R"({"bodies": [
        {"name": "belt", "kinematic": true, "velocity": [)" +
        std::to_string(side) + R"(, 0], "friction": 2, "rolling_friction": 0.03,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
        {"name": "arm", "mass": 0.5, "inertia": 0.1, "position": [0.25, 0.25]},
        {"name": "wheel", "mass": 2, "shape": {"circle": {"radius": 0.1}}, "position": [0.5, 0.1],
         "angular_velocity": )" +
        std::to_string(side / kRadius) + R"(, "friction": 2, "rolling_friction": 0.03}],
        "joints": [{"type": "revolute", "name": "hinge", "bodies": ["arm", "world"],
                    "anchor": [0, 0.4]},
                   {"type": "revolute", "name": "axle", "bodies": ["wheel", "arm"],
                    "anchor": [0.5, 0.1]}],
        "simulation": {"dt": 0.01, "duration": 0.1}})");
    const double moments = (2.0 + 0.25) * kLength * kGravity;
    const double normal = moments / (kLength + side * (kHeight - kRadius) * kRolling / kRadius);
    Model<double> model;
    State<double> state;
    BuildModel(scene, &model, &state);
    Stepper stepper(model);
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(stepper.Step(model, 0.01 * k, 0.01, &state).status, StepStatus::kDone);
    }
    const ContactSolution<double>& solution = stepper.record().solution;
    ASSERT_EQ(solution.normal_impulse.size(), 2U);
    EXPECT_NEAR(solution.normal_impulse[0], 0.01 * normal, 1e-12);
    // On the belt, which comes first.
    EXPECT_NEAR(solution.tangent_impulse[1], side * kRolling * 0.01 * normal, 1e-13);
    const std::vector<std::string> paths = {"bodies/*/rolling_friction", "bodies/arm/mass"};
    Scene starts = scene;  // and the torque speeds the wheel up from half the belt's speed
    starts.bodies[2].angular_velocity *= 0.5;
    starts.bodies[0].friction = starts.bodies[2].friction = 0.05;
    for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
      starts.simulation.stepping = stepping;
      ExpectOthersAgree(starts, paths, Jacobian(starts, paths, GradientMethod::kAdjoint));
    }
  }
}

}  // namespace
}  // namespace tangible
