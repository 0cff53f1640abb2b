// SPDX-License-Identifier: Apache-2.0
//
// Concave polygons at rest and moving: motions against closed forms, against the half-plane and the
// boxes that they equal, contacts of two of them, and derivatives by every method.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using test_scenes::Text;
using testing::ExpectAllAgree;
using testing::ExpectNear;

struct RolledConcave {
  RolloutReport report;
  State<double> final;
  Vector2<double> At(int body) const {
    return Vector2<double>(final.pose[3 * body], final.pose[3 * body + 1]);
  }
};

RolledConcave RollConcave(const Scene& scene) {
  Model<double> model;
  State<double> start;
  RolledConcave run;
  BuildModel(scene, &model, &start);
  run.report = Rollout(model, start, nullptr, &run.final);
  EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
  return run;
}

std::string PolygonText(const std::vector<double>& numbers) {
  std::string text = R"("polygon": {"vertices": [)";
  for (size_t i = 0; i < numbers.size(); i += 2) {
    text += (i > 0 ? ", [" : "[") + Text(numbers[i]) + ", " + Text(numbers[i + 1]) + "]";
  }
  return text + "]}";
}

/// Of an outline, moved.
std::vector<double> Shifted(std::vector<double> numbers, double x, double y) {
  for (size_t i = 0; i < numbers.size(); i += 2) {
    numbers[i] += x;
    numbers[i + 1] += y;
  }
  return numbers;
}

struct ConcaveLaw {
  const char* stepping;
  double duration;
  double friction = 0.4;
  double restitution = 0.0;
  double dt = 0.01;
};

/// A body b of 2 kg and what it meets, bodies of which the first has the name ground.
Scene Meets(const std::string& body, const std::vector<std::string>& grounds,
            const ConcaveLaw& law) {
  const std::string coefficients =
      R"("friction": )" + Text(law.friction) + R"(, "restitution": )" + Text(law.restitution);
  std::string text = R"({"bodies": [{"name": "b", "mass": 2, )" + coefficients + ", " + body + "}";
  for (size_t i = 0; i < grounds.size(); ++i) {
    text += R"(, {"name": "ground)" + (i > 0 ? std::to_string(i) : std::string()) +
            R"(", "static": true, )" + coefficients + ", " + grounds[i] + "}";
  }
  return SceneOf(text + R"(], "simulation": {"stepping": ")" + law.stepping + R"(", "dt": )" +
                 Text(law.dt) + R"(, "duration": )" + Text(law.duration) + "}}");
}

std::string ShapeText(const std::string& shape) { return R"("shape": {)" + shape + "}"; }
std::string ShapeText(const std::vector<double>& vertices) {
  return ShapeText(PolygonText(vertices));
}

const char kFloorPlane[] = R"("shape": {"half_plane": {"normal": [0, 1], "offset": 0}})";
const char kDiscShape[] = R"("shape": {"circle": {"radius": 0.1}}, )";
/// An arch with a level top at y = 0.
const std::vector<double> kArchTop = {-2,  -1, -0.5, -1, -0.5, -0.5, 0.5, -0.5,
                                      0.5, -1, 2,    -1, 2,    0,    -2,  0};
/// Legs of 1 m about the centroid of an L whose outer corner is at (−5/6, −5/6).
const std::vector<double> kAngle =
    Shifted({0, 0, 2, 0, 2, 1, 1, 1, 1, 2, 0, 2}, -5.0 / 6.0, -5.0 / 6.0);
/// A staple of legs of 0.5 m about its centroid, 0.15 m below the level inner edge of 0.3 m.
const std::vector<double> kStaple = Shifted(
    {-0.25, -0.5, -0.15, -0.5, -0.15, 0, 0.15, 0, 0.15, -0.5, 0.25, -0.5, 0.25, 0.1, -0.25, 0.1},
    0.0, 0.15);
/// A post of 0.2 m with a level top at y = 0.
const std::vector<double> kPost = {-1,  -1, 1,    -1, 1,    -0.8, 0.1, -0.8,
                                   0.1, 0,  -0.1, 0,  -0.1, -0.8, -1,  -0.8};

/// Edges of 45° that meet at the origin.
const std::vector<double> kNotch = {-1.2, -0.5, 1.2, -0.5, 1.2, 1, 1, 1, 0, 0, -1, 1, -1.2, 1};

TEST(ConcavePolygonTest, MassPropertiesOfAnAngleAndATrough) {
  // An L of three unit squares: 1.8333 kg m² of 3 kg; a U of five: 6.0333 kg m² of 5 kg.
  const std::vector<double> trough =
      Shifted({0, 0, 3, 0, 3, 2, 2, 2, 2, 1, 1, 1, 1, 2, 0, 2}, -1.5, -0.9);
  for (const auto& [vertices, share] :
       {std::pair(kAngle, 11.0 / 18.0),
        std::pair(trough, (2.98 + 2.0 * (1.0 / 6.0 + 1.36)) / 5.0)}) {
    const Scene scene =
        Meets(ShapeText(vertices) + R"(, "position": [0, 9])", {kFloorPlane}, {"fixed", 0.01});
    Model<double> model;
    State<double> start;
    BuildModel(scene, &model, &start);
    EXPECT_NEAR(model.parameters[model.structure->bodies[0].inertia], 2.0 * share, 1e-14);
  }
}

TEST(ConcavePolygonTest, AConvexPolygonHasNoOutline) {
  const auto model_of = [](const std::vector<double>& vertices) {
    Model<double> model;
    State<double> start;
    BuildModel(Meets(kDiscShape + std::string(R"("position": [0, 1])"), {ShapeText(vertices)},
                     {"fixed", 1.0}),
               &model, &start);
    return model;
  };
  EXPECT_EQ(model_of({-2, -1, 2, -1, 2, 0, -2, 0}).seams, nullptr);
  const Model<double> model = model_of(kArchTop);
  ASSERT_NE(model.OutlineOf(1), nullptr);
  EXPECT_EQ(model.OutlineOf(0), nullptr);
  EXPECT_EQ(model.OutlineOf(1)->num_runs(), 8);
}

// Across the notch under it, which no contact shows.
TEST(ConcavePolygonTest, RollsAndSlidesOverALevelEdgeAsOnAPlane) {
  const std::vector<std::pair<std::string, double>> bodies = {
      {std::string(kDiscShape) + R"("angular_velocity": 3)", 0.1},
      {ShapeText(R"("box": {"size": [0.3, 0.2]})"), 0.1},
      {ShapeText(R"("capsule": {"length": 0.4, "radius": 0.1})"), 0.1},
      {ShapeText(R"("ellipse": {"radii": [0.15, 0.1]})"), 0.1},
      {ShapeText(R"("polygon": {"vertices": [[-0.2, -0.1], [0.2, -0.1], [0, 0.2]]})"), 0.1},
      {R"("inertia": 0.02, "contact_points": [[-0.1, -0.1], [0.1, -0.1]])", 0.1},
      {ShapeText(kStaple), 0.35}};
  for (const auto& [body, height] : bodies) {
    for (const char* stepping : {"fixed", "event"}) {
      SCOPED_TRACE(body + " " + stepping);
      const std::string start =
          body + R"(, "position": [-0.8, )" + Text(height) + R"(], "velocity": [2, 0])";
      const ConcaveLaw law{stepping, 0.8, 0.1};
      const RolledConcave plane = RollConcave(Meets(start, {kFloorPlane}, law));
      const RolledConcave arch = RollConcave(Meets(start, {ShapeText(kArchTop)}, law));
      EXPECT_GT(arch.final.pose[0], 0.3);
      EXPECT_EQ(plane.report.events, arch.report.events);
      ExpectNear(plane.final, arch.final, stepping[0] == 'f' ? 1e-9 : 1e-11);
    }
  }
}

// Both edges turn by 45°: the centre is √2 r above the corner.
TEST(ConcavePolygonTest, ADiscRestsInANotchOnBothEdges) {
  for (const char* stepping : {"fixed", "event"}) {
    for (const double friction : {0.0, 0.4}) {
      SCOPED_TRACE(stepping + std::string(" ") + Text(friction));
      const RolledConcave run = RollConcave(
          Meets(kDiscShape + std::string(R"("position": [0.02, 0.6], "angular_damping": 0.1)"),
                {ShapeText(kNotch)}, {stepping, 3.0, friction}));
      EXPECT_NEAR(run.final.pose[0], 0.0, 1e-6);
      EXPECT_NEAR(run.final.pose[1], 0.1 * std::sqrt(2.0), 1e-6);
    }
  }
}

// The notch of an L that is turned by 0.3: a box slides down the one face until it meets the other.
TEST(ConcavePolygonTest, ABoxRestsOnBothFacesOfANotch) {
  const std::vector<double> corner = {-0.5, -0.5, 2, -0.5, 2, 0, 0, 0, 0, 1.5, -0.5, 1.5};
  const double c = std::cos(0.3), s = std::sin(0.3);
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    const RolledConcave run = RollConcave(
        Meets(ShapeText(R"("box": {"size": [0.4, 0.3]})") + R"(, "angle": 0.3, "position": [)" +
                  Text(0.6 * c - 0.15 * s) + ", " + Text(0.6 * s + 0.15 * c) + "]",
              {ShapeText(corner) + R"(, "angle": 0.3)"}, {stepping, 2.0, 0.1}));
    EXPECT_NEAR(run.final.pose[0], 0.2 * c - 0.15 * s, 1e-7);
    EXPECT_NEAR(run.final.pose[1], 0.2 * s + 0.15 * c, 1e-7);
    EXPECT_NEAR(run.final.pose[2], 0.3, 1e-7);
  }
}

// An L falls onto the ends of its legs: its centroid comes to rest 4 / (3 √2) m above the floor,
// whether that is a half-plane, a box or a concave polygon.
TEST(ConcavePolygonTest, AnAngleRestsOnTheTwoEndsOfItsLegs) {
  const double angle = -0.75 * 3.14159265358979323846;
  for (const std::string& floor :
       {std::string(kFloorPlane),
        ShapeText(R"("box": {"size": [20, 1]})") + R"(, "position": [0, -0.5])",
        ShapeText(kArchTop)}) {
    for (const char* stepping : {"fixed", "event"}) {
      SCOPED_TRACE(floor + " " + stepping);
      const RolledConcave run = RollConcave(
          Meets(ShapeText(kAngle) + R"(, "position": [0, 1.1], "angle": )" + Text(angle + 0.1),
                {floor}, {stepping, 3.0, 0.5}));
      EXPECT_NEAR(run.final.pose[1], 4.0 / 3.0 / std::sqrt(2.0), 1e-7);
      EXPECT_NEAR(run.final.pose[2], angle, 1e-7);
      EXPECT_NEAR(run.final.twist[2], 0.0, 1e-6);
    }
  }
}

// A staple falls over a post and hangs on it; a push moves it until its leg meets the post's side.
TEST(ConcavePolygonTest, AStapleHangsOnAPost) {
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    Scene scene = Meets(ShapeText(kStaple) + R"(, "position": [0.02, 0.0], "angle": 0.05)",
                        {ShapeText(kPost)}, {stepping, 2.0, 0.3});
    const RolledConcave hangs = RollConcave(scene);
    EXPECT_NEAR(hangs.final.pose[1], -0.15, 1e-7);
    EXPECT_NEAR(hangs.final.pose[2], 0.0, 1e-7);
    EXPECT_LT(std::abs(hangs.final.pose[0]), 0.05);
    scene.forces.emplace_back();
    scene.forces[0].name = "push";
    scene.forces[0].body = 0;
    scene.forces[0].force = Vector2<double>(8.0, 0.0);
    const RolledConcave pushed = RollConcave(scene);
    EXPECT_NEAR(pushed.final.pose[0], 0.05, 1e-6);
    EXPECT_NEAR(pushed.final.pose[1], -0.15, 1e-6);
  }
}

// Two moving bodies: the hook of one carries that of the other, which hangs from the world.
TEST(ConcavePolygonTest, AHookCarriesAnother) {
  // A shank with an arm that turns up at its end; the other one is the same, upside down.
  const std::vector<double> hook = {-0.3, -0.4,  0.4,   -0.4,  0.4,   -0.1, 0.25, -0.1,
                                    0.25, -0.25, -0.15, -0.25, -0.15, 0.6,  -0.3, 0.6};
  std::vector<double> other;
  for (size_t i = 0; i < hook.size(); ++i) other.push_back(-hook[i]);
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    const std::string text =
        R"({"bodies": [{"name": "upper", "mass": 1, "inertia": 0.1, "position": [0, 0],
          "friction": 0.5, "shape": {)" +
        PolygonText(hook) +
        R"(}}, {"name": "lower", "mass": 1, "inertia": 0.1, "position": [0.28, -0.3],
          "friction": 0.5, "shape": {)" +
        PolygonText(other) +
        R"(}}], "joints": [{"name": "j", "type": "weld", "bodies": ["upper", "world"],
          "anchor": [-0.2, 0.5]}, {"name": "k", "type": "prismatic", "bodies": ["lower", "world"],
          "anchor": [0, 0], "axis": [0, 1]}],
          "simulation": {"stepping": ")" +
        stepping + R"(", "dt": 0.01, "duration": 1, "joint_correction": "projection"}})";
    const RolledConcave run = RollConcave(SceneOf(text));
    // Each end meets the other one's arm, which is 0.35 m away from it as drawn.
    EXPECT_NEAR(run.At(1).y(), -0.35, 1e-6);
    EXPECT_NEAR(run.At(0).y(), 0.0, 1e-6);
  }
}

// Steps of one outline and of two boxes side by side.
TEST(ConcavePolygonTest, AStepIsTheBoxesThatItConsistsOf) {
  const std::vector<double> step = {-2, -1, 2, -1, 2, 0, 0, 0, 0, 0.3, -2, 0.3};
  const std::vector<std::string> boxes = {
      ShapeText(R"("box": {"size": [2, 1.3]})") + R"(, "position": [-1, -0.35])",
      ShapeText(R"("box": {"size": [2, 1]})") + R"(, "position": [1, -0.5])"};
  for (const std::string& body :
       {std::string(kDiscShape) + R"("position": [-0.6, 0.5], "velocity": [1.5, 0])",
        ShapeText(R"("box": {"size": [0.3, 0.2]})") +
            R"(, "position": [-0.6, 0.5], "velocity": [2, 0], "angle": 0.2)",
        std::string(kDiscShape) + R"("position": [0.9, 0.3], "velocity": [-3, 0])"}) {
    for (const char* stepping : {"fixed", "event"}) {
      SCOPED_TRACE(body + " " + stepping);
      const ConcaveLaw law{stepping, 0.6, 0.3, 0.3};
      ExpectNear(RollConcave(Meets(body, boxes, law)).final,
                 RollConcave(Meets(body, {ShapeText(step)}, law)).final, 1e-8);
    }
  }
}

// What begins deep in the solid leaves it by the nearest edge, beside a notch and in a thin bar.
TEST(ConcavePolygonTest, WhatIsDeepIsPushedOutThroughTheNearestEdge) {
  const std::vector<double> corner = {0, 0, 3, 0, 3, 1, 1, 1, 1, 3, 0, 3};
  struct Case {
    std::string body;
    double x, y;
  };
  const std::string disc = kDiscShape;
  const std::string box = ShapeText(R"("box": {"size": [0.3, 0.2]})") + ", ";
  for (const auto& [body, x, y] :
       {Case{disc + R"("position": [2, 0.8])", 2.0, 1.1},
        Case{disc + R"("position": [1.3, 0.7])", 1.3, 1.1},
        Case{box + R"("position": [2, 0.9])", 2.0, 1.1},
        Case{ShapeText(kStaple) + R"(, "position": [2, 1.2])", 2.0, 1.35}}) {
    SCOPED_TRACE(body);
    const RolledConcave run = RollConcave(Meets(body, {ShapeText(corner)}, {"fixed", 1.5}));
    EXPECT_NEAR(run.final.pose[0], x, 1e-6);
    EXPECT_NEAR(run.final.pose[1], y, 1e-6);
  }
  // A disc as large as the leg is thick, of which both sides are near.
  Scene wide = Meets(R"("shape": {"circle": {"radius": 0.6}}, "position": [2, 0.6])",
                     {ShapeText(corner)}, {"fixed", 2.0});
  EXPECT_NEAR(RollConcave(wide).final.pose[1], 1.6, 1e-6);
}

// A disc falls into a notch of edges of 45° and stays. Where the notch's corner rises by δ, both
// edges become flatter: the height is δ + r / cos φ, tan φ = 1 − δ.
TEST(ConcavePolygonTest, DerivativesOfARestingHeight) {
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    const Scene scene = Meets(kDiscShape + std::string(R"("position": [0, 0.3])"),
                              {ShapeText(kNotch)}, {stepping, 0.5});
    const std::vector<std::string> paths = {"bodies/ground/shape/vertices/4/y",
                                            "bodies/b/shape/radius"};
    const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.values[1], 0.1 * std::sqrt(2.0), 1e-9);
    EXPECT_NEAR(result.jacobian(1, 0), 1.0 - 0.1 / std::sqrt(2.0), 1e-9);
    EXPECT_NEAR(result.jacobian(1, 1), std::sqrt(2.0), 1e-9);
    testing::ExpectOthersAgree(scene, paths, result);
  }
}

// A staple falls onto a post and stays; both heights follow all the vertices of a shape.
TEST(ConcavePolygonTest, DerivativesOfAHangingHeight) {
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    const Scene scene = Meets(ShapeText(kStaple) + R"(, "inertia": 0.05, "position": [0, -0.1])",
                              {ShapeText(kPost)}, {stepping, 0.3});
    const std::vector<std::string> paths = {"bodies/ground/shape/vertices/*/y",
                                            "bodies/b/shape/vertices/*/y"};
    const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.values[1], -0.15, 1e-9);
    EXPECT_NEAR(result.jacobian(1, 0), 1.0, 1e-9);
    EXPECT_NEAR(result.jacobian(1, 1), -1.0, 1e-9);
    testing::ExpectOthersAgree(scene, paths, result);
  }
}

TEST(ConcavePolygonTest, DerivativesOfAllMethodsAgree) {
  const std::vector<double> valley = {-2, -1, 3, -1, 3, 1.6, 1, 0.2, 0, 0, -2, 1};
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    // A disc rebounds, passes a corner, and rolls on the next edge.
    ExpectAllAgree(Meets(kDiscShape + std::string(R"("position": [-1, 0.9], "velocity": [0.5, 0])"),
                         {ShapeText(valley)}, {stepping, 1.1, 0.3, 0.3}),
                   {"bodies/b/position/x", "bodies/b/shape/radius",
                    "bodies/ground/shape/vertices/3/y", "bodies/ground/shape/vertices/4/x",
                    "bodies/ground/shape/vertices/4/y", "bodies/ground/shape/vertices/5/y"});
    // An angle falls onto a leg's end and turns about it, on a plane.
    ExpectAllAgree(
        Meets(ShapeText(kAngle) + R"(, "inertia": 1.2, "position": [0, 1.3], "angle": -2)",
              {kFloorPlane}, {stepping, 0.45, 0.3, 0.2, 0.005}),
        {"bodies/b/shape/vertices/2/x", "bodies/b/shape/vertices/2/y", "bodies/b/position/y",
         "bodies/b/inertia"});
    // A staple falls askew onto a post: corners of both meet edges of the other.
    ExpectAllAgree(
        Meets(ShapeText(kStaple) + R"(, "inertia": 0.06, "position": [0.02, 0.05], "angle": 0.08)",
              {ShapeText(kPost)}, {stepping, 0.24, 0.3, 0.3, 0.005}),
        {"bodies/b/shape/vertices/2/y", "bodies/b/shape/vertices/3/y",
         "bodies/ground/shape/vertices/5/x", "bodies/ground/shape/vertices/5/y", "bodies/b/angle"});
  }
}

// What stands on a box from the start on has nothing to do, by events either: its corners are in
// line with the box's top, which the box's own corners far away are as well.
TEST(ConcavePolygonTest, RestsOnABoxWithoutAnEvent) {
  const std::vector<double> trough = {-0.156, -0.147, 0.156, -0.147, 0.156, 0.146, 0.07,   0.146,
                                      0.07,   -0.043, -0.07, -0.043, -0.07, 0.146, -0.156, 0.146};
  for (const char* stepping : {"fixed", "event"}) {
    for (const double speed : {0.0, 1.3}) {
      SCOPED_TRACE(stepping + std::string(" ") + Text(speed));
      const RolledConcave run = RollConcave(
          Meets(ShapeText(trough) + R"(, "inertia": 0.02, "position": [0, 0.147], "velocity": [)" +
                    Text(speed) + ", 0]",
                {ShapeText(R"("box": {"size": [20, 0.5]})") + R"(, "position": [0, -0.25])"},
                {stepping, 0.2, 0.3}));
      EXPECT_EQ(run.report.events, 0);
      EXPECT_NEAR(run.final.pose[1], 0.147, 1e-11);
      EXPECT_NEAR(run.final.pose[2], 0.0, 1e-11);
    }
  }
}

// Two angles meet in flight, without gravity: a leg's end of one in the notch of the other.
TEST(ConcavePolygonTest, TwoMovingOnesKeepTheirMomentum) {
  for (const char* stepping : {"fixed", "event"}) {
    SCOPED_TRACE(stepping);
    const std::string polygon = PolygonText(kAngle);
    const Scene scene = SceneOf(
        R"({"gravity": [0, 0], "bodies": [
          {"name": "a", "mass": 2, "inertia": 1.2, "position": [0, 0], "velocity": [0.5, 0],
           "angular_velocity": 0.2, "friction": 0.3, "restitution": 0.6, "shape": {)" +
        polygon + R"(}}, {"name": "c", "mass": 1, "inertia": 0.7, "position": [1.7, 1.9],
           "angle": 2.9, "velocity": [-1, -1.2], "angular_velocity": 0.4, "friction": 0.3,
           "restitution": 0.6, "shape": {)" +
        polygon + R"(}}], "simulation": {"dt": 0.01, "duration": 1.2, "stepping": ")" + stepping +
        R"("}})");
    const RolledConcave run = RollConcave(scene);
    const std::vector<double>& v = run.final.twist;
    EXPECT_GT(std::hypot(v[3] + 1.0, v[4] + 1.2), 0.5);
    EXPECT_NEAR(2.0 * v[0] + v[3], 0.0, 1e-12);
    EXPECT_NEAR(2.0 * v[1] + v[4], -1.2, 1e-12);
    const double spin = 2.0 * (run.At(0).x() * v[1] - run.At(0).y() * v[0]) + 1.2 * v[2] +
                        run.At(1).x() * v[4] - run.At(1).y() * v[3] + 0.7 * v[5];
    EXPECT_NEAR(spin, 1.2 * 0.2 + 1.7 * -1.2 + 1.9 + 0.7 * 0.4, 1e-9);
    ExpectAllAgree(scene, {"bodies/a/shape/vertices/2/y", "bodies/a/shape/vertices/4/y",
                           "bodies/c/shape/vertices/2/x", "bodies/c/angle", "bodies/a/position/x"});
  }
}

// Thin bars and spikes: however long a step is, a body that flies at a corner strikes it where it
// does with short steps.
TEST(ConcavePolygonsTest, LongStepsMissNoCorner) {
  struct Throw {
    std::vector<double> outline;
    const char* shape;
    double x, y, vx, vy, turn, duration;
  };
  const std::vector<double> bar = {0, 0, 2, 0, 2, 0.3, 0.3, 0.3, 0.3, 2, 0, 2};
  const std::vector<double> thin = {0, 0, 2, 0, 2, 0.05, 0.05, 0.05, 0.05, 2, 0, 2};
  const std::vector<double> spike = {0, 0, 2, 0, 2, 1, 1.05, 1, 1, 2, 0.95, 1, 0, 1};
  const std::vector<double> notch = {0, 0, 2, 0, 2, 2, 1.1, 1, 1, 0.5, 0.9, 1, 0, 2};
  const char* disc = R"("circle": {"radius": 0.1})";
  const char* capsule = R"("capsule": {"length": 0.2, "radius": 0.05})";
  const std::vector<Throw> throws = {
      {bar, disc, -1.1935, 2.1605, 19.7436, -3.1924, 0.0, 0.1},
      {thin, capsule, -0.2487, 3.47, 1.9912, -9.7998, 0.0, 0.2},
      {spike, capsule, -0.4507, 0.9795, 19.9779, 0.9393, 0.0, 0.1},
      {notch, capsule, -1.2728, 1.2063, 4.2428, 2.6455, 0.0, 0.4},
      {thin, capsule, -1.3968, -0.3559, 18.8986, 6.5455, -20.0, 0.1},
  };
  for (const Throw& one : throws) {
    const double duration = one.duration;
    Scene scene = SceneOf(
        R"({"gravity": [0, 0], "bodies": [{"name": "s", "static": true, "restitution": 0.5,
            "friction": 0, "shape": {)" +
        PolygonText(one.outline) + R"(}}, {"name": "b", "mass": 1, "restitution": 0.5,
            "friction": 0, "position": [0, 0], "shape": {)" +
        one.shape + R"(}}], "simulation": {"stepping": "event"}})");
    scene.simulation.duration = duration;
    BasicBody<double>& body = scene.bodies[1];
    body.position = Vector2<double>(one.x, one.y);
    body.velocity = Vector2<double>(one.vx, one.vy);
    body.angular_velocity = one.turn;
    scene.simulation.dt = duration / 1000.0;
    const RolledConcave fine = RollConcave(scene);
    EXPECT_GT(fine.report.events, 0);
    for (const double steps : {1.0, 2.0, 4.0, 10.0, 40.0}) {
      if (one.turn != 0.0 && steps < 10.0) continue;
      scene.simulation.dt = duration / steps;
      const RolledConcave run = RollConcave(scene);
      for (size_t i = 0; i < run.final.pose.size(); ++i) {
        EXPECT_NEAR(run.final.pose[i], fine.final.pose[i], 1e-9) << one.shape << " " << steps;
      }
    }
  }
}

}  // namespace
}  // namespace tangible
