// SPDX-License-Identifier: Apache-2.0
//
// Polylines: motions over flush joints, through valleys, over ridges and off an end against closed
// forms and against the half-plane that they equal, and derivatives by every method.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::kGravity;
using test_scenes::SceneOf;
using test_scenes::Text;
using testing::ExpectAllAgree;
using testing::ExpectNear;
using testing::ExpectOthersAgree;
using testing::Jacobian;

struct RolledOnPolyline {
  RolloutReport report;
  State<double> final;
};

RolledOnPolyline RollOnPolyline(const Scene& scene) {
  Model<double> model;
  State<double> start;
  RolledOnPolyline run;
  BuildModel(scene, &model, &start);
  run.report = Rollout(model, start, nullptr, &run.final);
  EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
  return run;
}

/// A body on a polyline or what replaces it.
Scene On(const std::string& body, const std::string& ground, const std::string& stepping,
         double duration, double friction = 0.4, double restitution = 0.0) {
  const std::string law =
      R"("friction": )" + Text(friction) + R"(, "restitution": )" + Text(restitution);
  return SceneOf(R"({"bodies": [{"name": "b", "mass": 2, )" + law + ", " + body +
                 R"(}, {"name": "ground", "static": true, )" + law + R"(, "shape": {)" + ground +
                 R"(}}], "simulation": {"stepping": ")" + stepping +
                 R"(", "dt": 0.01, "duration": )" + Text(duration) + "}}");
}

const char kPlane[] = R"("half_plane": {"normal": [0, 1], "offset": 0})";
const char kFlush[] =
    R"("polyline": {"points": [[-2, 0], [0, 0], [0.3, 0], [0.35, 0], [4, 0]], "solid": "right"})";
const char kValley[] = R"("polyline": {"points": [[-1, 1], [0, 0], [1, 1]], "solid": "right"})";

std::string DiscWith(const std::string& more) {
  return R"("shape": {"circle": {"radius": 0.1}}, )" + more;
}

// A disc slides, comes to roll, and passes three joints at which the outline does not turn.
TEST(PolylineTest, RollsOverFlushJointsAsOnAPlane) {
  const std::string body =
      DiscWith(R"("position": [-0.3, 0.1], "velocity": [2, 0], "angular_velocity": 3)");
  for (const char* stepping : {"fixed", "event"}) {
    const RolledOnPolyline plane = RollOnPolyline(On(body, kPlane, stepping, 1.0));
    const RolledOnPolyline line = RollOnPolyline(On(body, kFlush, stepping, 1.0));
    EXPECT_GT(line.final.pose[0], 0.5);
    EXPECT_EQ(plane.report.events, line.report.events);
    ExpectNear(plane.final, line.final, stepping[0] == 'f' ? 1e-9 : 1e-11);
  }
}

// The same for shapes with faces and corners, which stand on several edges at once.
TEST(PolylineTest, OtherShapesSlideOverFlushJointsAsOnAPlane) {
  for (const char* shape :
       {R"("box": {"size": [0.3, 0.2]})", R"("capsule": {"length": 0.4, "radius": 0.1})",
        R"("polygon": {"vertices": [[-0.2, -0.1], [0.2, -0.1], [0, 0.2]]})"}) {
    const std::string body =
        R"("shape": {)" + std::string(shape) + R"(}, "position": [-0.3, 0.1], "velocity": [2, 0])";
    for (const char* stepping : {"fixed", "event"}) {
      SCOPED_TRACE(shape + std::string(" ") + stepping);
      const RolledOnPolyline plane = RollOnPolyline(On(body, kPlane, stepping, 0.8, 0.1));
      const RolledOnPolyline line = RollOnPolyline(On(body, kFlush, stepping, 0.8, 0.1));
      EXPECT_GT(line.final.pose[0], 0.5);
      ExpectNear(plane.final, line.final, 1e-9);
    }
  }
}

// Both edges turn by 45°: the centre is √2 r above the corner, however long the edges are.
TEST(PolylineTest, ADiscRestsInAValleyOnBothEdges) {
  for (const char* stepping : {"fixed", "event"}) {
    for (const double friction : {0.0, 0.4}) {
      SCOPED_TRACE(stepping + std::string(" ") + Text(friction));
      const RolledOnPolyline run =
          RollOnPolyline(On(DiscWith(R"("position": [0.02, 0.6], "angular_damping": 0.1)"), kValley,
                            stepping, 3.0, friction));
      EXPECT_NEAR(run.final.pose[0], 0.0, 1e-6);
      EXPECT_NEAR(run.final.pose[1], 0.1 * std::sqrt(2.0), 1e-6);
      EXPECT_NEAR(run.final.twist[0], 0.0, 1e-6);
    }
  }
}

// Without friction a disc that is faster than √(g r) leaves the end as it comes over it.
TEST(PolylineTest, FallsOffTheEnd) {
  const char ground[] = R"("polyline": {"points": [[-2, 0], [0, 0]], "solid": "right"})";
  const RolledOnPolyline run = RollOnPolyline(
      On(DiscWith(R"("position": [-0.5, 0.1], "velocity": [2, 0])"), ground, "event", 0.5, 0.0));
  EXPECT_NEAR(run.final.pose[0], 0.5, 1e-12);
  EXPECT_NEAR(run.final.pose[1], 0.1 - 0.5 * kGravity * 0.25 * 0.25, 1e-9);
  EXPECT_NEAR(run.final.twist[1], -kGravity * 0.25, 1e-9);
}

// Without friction the speed along the floor becomes its part along the slope of 3 in 4, at once.
TEST(PolylineTest, AConcaveCornerIsOneEvent) {
  const char ground[] = R"("polyline": {"points": [[-2, 0], [0, 0], [4, 3]], "solid": "right"})";
  const RolledOnPolyline run = RollOnPolyline(
      On(DiscWith(R"("position": [-0.5, 0.1], "velocity": [4, 0])"), ground, "event", 0.4, 0.0));
  EXPECT_EQ(run.report.events, 1);
  const double rise = run.final.pose[1] - 0.1;
  EXPECT_GT(rise, 0.1);
  const double speed = std::hypot(run.final.twist[0], run.final.twist[1]);
  EXPECT_NEAR(speed * speed, 3.2 * 3.2 - 2.0 * kGravity * rise, 1e-9);
  EXPECT_NEAR(run.final.twist[1] / run.final.twist[0], 0.75, 1e-9);
}

// A slow disc turns about the corner of a ridge, on the arc of its radius, and keeps its energy to
// the fourth order of the step.
TEST(PolylineTest, GoesRoundAConvexCorner) {
  const char ground[] = R"("polyline": {"points": [[-2, 0], [0, 0], [4, -3]], "solid": "right"})";
  const auto lost = [&](double dt) {
    Scene scene = On(DiscWith(R"("position": [-0.05, 0.1], "velocity": [0.3, 0])"), ground, "event",
                     0.5, 0.0);
    scene.simulation.dt = dt;
    const RolledOnPolyline run = RollOnPolyline(scene);
    EXPECT_EQ(run.report.events, 2);
    const double x = run.final.pose[0], y = run.final.pose[1];
    EXPECT_GT(x, 0.2);
    EXPECT_NEAR(0.6 * x + 0.8 * y, 0.1, 1e-9);
    const double speed = std::hypot(run.final.twist[0], run.final.twist[1]);
    return std::abs(0.5 * speed * speed + kGravity * y - 0.5 * 0.09 - kGravity * 0.1);
  };
  const double coarse = lost(0.01);
  EXPECT_LT(coarse, 1e-6);
  EXPECT_LT(lost(0.005), coarse / 12.0);
}

// The centre is behind the line: what is there is in the solid, however deep.
TEST(PolylineTest, ADeepStartIsPushedOutOnTheFreeSide) {
  const char ground[] = R"("polyline": {"points": [[-2, 0], [2, 0]], "solid": "right"})";
  const RolledOnPolyline run =
      RollOnPolyline(On(DiscWith(R"("position": [0.3, -0.5])"), ground, "fixed", 2.0));
  EXPECT_NEAR(run.final.pose[1], 0.1, 1e-6);
}

// A slab of 0.02 m, of which the lower side is behind a disc on the upper one.
TEST(PolylineTest, TheOtherSideOfAThinSolidDoesNotAct) {
  const char slab[] = R"("polyline": {"points": [[-2, -0.02], [2, -0.02], [2, 0], [-2, 0]],
                                      "closed": true})";
  for (const char* stepping : {"fixed", "event"}) {
    const std::string body = DiscWith(R"("position": [0.1, 0.1], "velocity": [0.5, 0])");
    const RolledOnPolyline line = RollOnPolyline(On(body, slab, stepping, 1.0));
    const RolledOnPolyline plane = RollOnPolyline(On(body, kPlane, stepping, 1.0));
    ExpectNear(plane.final, line.final, 1e-9);
  }
}

TEST(PolylineTest, SolidOnTheRightIsThePointsBackwards) {
  const std::string body = DiscWith(R"("position": [-0.4, 0.9], "velocity": [0.5, 0])");
  const char right[] = R"("polyline": {"points": [[-1, 1], [0, 0], [1, 1]], "solid": "right"})";
  const char left[] = R"("polyline": {"points": [[1, 1], [0, 0], [-1, 1]]})";
  const char mirror[] = R"("polyline": {"points": [[1, 1], [0, 0], [-1, 1]], "solid": "left"})";
  for (const char* stepping : {"fixed", "event"}) {
    const RolledOnPolyline a = RollOnPolyline(On(body, right, stepping, 0.7, 0.4, 0.5));
    const RolledOnPolyline b = RollOnPolyline(On(body, left, stepping, 0.7, 0.4, 0.5));
    ExpectNear(a.final, b.final, 0.0);
    const RolledOnPolyline c =
        RollOnPolyline(On(DiscWith(R"("position": [0.4, 0.9], "velocity": [-0.5, 0])"), mirror,
                          stepping, 0.7, 0.4, 0.5));
    EXPECT_NEAR(a.final.pose[0], -c.final.pose[0], 1e-9);
    EXPECT_NEAR(a.final.pose[1], c.final.pose[1], 1e-9);
  }
}

// A point of a body without a shape, and a platform that moves.
TEST(PolylineTest, ContactPointsAndKinematicPolylines) {
  for (const char* stepping : {"fixed", "event"}) {
    const std::string body =
        R"("inertia": 1, "contact_points": [[-0.1, -0.1], [0.1, -0.1]], "position": [0, 0.1])";
    const RolledOnPolyline run = RollOnPolyline(On(body, kFlush, stepping, 0.5));
    EXPECT_NEAR(run.final.pose[1], 0.1, 1e-9);
    Scene scene =
        On(DiscWith(R"("position": [0, 0.1], "velocity": [0, 0.5])"), kFlush, stepping, 1.0);
    scene.bodies[1].motion = Motion::kKinematic;
    scene.bodies[1].velocity = Vector2<double>(0.0, 0.5);
    EXPECT_NEAR(RollOnPolyline(scene).final.pose[1], 0.6, 1e-9);
  }
}

// A disc rebounds, passes a valley, and rolls on the next edge; a point is read by two edges.
TEST(PolylineTest, DerivativesOfAllMethodsAgree) {
  const char ground[] = R"("polyline": {"points": [[-2, 1], [0, 0], [1, 0.2], [3, 1.6]],
                                        "solid": "right"})";
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    ExpectAllAgree(On(DiscWith(R"("position": [-1, 0.9], "velocity": [0.5, 0])"), ground, stepping,
                      1.1, 0.3, 0.3),
                   {"bodies/b/position/x", "bodies/b/shape/radius",
                    "bodies/ground/shape/points/0/y", "bodies/ground/shape/points/1/x",
                    "bodies/ground/shape/points/1/y", "bodies/ground/shape/points/2/y"});
  }
}

// A box slides into a slope of 45 degrees, which catches its corner: the corner stays where floor
// and slope meet, and the box turns about it with what is left of its angular momentum.
TEST(PolylineTest, ACornerThatIsCaughtInAValleyIsAPivot) {
  const char ground[] = R"("polyline": {"points": [[-2, 0], [0, 0], [1, 1]], "solid": "right"})";
  const Scene scene =
      On(R"("shape": {"box": {"size": [0.2, 0.2]}}, "position": [-0.5, 0.1], "velocity": [2, 0])",
         ground, "event", 0.28, 0.3);
  const RolledOnPolyline run = RollOnPolyline(scene);
  const double slid = std::sqrt(4.0 - 2.0 * 0.3 * kGravity * 0.4);
  const double about_corner = 0.02 + 0.04 / 6.0;  // m², by the mass
  const double turned = 0.1 * slid / about_corner;
  const double angle = run.final.pose[2];
  const double sine = std::sin(angle);
  const double cosine = std::cos(angle);
  EXPECT_NEAR(run.final.pose[0], -0.1 * cosine - 0.1 * sine, 1e-9);
  EXPECT_NEAR(run.final.pose[1], -0.1 * sine + 0.1 * cosine, 1e-9);
  const double left = turned * turned - 2.0 * kGravity * (run.final.pose[1] - 0.1) / about_corner;
  EXPECT_NEAR(run.final.twist[2], -std::sqrt(left), 2e-6);  // the integrator's error
  ExpectAllAgree(scene, {"bodies/b/position/x", "bodies/b/shape/size/x", "bodies/b/friction",
                         "bodies/ground/shape/points/1/x"});
}

// A ball that leaves the end of a slope, where its foot passes from the slope to the end without an
// impact: the time of that has a derivative, v_d² = v² − 2 g d sin α at the end.
TEST(PolylineTest, TheTimeOfLeavingASlopeHasADerivative) {
  for (const double degrees : {30.0, 45.0, -20.0, 0.0}) {
    SCOPED_TRACE(degrees);
    const double slope = degrees * std::numbers::pi / 180.0;
    const double sine = std::sin(slope);
    const double cosine = std::cos(slope);
    const auto at = [](double x, double y) { return "[" + Text(x) + ", " + Text(y) + "]"; };
    // 0.5 m before the end at the origin.
    const Scene scene =
        On(DiscWith(R"("position": )" + at(-0.5 * cosine - 0.1 * sine, -0.5 * sine + 0.1 * cosine) +
                    R"(, "velocity": )" + at(4.0 * cosine, 4.0 * sine)),
           R"("polyline": {"points": [)" + at(-2.0 * cosine, -2.0 * sine) +
               R"(, [0, 0]], "solid": "right"})",
           "event", 0.4, 0.0);
    const GradientResult result = ExpectAllAgree(scene, {"bodies/b/velocity/x"});
    const double leaves = std::sqrt(16.0 - 2.0 * kGravity * 0.5 * sine);
    EXPECT_NEAR(result.jacobian(3, 0), cosine * cosine * 4.0 / leaves, 1e-8);
  }
}

// A disc that falls beside a bowl, past its end, is not in what is solid behind it.
TEST(PolylineTest, WhatFallsBesideABowlFalls) {
  const char bowl[] = R"("polyline": {"points": [[-1, 0.5], [-0.5, 0.125], [0, 0], [0.5, 0.125],
                                                 [1, 0.5]], "solid": "right"})";
  for (const char* stepping : {"fixed", "event"}) {
    const RolledOnPolyline run =
        RollOnPolyline(On(DiscWith(R"("position": [1.5, 1])"), bowl, stepping, 0.8));
    EXPECT_NEAR(run.final.pose[1], 1.0 - 0.5 * kGravity * 0.64, 0.05);
    EXPECT_NEAR(run.final.twist[1], -kGravity * 0.8, 1e-9);
  }
}

// The first point of a closed outline, which its last edge reads too.
TEST(PolylineTest, DerivativesByPointsOfAClosedOutline) {
  const char room[] = R"("polyline": {"points": [[0.3, -0.2], [2, 1.5], [0, 2], [-1.5, 1]],
                                      "closed": true, "solid": "right"})";
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    ExpectAllAgree(On(DiscWith(R"("position": [-0.2, 0.6], "velocity": [0.2, 0])"), room, stepping,
                      0.45, 0.3, 0.2),
                   {"bodies/ground/shape/points/0/x", "bodies/ground/shape/points/0/y",
                    "bodies/ground/shape/points/3/y"});
  }
}

// A disc that passes a flush joint within a step, at 0.25 s: the slope of the edge behind it by the
// height of its end takes g sin times the time on it, two thirds of that where it rolls.
TEST(PolylineTest, DerivativesByThePointsBehindAFlushJoint) {
  const char line[] = R"("polyline": {"points": [[-1, 0], [0, 0], [1, 0]], "solid": "right"})";
  const std::vector<std::string> paths = {"bodies/ground/shape/points/2/y"};
  for (const double dt : {0.1, 0.05, 0.03}) {
    for (const auto& [friction, spin] :
         {std::pair(0.0, 0.0), std::pair(0.5, -10.0), std::pair(0.1, 0.0)}) {
      SCOPED_TRACE(Text(dt) + " " + Text(friction));
      Scene scene = On(DiscWith(R"("position": [-0.25, 0.1], "velocity": [1, 0],
                                   "angular_velocity": )" +
                                Text(spin)),
                       line, "event", 0.5, friction);
      scene.simulation.dt = dt;
      const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
      ASSERT_TRUE(result.done) << result.message;
      EXPECT_EQ(result.certificate.verdict, "trustworthy");
      ExpectOthersAgree(scene, paths, result);
      const double share = spin != 0.0 ? 2.0 / 3.0 : 1.0;
      if (friction == 0.1) continue;
      EXPECT_NEAR(result.jacobian(3, 0), -share * kGravity * 0.25, 1e-9);
      EXPECT_NEAR(result.jacobian(0, 0), -share * kGravity * 0.03125, 1e-9);
    }
  }
}

// A disc that lands over one, or starts there, has two derivatives by the points, and one by where
// it is.
TEST(PolylineTest, OverAFlushJointTheDerivativesByPointsHaveTwoSides) {
  const char line[] = R"("polyline": {"points": [[-1, 0], [0, 0], [1, 0]], "solid": "right"})";
  const Scene lands = On(DiscWith(R"("position": [0, 0.5])"), line, "event", 0.4, 0.0, 0.5);
  const std::vector<std::string> paths = {"bodies/ground/shape/points/2/y"};
  const GradientResult both = Jacobian(lands, paths, GradientMethod::kTangent);
  EXPECT_NE(both.certificate.verdict.find("is over a flush corner"), std::string::npos)
      << both.certificate.verdict;
  const double speed = std::sqrt(0.8 * kGravity);
  for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
    const GradientResult one = FinalStateJacobian(
        lands, testing::Resolve(lands, paths), {.method = GradientMethod::kTangent, .side = side});
    ASSERT_TRUE(one.done) << one.message;
    EXPECT_NEAR(one.jacobian(3, 0), side == DerivativeSide::kPlus ? -1.5 * speed : 0.0, 1e-6);
  }
  for (const char* stepping : {"fixed", "event"}) {
    const Scene starts =
        On(DiscWith(R"("position": [0, 0.1], "velocity": [1, 0])"), line, stepping, 0.4, 0.0);
    EXPECT_NE(Jacobian(starts, paths, GradientMethod::kTangent)
                  .certificate.verdict.find("is over a flush corner"),
              std::string::npos);
    const GradientResult place =
        Jacobian(starts, {"bodies/b/position/x"}, GradientMethod::kTangent);
    EXPECT_EQ(place.certificate.verdict, "trustworthy");
    EXPECT_NEAR(place.jacobian(0, 0), 1.0, 1e-12);
  }
}

// Rolling friction goes on behind a flush joint, also where motions end there: the speed falls by
// (ρ g / r) t / 1.5.
TEST(PolylineTest, RollingFrictionPassesAFlushJoint) {
  const char line[] = R"("polyline": {"points": [[-1, 0], [0, 0], [1, 0]], "solid": "right"})";
  for (const double dt : {0.1, 0.01}) {
    Scene scene = On(DiscWith(R"("position": [-0.25, 0.1], "velocity": [1, 0],
                                 "angular_velocity": -10)"),
                     line, "event", 0.5, 0.5);
    scene.simulation.dt = dt;
    for (BasicBody<double>& body : scene.bodies) body.rolling_friction = 0.01;
    const std::vector<std::string> paths = {"bodies/ground/shape/points/2/y"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_EQ(result.certificate.verdict, "trustworthy");
    EXPECT_NEAR(result.values[3], 1.0 - 0.1 * kGravity * 0.5 / 1.5, 1e-9);
    ExpectOthersAgree(scene, paths, result);
  }
}

}  // namespace
}  // namespace tangible
