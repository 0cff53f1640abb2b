// SPDX-License-Identifier: Apache-2.0
//
// Ellipses and contact points: motions and derivatives against closed forms and against the shapes
// that they equal, by every method.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::kGravity;
using test_scenes::SceneOf;
using test_scenes::Text;
using testing::ExpectAllAgree;
using testing::ExpectNear;
using testing::Jacobian;

struct RolledOutline {
  RolloutReport report;
  State<double> start, final;
  double energy_start = 0.0;
  double energy_end = 0.0;
};

RolledOutline RollOutline(const Scene& scene) {
  Model<double> model;
  RolledOutline run;
  BuildModel(scene, &model, &run.start);
  run.report = Rollout(model, run.start, nullptr, &run.final);
  EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
  run.energy_start = KineticEnergy(model, run.start) + PotentialEnergy(model, run.start);
  run.energy_end = KineticEnergy(model, run.final) + PotentialEnergy(model, run.final);
  return run;
}

std::string OutlinesFor(const char* stepping, double dt, double duration) {
  return std::string(R"("simulation": {"stepping": ")") + stepping + R"(", "dt": )" + Text(dt) +
         R"(, "duration": )" + Text(duration) + "}}";
}

const char kFloor[] = R"(
    {"name": "floor", "static": true, "friction": 0.4, "restitution": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )";

// A disc is dropped, slides, rolls, and meets a box's corner: as a circle and as an ellipse.
TEST(EllipseTest, OfEqualAxesMovesAsACircle) {
  for (const char* stepping : {"fixed", "event"}) {
    const auto scene = [&](const char* shape) {
      return SceneOf(R"({"bodies": [
      {"name": "b", "shape": {)" +
                     std::string(shape) +
                     R"(}, "mass": 2, "position": [0, 0.3], "velocity": [2, 0],
       "angular_velocity": 1, "friction": 0.4, "restitution": 0.5},
      {"name": "step", "static": true, "shape": {"box": {"size": [0.4, 0.16]}},
       "position": [1, 0], "friction": 0.4, "restitution": 0.5},)" +
                     kFloor + OutlinesFor(stepping, 0.005, 1.0));
    };
    const RolledOutline circle = RollOutline(scene(R"("circle": {"radius": 0.1})"));
    const RolledOutline ellipse = RollOutline(scene(R"("ellipse": {"radii": [0.1, 0.1]})"));
    EXPECT_EQ(circle.report.events, ellipse.report.events);
    EXPECT_EQ(circle.report.steps, ellipse.report.steps);
    // Rounding, times what five impacts and a corner make of it.
    ExpectNear(circle.final, ellipse.final, 1e-10);
  }
}

/// An ellipse that stands on the floor at this angle, on which it does not slide.
Scene Rocker(double angle, const char* stepping, double dt, double duration) {
  const double height = std::hypot(0.2 * std::sin(angle), 0.1 * std::cos(angle));
  return SceneOf(R"({"bodies": [
      {"name": "b", "shape": {"ellipse": {"radii": [0.2, 0.1]}}, "mass": 2, "friction": 3,
       "position": [0, )" +
                 Text(height) + R"(], "angle": )" + Text(angle) + R"(},
      {"name": "floor", "static": true, "friction": 3,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
                 OutlinesFor(stepping, dt, duration));
}

// φ = φ_0 cos(ω t), ω² = m g (a²/b − b) / (I + m b²), to the order of φ_0².
TEST(EllipseTest, RocksAtItsFrequency) {
  const double inertia = 2.0 * (0.04 + 0.01) / 4.0;
  const double omega = std::sqrt(2.0 * kGravity * (0.04 / 0.1 - 0.1) / (inertia + 2.0 * 0.01));
  const double at = 0.7;
  const double angle = 1e-3;
  const Scene scene = Rocker(angle, "event", 0.0025, at);
  const RolledOutline run = RollOutline(scene);
  EXPECT_EQ(run.report.events, 0);
  // By amplitude the frequency falls by about φ_0² of it: after ω t = 8 rad.
  const double off = 4.0 * omega * at * angle * angle * angle;
  EXPECT_NEAR(run.final.pose[2], angle * std::cos(omega * at), off);
  EXPECT_NEAR(run.final.twist[2], -angle * omega * std::sin(omega * at), omega * off);
  const RolledOutline fixed = RollOutline(Rocker(angle, "fixed", 1e-4, at));
  EXPECT_NEAR(fixed.final.pose[2], angle * std::cos(omega * at), 0.02 * angle);
}

TEST(EllipseTest, RockingKeepsItsEnergy) {
  const RolledOutline run = RollOutline(Rocker(0.9, "event", 0.002, 3.0));
  EXPECT_EQ(run.report.events, 0);
  EXPECT_GT(std::abs(run.final.pose[2] - 0.9), 0.1);
  // 1500 steps of fourth order with h ω up to 0.02.
  EXPECT_NEAR(run.energy_end, run.energy_start, 1e-7 * run.energy_start);
  // It rolls: the contact point of the body is at rest.
  const double phi = run.final.pose[2];
  const double height = std::hypot(0.2 * std::sin(phi), 0.1 * std::cos(phi));
  EXPECT_NEAR(run.final.pose[1], height, 1e-12);
  EXPECT_NEAR(run.final.twist[0] + height * run.final.twist[2], 0.0, 1e-10);
}

// It falls by 10 mm, lands and rocks.
TEST(EllipseTest, RockingHasItsDerivatives) {
  for (const char* stepping : {"fixed", "event"}) {
    Scene scene = Rocker(0.3, stepping, 0.005, 0.3);
    scene.bodies[0].position.y() += 0.01;
    const GradientResult result =
        ExpectAllAgree(scene, {"bodies/b/shape/radii/x", "bodies/b/shape/radii/y",
                               "bodies/b/angular_velocity", "gravity/y"});
    const bool fixed = scene.simulation.stepping == Stepping::kFixed;
    EXPECT_EQ(result.certificate.verdict,
              fixed ? "of the discrete map: trustworthy" : "trustworthy");
  }
}

// Without gravity, one impact with friction: with the arm r from the centre of mass to the contact,
//   W_nn = 1/m + r_x²/I,  W_tt = 1/m + r_y²/I,  W_nt = −r_x r_y / I,
// it slides where the impulses of sticking are beyond the cone: λ_t = ∓μ λ_n, v_n⁺ = −e v_n.
void ExpectImpact(double mu) {
  const double m = 2.0;
  const double inertia = m * (0.04 + 0.01) / 4.0;
  const double e = 0.5;
  const double start[3] = {0.0, 0.4, 0.3};
  double v[3] = {0.6, -1.5, 2.0};
  const auto gap = [&](double t) {
    const double phi = start[2] + v[2] * t;
    return start[1] + v[1] * t - std::hypot(0.2 * std::sin(phi), 0.1 * std::cos(phi));
  };
  double low = 0.0;
  double high = 0.4;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (gap(middle) > 0.0 ? low : high) = middle;
  }
  const double phi = start[2] + v[2] * low;
  const double height = std::hypot(0.2 * std::sin(phi), 0.1 * std::cos(phi));
  const double rx = -(0.04 - 0.01) * std::sin(phi) * std::cos(phi) / height;
  const double ry = -height;
  const double nn = 1.0 / m + rx * rx / inertia;
  const double tt = 1.0 / m + ry * ry / inertia;
  const double nt = -rx * ry / inertia;
  const double approach = v[1] + rx * v[2];
  const double slip = v[0] - ry * v[2];
  const double det = nn * tt - nt * nt;
  double normal = (-(1.0 + e) * approach * tt + slip * nt) / det;
  double tangent = ((1.0 + e) * approach * nt - slip * nn) / det;
  if (std::abs(tangent) > mu * normal) {
    const double sign = tangent > 0.0 ? 1.0 : -1.0;
    normal = -(1.0 + e) * approach / (nn + sign * mu * nt);
    tangent = sign * mu * normal;
  }
  v[0] += tangent / m;
  v[1] += normal / m;
  v[2] += (rx * normal - ry * tangent) / inertia;
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "shape": {"ellipse": {"radii": [0.2, 0.1]}}, "mass": 2, "position": [0, 0.4],
       "angle": 0.3, "velocity": [0.6, -1.5], "angular_velocity": 2, "restitution": 0.5,
       "friction": )" + Text(mu) +
                              R"(},
      {"name": "floor", "static": true, "restitution": 0.5, "friction": )" +
                              Text(mu) + R"(,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
                              OutlinesFor("event", 0.02, 0.3));
  const RolledOutline run = RollOutline(scene);
  EXPECT_EQ(run.report.events, 1);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(run.final.twist[i], v[i], 1e-12) << i;
  }
  std::vector<std::string> paths = {"bodies/b/shape/radii/x", "bodies/b/shape/radii/y",
                                    "bodies/b/angle", "bodies/b/restitution"};
  if (mu < 0.5) {
    paths.emplace_back("bodies/b/friction");
  }
  EXPECT_EQ(ExpectAllAgree(scene, paths).certificate.verdict, "trustworthy");
}

TEST(EllipseTest, AnImpactWithFrictionIsThatOfTheClosedForm) {
  ExpectImpact(0.1);  // slides
  ExpectImpact(1.0);  // sticks
}

// An ellipse on a tilted box, over whose edge it goes, with an ellipse, a circle and a capsule that
// fall on it: derivatives by every method through impacts between all of them.
TEST(EllipseTest, MeetsOtherShapes) {
  const char* others[] = {
      R"("shape": {"ellipse": {"radii": [0.12, 0.07]}})",
      R"("shape": {"circle": {"radius": 0.09}})",
      R"("shape": {"capsule": {"length": 0.2, "radius": 0.05}})",
      R"("shape": {"polygon": {"vertices": [[-0.1, -0.06], [0.1, -0.06], [0, 0.12]]}})"};
  for (const char* stepping : {"fixed", "event"}) {
    for (const char* other : others) {
      const Scene scene = SceneOf(R"({"bodies": [
      {"name": "b", "shape": {"ellipse": {"radii": [0.2, 0.1]}}, "mass": 2, "position": [0, 0.25],
       "angle": 0.5, "velocity": [0.4, 0], "friction": 0.3, "restitution": 0.2},
      {"name": "c", )" + std::string(other) +
                                  R"(, "mass": 1, "position": [0.05, 0.55], "angle": 0.2,
       "angular_velocity": 1, "friction": 0.3, "restitution": 0.2},
      {"name": "block", "static": true, "shape": {"box": {"size": [1, 0.2]}}, "friction": 0.3,
       "position": [-0.2, -0.05], "angle": -0.1}], )" +
                                  OutlinesFor(stepping, 0.01, 0.3));
      SCOPED_TRACE(std::string(stepping) + other);
      ExpectAllAgree(scene, {"bodies/b/shape/radii/x", "bodies/b/angle", "bodies/c/position/x"});
    }
  }
}

/// A tilted square of this kind lands on the floor, or on a disc.
Scene Square(const char* corners, const char* stepping, const char* ground) {
  return SceneOf(R"({"bodies": [
      {"name": "b", )" +
                 std::string(corners) + R"(, "mass": 2, "inertia": 0.02, "position": [0, 0.3],
       "angle": 0.3, "velocity": [0.5, 0], "friction": 0.3, "restitution": 0.4},
      {"name": "ground", "static": true, "friction": 0.3, "restitution": 0.4, "shape": )" +
                 ground + "}], " + OutlinesFor(stepping, 0.005, 0.3));
}

// What touches by four points touches as a polygon with these corners does, in value and in
// derivative.
TEST(ContactPointTest, TouchesAsACornerDoes) {
  const char polygon[] = R"("shape": {"polygon": {"vertices":
      [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]}})";
  const char points[] = R"("contact_points": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]])";
  const char plane[] = R"({"half_plane": {"normal": [0.1, 1], "offset": 0}})";
  const char box[] = R"({"box": {"size": [3, 0.01]}})";
  for (const char* stepping : {"fixed", "event"}) {
    for (const char* ground : {plane, box}) {
      SCOPED_TRACE(std::string(stepping) + ground);
      const Scene of_points = Square(points, stepping, ground);
      const Scene of_polygon = Square(polygon, stepping, ground);
      const RolledOutline by_points = RollOutline(of_points);
      const RolledOutline by_polygon = RollOutline(of_polygon);
      EXPECT_EQ(by_points.report.events, by_polygon.report.events);
      ExpectNear(by_points.final, by_polygon.final, 1e-12);
      const GradientResult result =
          ExpectAllAgree(of_points, {"bodies/b/contact_points/0/x", "bodies/b/contact_points/0/y"});
      const GradientResult expected =
          Jacobian(of_polygon, {"bodies/b/shape/vertices/0/x", "bodies/b/shape/vertices/0/y"},
                   GradientMethod::kAdjoint);
      EXPECT_LT((result.jacobian - expected.jacobian).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

// A disc with a point beside it: the point meets a pin that the disc misses, as it swings by.
TEST(ContactPointTest, MeetsAPinThatTheShapeMisses) {
  for (const char* stepping : {"fixed", "event"}) {
    const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "contact_points": [[0, 0.25]], "mass": 1,
       "position": [-0.5, 0], "velocity": [2, 0], "restitution": 1, "friction": 0.2},
      {"name": "pin", "static": true, "shape": {"circle": {"radius": 0.01}}, "restitution": 1,
       "friction": 0.2, "position": [0, 0.245]}], )" +
                                std::string(OutlinesFor(stepping, 0.005, 0.4)));
    const RolledOutline run = RollOutline(scene);
    EXPECT_LT(run.final.twist[0], 2.0);
    EXPECT_GT(run.final.twist[2], 1.0);  // the pin holds it above its centre
    if (std::string(stepping) == "event") {
      EXPECT_EQ(run.report.events, 1);
      ExpectAllAgree(scene, {"bodies/b/contact_points/0/x", "bodies/b/contact_points/0/y",
                             "bodies/pin/position/y"});
    }
  }
}

}  // namespace
}  // namespace tangible
