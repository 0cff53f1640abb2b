// SPDX-License-Identifier: Apache-2.0
//
// Friction of bodies on the plane of motion, against closed forms, quadrature and its own law.
#include "tangible/dynamics/elements/support.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>

#include "../../support/scenes.h"

namespace tangible {
namespace {

struct Supported {
  Model<double> model;
  State<double> state;
  SupportFriction friction;
};

Supported Of(const std::string& support, double angle = 0.0) {
  Supported made;
  const Scene scene = test_scenes::SceneOf(
      R"({"gravity": [0, 0], "bodies": [{"name": "b", "mass": 1, "inertia": 1, "position": [3, -2],
          "angle": )" +
      std::to_string(angle) + R"(, "support": )" + support + "}]}");
  BuildModel(scene, &made.model, &made.state);
  made.friction.Set(made.model, made.state, made.model.structure->supports[0], 1.0);
  return made;
}

// By Gauss's rule of this many points.
double Integrate(double from, double to, const std::function<double(double)>& f) {
  constexpr int kPieces = 400;
  double sum = 0.0;
  for (int k = 0; k < kPieces; ++k) {
    const double width = (to - from) / kPieces;
    const double middle = from + (k + 0.5) * width;
    const double arm = 0.5 * width * std::sqrt(0.6);
    sum += width / 18.0 * (5.0 * f(middle - arm) + 8.0 * f(middle) + 5.0 * f(middle + arm));
  }
  return sum;
}

// The integrals over the disc by rings about its centre of rotation, on which the direction of
// friction does not depend on the distance: the force is that of ∫ |v| dA by the speed.
TEST(SupportTest, TheDiscIsTheIntegralOverItsArea) {
  const double radius = 0.3;
  for (const double ratio : {0.0, 0.01, 0.4, 0.653, 0.97, 1.03, 1.8, 40.0, 1e4}) {
    const double omega = 2.0;
    const double twist[3] = {ratio * omega * radius, 0.0, omega};
    // ∫ (v + ω × r) / |v + ω × r| dA / (π R²) in polar coordinates.
    const auto over = [&](const std::function<double(double, double, double)>& f) {
      return Integrate(0.0, radius, [&](double r) {
        return r * 2.0 * Integrate(-0.5 * std::numbers::pi, 0.5 * std::numbers::pi, [&](double a) {
                 const double vx = twist[0] - omega * r * std::sin(a);
                 const double vy = omega * r * std::cos(a);
                 const double speed = std::hypot(vx, vy);
                 return f(vx / speed, vy / speed, a) * 1.0;
               });
      });
    };
    const double area = std::numbers::pi * radius * radius;
    double friction[3];
    DiscFriction(radius, twist, friction);
    const double near_rim = std::abs(ratio - 1.0) < 0.1 ? 2e-4 : 2e-5;  // of the quadrature
    EXPECT_NEAR(-friction[0], over([](double dx, double, double) { return dx; }) / area, near_rim)
        << ratio;
    EXPECT_EQ(friction[1], 0.0);
    const double torque = Integrate(0.0, radius, [&](double r) {
      return 2.0 * r * r *
             Integrate(-0.5 * std::numbers::pi, 0.5 * std::numbers::pi, [&](double a) {
               const double vx = twist[0] - omega * r * std::sin(a);
               const double vy = omega * r * std::cos(a);
               return (std::cos(a) * vy - std::sin(a) * vx) / std::hypot(vx, vy);
             });
    });
    EXPECT_NEAR(-friction[2], torque / area, near_rim) << ratio;
  }
  // Pure spin, pure sliding, and little spin: μ N R ω R / (4 v).
  double friction[3];
  const double spin[3] = {0.0, 0.0, -2.0};
  DiscFriction(radius, spin, friction);
  EXPECT_NEAR(friction[2], 2.0 / 3.0 * radius, 1e-15);
  const double slide[3] = {3.0, -4.0, 0.0};
  DiscFriction(radius, slide, friction);
  EXPECT_NEAR(friction[0], -0.6, 1e-15);
  EXPECT_NEAR(friction[1], 0.8, 1e-15);
  EXPECT_EQ(friction[2], 0.0);
  const double little[3] = {3.0, 4.0, 1e-5};
  DiscFriction(radius, little, friction);
  EXPECT_NEAR(friction[2] / (-0.25 * radius * radius * 1e-5 / 5.0), 1.0, 1e-11);
}

// Force and torque are the derivatives of one dissipation: their Jacobian is symmetric, vanishes
// along the twist, and is that of differences; the dampers are it.
TEST(SupportTest, TheDiscHasASymmetricDerivative) {
  const double radius = 0.3;
  for (const double omega : {0.3, 1.99, 2.01, 7.0}) {
    const double twist[3] = {0.48, 0.36, omega};
    double rows[3][3], weights[3], derivative[3][3];
    DiscDampers(radius, twist, rows, weights);
    for (int k = 0; k < 3; ++k) {
      double above[3] = {twist[0], twist[1], twist[2]}, below[3] = {twist[0], twist[1], twist[2]};
      const double step = 1e-6;
      above[k] += step;
      below[k] -= step;
      double f_above[3], f_below[3];
      DiscFriction(radius, above, f_above);
      DiscFriction(radius, below, f_below);
      for (int i = 0; i < 3; ++i) derivative[i][k] = -(f_above[i] - f_below[i]) / (2.0 * step);
    }
    for (int i = 0; i < 3; ++i) {
      double along = 0.0;
      for (int k = 0; k < 3; ++k) {
        double sum = 0.0;
        for (int r = 0; r < 3; ++r) sum += weights[r] * rows[r][i] * rows[r][k];
        EXPECT_NEAR(sum, derivative[i][k], 1e-7) << omega << ' ' << i << ' ' << k;
        EXPECT_NE(sum, derivative[i][k]);
        EXPECT_NEAR(derivative[i][k], derivative[k][i], 1e-8);
        along += sum * twist[k];
      }
      EXPECT_NEAR(along, 0.0, 1e-14);
    }
  }
}

TEST(SupportTest, TheCentreHoldsExactlyWithinItsCone) {
  const Supported made = Of(R"({"friction": 0.5, "load": 8})");
  const double within[3] = {-2.4, 3.2, 0.0};  // of size 4, the limit
  EXPECT_TRUE(made.friction.CanHold(within));
  const double beyond[3] = {-2.4, 3.2 * (1.0 + 1e-15), 0.0};
  EXPECT_FALSE(made.friction.CanHold(beyond));
  const double mass[3] = {2.0, 2.0, 1.0}, momentum[3] = {6.0, 8.0, 3.0};
  const SupportState alone = made.friction.SolveAlone(mass, momentum);
  EXPECT_EQ(alone.holds, SupportState::kNothing);
  EXPECT_NEAR(alone.twist[0], 1.8, 1e-15);  // 4 of 10 are taken away
  EXPECT_NEAR(alone.twist[1], 2.4, 1e-15);
  EXPECT_EQ(alone.twist[2], 3.0);
}

// Two points at ± a along x: torques up to 2 a c, forces up to 2 c, and a point about which the
// body turns where the torque alone is too large for the other one.
TEST(SupportTest, PointsHoldWhatTheyCanBalance) {
  const Supported made = Of(R"({"friction": 0.5, "load": 8, "points": [[0.5, 0], [-0.5, 0]]})");
  const auto holds = [&](double fx, double fy, double torque) {
    const double wrench[3] = {fx, fy, torque};
    return made.friction.CanHold(wrench);
  };
  EXPECT_TRUE(holds(0.0, 0.0, 1.999999));
  EXPECT_FALSE(holds(0.0, 0.0, 2.000001));
  EXPECT_TRUE(holds(0.0, 3.999999, 0.0));
  EXPECT_FALSE(holds(0.0, 4.000001, 0.0));
  // f = (fx / 2, ± torque) at the two points: (2 fx / 4)² + torque² ≤ 2².
  EXPECT_TRUE(holds(3.2, 0.0, 1.199999));
  EXPECT_FALSE(holds(3.2, 0.0, 1.200001));
  // Along y the other point takes 2 at most, and its own torque with it.
  EXPECT_TRUE(holds(0.0, 3.0, 0.499999));
  EXPECT_FALSE(holds(0.0, 3.0, 0.500001));
  const double half[3] = {0.0, 0.0, 1.0};
  EXPECT_NEAR(made.friction.Reserve(half), 0.5, 0.26);
  // Pushed at one point, a little more than it can hold: the body turns about one nearby.
  const double mass[3] = {1.0, 1.0, 1.0}, momentum[3] = {0.0, 2.2, 1.1};
  const SupportState alone = made.friction.SolveAlone(mass, momentum);
  EXPECT_EQ(alone.holds, 1);
  EXPECT_NEAR(alone.twist[1] - 0.5 * alone.twist[2], 0.0, 1e-9);
  EXPECT_GT(alone.twist[2], 0.0);
}

// At the limit the friction of a motion is the wrench, which tells the motion however little the
// wrench exceeds it.
TEST(SupportTest, AWrenchJustBeyondTheLimitTellsTheMotionThatItBegins) {
  const Supported made = Of(R"({"friction": 0.4, "load": 5, "radius": 0.4})");
  const double mass[3] = {1.0, 1.0, 0.16};
  for (const double omega : {0.0, 0.1, 1.0, 2.5, 7.0, 40.0}) {
    const double twist[3] = {0.6, -0.8, omega};
    double wrench[3];
    made.friction.At(twist, wrench);
    for (const double excess : {3e-16, 1e-15, 1e-13, 1e-10, 1e-8}) {
      double push[3];
      for (int i = 0; i < 3; ++i) push[i] = -(1.0 + excess) * wrench[i];
      const SupportState alone = made.friction.SolveAlone(mass, push);
      if (alone.holds == SupportState::kBody) {
        EXPECT_LT(excess, 1e-14) << "to rounding it may hold";
        continue;
      }
      const double size = std::hypot(alone.twist[0], alone.twist[1]);
      ASSERT_GT(size, 0.0) << omega << " " << excess;
      // Behind the limit the motion turns at a rate of 1.
      const double within = 1e-12 + 30.0 * excess;
      EXPECT_NEAR(alone.twist[0] / size, 0.6, within) << omega << " " << excess;
      EXPECT_NEAR(alone.twist[1] / size, -0.8, within) << omega << " " << excess;
      EXPECT_NEAR(alone.twist[2] / size, omega, (1.0 + omega * omega) * within)
          << omega << " " << excess;
    }
  }
}

// The conditions of the minimum, at random.
TEST(SupportTest, TheMotionOfABodyAloneObeysCoulombsLaw) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  int slides = 0, turns = 0, rests = 0;
  for (int k = 0; k < 600; ++k) {
    const bool disc = k % 3 == 0;
    const Supported made =
        disc ? Of(R"({"friction": 0.4, "load": 5, "radius": 0.4})")
             : Of(R"({"friction": 0.4, "load": 5, "points": [[0.4, 0.1], [-0.3, 0.2], [0, -0.5]],
                      "shares": [1, 2, 3]})",
                  0.7);
    const double mass[3] = {1.5, 1.5, 0.2};
    const double size = std::pow(10.0, 0.3 + 0.5 * normal(random));
    const double momentum[3] = {size * normal(random), size * normal(random),
                                0.4 * size * normal(random)};
    const SupportState alone = made.friction.SolveAlone(mass, momentum);
    if (alone.holds == SupportState::kBody) {
      ++rests;
      EXPECT_TRUE(made.friction.CanHold(momentum));
      continue;
    }
    double law[3];
    made.friction.At(alone.twist.data(), law);
    double left[3];
    for (int i = 0; i < 3; ++i) left[i] = mass[i] * alone.twist[i] - momentum[i] - law[i];
    if (alone.holds == SupportState::kNothing) {
      ++slides;
      EXPECT_LT(std::hypot(left[0], left[1], left[2]), 1e-7) << k;
      continue;
    }
    ++turns;
    // What is left is the force of the point that is held.
    const SupportPoint& point = made.friction.points()[alone.holds];
    double own[2], speed[2];
    point.VelocityAt(alone.twist.data(), speed);
    const double v = std::hypot(speed[0], speed[1]);
    for (int i = 0; i < 2; ++i) own[i] = left[i] + (v > 0.0 ? -point.limit * speed[i] / v : 0.0);
    EXPECT_LE(std::hypot(own[0], own[1]), point.limit * (1.0 + 1e-6)) << k;
    EXPECT_LT(v, 1e-8);
  }
  EXPECT_GT(slides, 100);
  EXPECT_GT(turns, 10);
  EXPECT_GT(rests, 50);
}

}  // namespace
}  // namespace tangible
