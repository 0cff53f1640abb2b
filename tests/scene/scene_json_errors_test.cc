// SPDX-License-Identifier: Apache-2.0
//
// Bad scenes, each a good one with one change, and the one line that each gives.

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "scene_texts.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

// Instead of a value: takes the key away.
constexpr char kRemove[] = "";

struct BadScene {
  std::string pointer;  // what is changed ...
  std::string value;    // ... to this JSON
  std::string message;  // after "bad.json: "
};

std::string ErrorIn(const char* good, const BadScene& bad) {
  Json json = Json::parse(good);
  if (bad.value == kRemove) {
    json = json.patch(Json::array({{{"op", "remove"}, {"path", bad.pointer}}}));
  } else {
    json[Json::json_pointer(bad.pointer)] = Json::parse(bad.value);
  }
  Scene scene;
  std::string error;
  EXPECT_FALSE(ParseScene(json.dump(), "bad.json", ::testing::TempDir(), &scene, &error))
      << bad.pointer << " " << bad.value;
  return error;
}

std::string ErrorOf(const std::string& pointer, const std::string& value) {
  return ErrorIn(kFullScene, {pointer, value, ""});
}

void Check(const std::vector<BadScene>& cases) {
  for (const BadScene& c : cases) {
    const std::string error = ErrorOf(c.pointer, c.value);
    EXPECT_EQ(error, "bad.json: " + c.message);
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
}

const char kBodies[] = "bodies are ball, rod, hull, floor, paddle, mass";

TEST(BadSceneTest, Document) {
  Check({
      {"", "[]", "expected an object, got an array of 0"},
      {"/colour", "1",
       "/colour: unknown key of a scene, expected one of name, gravity, bodies, joints, springs, "
       "forces, pairs, no_contact, simulation, got \"colour\""},
      {"/name", "1", "/name: expected a string, got 1"},
      {"/gravity", "9.81", "/gravity: expected an array of 2 numbers [x, y], got 9.81"},
      {"/gravity/1", "null", "/gravity/1: expected a number, got null"},
      {"/bodies", kRemove, "/bodies: missing, expected an array of bodies"},
      {"/bodies", "{}", "/bodies: expected an array of bodies, got an object"},
      {"/joints", "true", "/joints: expected an array of joints, got true"},
  });
}

TEST(BadSceneTest, Bodies) {
  Check({
      {"/bodies/0", "[]", "/bodies/0: expected an object, got an array of 0"},
      {"/bodies/3/masss", "1",
       "/bodies/3/masss: unknown key of a body, expected one of name, static, kinematic, shape, "
       "contact_points, mass, inertia, position, angle, motion, velocity, angular_velocity, "
       "friction, "
       "restitution, "
       "linear_damping, angular_damping, quadratic_drag, kinetic_friction, stribeck_speed, "
       "rolling_friction, support, got \"masss\""},
      {"/bodies/0/kinetic_friction", "0.1",
       "/bodies/0/stribeck_speed: missing, expected a number > 0"},
      {"/bodies/0/rolling_friction", "-1",
       "/bodies/0/rolling_friction: expected a number >= 0, got -1"},
      {"/bodies/0/stribeck_speed", "0.1",
       "/bodies/0/kinetic_friction: missing, expected a number >= 0 with stribeck_speed"},
      {"/bodies/0/mass", "-1", "/bodies/0/mass: expected a number > 0, got -1"},
      {"/bodies/0/mass", "0", "/bodies/0/mass: expected a number > 0, got 0"},
      {"/bodies/0/mass", "\"1\"", "/bodies/0/mass: expected a number > 0, got \"1\""},
      {"/bodies/0/mass", kRemove, "/bodies/0/mass: missing, expected a number > 0"},
      {"/bodies/0/inertia", "0", "/bodies/0/inertia: expected a number > 0, got 0"},
      {"/bodies/5/inertia", kRemove,
       "/bodies/5/inertia: missing, expected a number > 0 for a body without a shape"},
      {"/bodies/2/shape/polygon/vertices/0/0", "-1.5",
       "/bodies/2/inertia: missing, expected a number > 0 for a polygon whose centroid is not the "
       "origin"},
      {"/bodies/0/position", kRemove,
       "/bodies/0/position: missing, expected an array of 2 numbers [x, y]"},
      {"/bodies/0/angle", "[0]", "/bodies/0/angle: expected a number, got an array of 1"},
      {"/bodies/0/friction", "-0.1", "/bodies/0/friction: expected a number >= 0, got -0.1"},
      {"/bodies/0/restitution", "1.5",
       "/bodies/0/restitution: expected a number in [0, 1], got 1.5"},
      {"/bodies/0/restitution", "-0.5",
       "/bodies/0/restitution: expected a number in [0, 1], got -0.5"},
      {"/bodies/0/linear_damping", "-1",
       "/bodies/0/linear_damping: expected a number >= 0, got -1"},
      {"/bodies/0/quadratic_drag", "-1",
       "/bodies/0/quadratic_drag: expected a number >= 0, got -1"},
      {"/joints/0/friction", "-2", "/joints/0/friction: expected a number >= 0, got -2"},
      {"/joints/0/kinetic_friction", "1",
       "/joints/0/friction: missing, expected a number >= 0 with kinetic_friction"},
      {"/joints/0/stribeck_speed", "1",
       "/joints/0/kinetic_friction: missing, expected a number >= 0 with stribeck_speed"},
      {"/joints/0/stiffness", "-2", "/joints/0/stiffness: expected a number >= 0, got -2"},
      {"/joints/0/rest_angle", "0.1",
       "/joints/0/stiffness: missing, expected a number >= 0 with rest_angle"},
      {"/bodies/0/angular_damping", "-1",
       "/bodies/0/angular_damping: expected a number >= 0, got -1"},
      {"/bodies/3/static", "1", "/bodies/3/static: expected true or false, got 1"},
      {"/bodies/3/kinematic", "true",
       "/bodies/3/kinematic: expected a body that is static or kinematic, got both"},
      {"/bodies/3/velocity", "[1, 0]",
       "/bodies/3/velocity: expected [0, 0] of a static body, got a velocity (kinematic moves)"},
      {"/bodies/3/angular_velocity", "1",
       "/bodies/3/angular_velocity: expected 0 of a static body (kinematic moves), got 1"},
  });
}

TEST(BadSceneTest, Names) {
  Check({
      {"/bodies/0/name", kRemove, "/bodies/0/name: missing, expected a string"},
      {"/bodies/0/name", "\"\"",
       "/bodies/0/name: expected a name of letters, digits, _ . -, got \"\""},
      {"/bodies/0/name", "\"a b\"",
       "/bodies/0/name: expected a name of letters, digits, _ . -, got \"a b\""},
      {"/bodies/0/name", "\"a/b\"",
       "/bodies/0/name: expected a name of letters, digits, _ . -, got \"a/b\""},
      {"/bodies/0/name", "\"b*\"",
       "/bodies/0/name: expected a name of letters, digits, _ . -, got \"b*\""},
      {"/bodies/0/name", "\"a\\nb\"",
       "/bodies/0/name: expected a name of letters, digits, _ . -, got \"a\\nb\""},
      {"/bodies/0/name", "\"world\"",
       "/bodies/0/name: expected another name, got \"world\", which is reserved"},
      {"/bodies/1/name", "\"ball\"",
       "/bodies/1/name: expected a name of its own, got \"ball\" a second time"},
      {"/joints/1/name", "\"hinge\"",
       "/joints/1/name: expected a name of its own, got \"hinge\" a second time"},
      {"/springs/1/name", "\"s\"",
       "/springs/1/name: expected a name of its own, got \"s\" a second time"},
      {"/forces/1/name", "\"push\"",
       "/forces/1/name: expected a name of its own, got \"push\" a second time"},
  });
}

TEST(BadSceneTest, Shapes) {
  const std::string shape = "/bodies/0/shape";
  Check({
      {shape, "\"circle\"", shape + ": expected an object, got \"circle\""},
      {shape, "{}",
       shape + ": expected one of circle, ellipse, box, capsule, polygon, half_plane, polyline, "
               "spline, got 0 of them"},
      {shape, R"({"circle": {"radius": 1}, "box": {"size": [1, 1]}})",
       shape + ": expected one of circle, ellipse, box, capsule, polygon, half_plane, polyline, "
               "spline, got 2 of them"},
      {shape, R"({"polyline": {"points": [[0, 0]]}})",
       shape + "/polyline/points: expected an array of at least 2 points, got an array of 1"},
      {shape, R"({"polyline": {"points": [[0, 0], [1, 0], [1, 0]]}})",
       shape + "/polyline/points/2: expected another point than the one before, got the same"},
      {shape, R"({"polyline": {"points": [[0, 0], [1, 0], [1, 1], [0, 0]]}})",
       shape + "/polyline/points/3: expected another point than the first, or \"closed\": true "
               "without this one"},
      {shape, R"({"polyline": {"points": [[0, 0], [1, 0], [0.5, 0]]}})",
       shape + "/polyline/points/1: expected a corner that does not turn back by 180 degrees"},
      {shape, R"({"polyline": {"points": [[0, 0], [2, 0], [2, 1], [1, -1]]}})",
       shape + "/polyline/points: expected an outline that does not cross or touch itself, got the "
               "edge of vertices 0 and 1 that meets the edge of vertices 2 and 3"},
      {shape, R"({"polyline": {"points": [[0, 0], [1, 0]], "closed": true}})",
       shape + "/polyline/points: expected at least 3 points, got 2"},
      {shape, R"({"polyline": {"points": [[0, 0], [1, 0]], "solid": "up"}})",
       shape + "/polyline/solid: expected one of left, right, got \"up\""},
      {shape, R"({"polyline": {"points": [[0, 0], [1, 0]]}})",
       shape + "/polyline: expected a static or kinematic body, got a moving one"},
      {shape, R"({"spline": {"points": [[0, 0]]}})",
       shape + "/spline/points: expected an array of at least 2 points, got an array of 1"},
      {shape, R"({"spline": {"points": [[0, 0], [1, 0], [1, 0]]}})",
       shape + "/spline/points/2: expected another point than the one before, got the same"},
      {shape, R"({"spline": {"points": [[0, 0], [1, 0], [1, 1], [0, 0]]}})",
       shape + "/spline/points/3: expected another point than the first, or \"closed\": true "
               "without this one"},
      {shape, R"({"spline": {"points": [[0, 0], [1, 0], [0.5, 0]]}})",
       shape + "/spline/points/1: expected a corner that does not turn back by 180 degrees"},
      {shape, R"({"spline": {"points": [[0, 0], [2, 0], [2, 1], [1, -1]]}})",
       shape + "/spline/points: expected a curve that does not cross or touch itself, got the "
               "piece of points 0 and 1 that meets the piece of points 2 and 3"},
      {shape, R"({"spline": {"points": [[0, 0], [1, 0]], "closed": true}})",
       shape + "/spline/points: expected at least 3 points, got 2"},
      {shape, R"({"spline": {"points": [[0, 0], [1, 0]], "solid": "up"}})",
       shape + "/spline/solid: expected one of left, right, got \"up\""},
      {shape, R"({"spline": {"points": [[0, 0], [1, 0]], "vertices": 1}})",
       shape + "/spline/vertices: unknown key of a spline, expected one of points, closed, solid, "
               "got \"vertices\""},
      {shape, R"({"spline": {"points": [[0, 0], [1, 0]]}})",
       shape + "/spline: expected a static or kinematic body, got a moving one"},
      {shape, R"({"disc": {}})",
       shape +
           "/disc: unknown key of a shape, expected one of circle, ellipse, box, capsule, polygon, "
           "half_plane, polyline, spline, got \"disc\""},
      {shape, R"({"circle": {"radius": 0}})",
       shape + "/circle/radius: expected a number > 0, got 0"},
      {shape, R"({"circle": {"radius": 1, "size": 1}})",
       shape + "/circle/size: unknown key of a circle, expected one of radius, got \"size\""},
      {shape, R"({"circle": {}})", shape + "/circle/radius: missing, expected a number > 0"},
      {shape, R"({"box": {"size": [1, -1]}})",
       shape + "/box/size/1: expected a number > 0, got -1"},
      {shape, R"({"box": {"size": 1}})",
       shape + "/box/size: expected an array of 2 numbers > 0 [width, height], got 1"},
      {shape, R"({"ellipse": {"radii": [1, 0]}})",
       shape + "/ellipse/radii/1: expected a number > 0, got 0"},
      {shape, R"({"ellipse": {"radii": 1}})",
       shape + "/ellipse/radii: expected an array of 2 numbers > 0, the semi-axes along x and y, "
               "got 1"},
      {shape, R"({"ellipse": {"radii": [1, 1e-10]}})",
       shape + "/ellipse/radii: expected two radii of a ratio of at most 1e9, got 1.0 and 1e-10"},
      {shape, R"({"ellipse": {"radius": 1}})",
       shape + "/ellipse/radius: unknown key of an ellipse, expected one of radii, got \"radius\""},
      {"/bodies/0/contact_points", "3",
       "/bodies/0/contact_points: expected an array of points [x, y], got 3"},
      {"/bodies/0/contact_points", "[[0, 1], [0]]",
       "/bodies/0/contact_points/1: expected an array of 2 numbers [x, y], got an array of 1"},
      {shape, R"({"capsule": {"length": 0, "radius": 1}})",
       shape + "/capsule/length: expected a number > 0, got 0"},
      {shape, R"({"capsule": {"length": 1, "radius": -1}})",
       shape + "/capsule/radius: expected a number > 0, got -1"},
      {shape, R"({"polygon": {"vertices": [[0, 0], [1, 0]]}})",
       shape + "/polygon/vertices: expected an array of at least 3 points, got an array of 2"},
      {shape, R"({"polygon": {"vertices": [[0, 0], [0, 1], [1, 0]]}})",
       shape + "/polygon/vertices: expected counter-clockwise vertices, got clockwise ones"},
      {shape, R"({"polygon": {"vertices": [[0, 0], [2, 0], [0.5, 0.5], [0, 2], [0.2, -1]]}})",
       shape +
           "/polygon/vertices: expected an outline that does not cross or touch itself, got the "
           "edge of vertices 0 and 1 that meets the edge of vertices 3 and 4"},
      {shape, R"({"half_plane": {"normal": [0, 1], "offset": 0}})",
       shape + "/half_plane: expected a static or kinematic body, got a moving one"},
      {"/bodies/3/shape/half_plane/normal", "[0, 0]",
       "/bodies/3/shape/half_plane/normal: expected a direction, got the zero vector"},
      {"/bodies/3/shape/half_plane/normal", kRemove,
       "/bodies/3/shape/half_plane/normal: missing, expected an array of 2 numbers [x, y]"},
  });
}

constexpr char kGears[] = R"({"bodies": [
    {"name": "a", "mass": 1, "inertia": 1, "position": [0, 0]},
    {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0]},
    {"name": "c", "mass": 1, "inertia": 1, "position": [0, 0]}],
  "joints": [
    {"name": "gear", "type": "coupling", "joints": ["p", "q"], "ratio": 2},
    {"name": "p", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0], "rate": 1},
    {"name": "q", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0], "rate": -0.5},
    {"name": "r", "type": "revolute", "bodies": ["c", "b"], "anchor": [0, 0]},
    {"name": "s", "type": "prismatic", "bodies": ["c", "b"], "anchor": [0, 0], "axis": [1, 0]},
    {"name": "w", "type": "fixed_angle", "bodies": ["c", "b"]},
    {"name": "d", "type": "distance", "bodies": ["c", "b"], "anchors": [[0, 0], [1, 0]]}]})";

TEST(BadSceneTest, Couplings) {
  Scene scene;
  std::string error;
  ASSERT_TRUE(ParseScene(kGears, "gears.json", ::testing::TempDir(), &scene, &error)) << error;
  EXPECT_EQ(scene.joints[0].coupled[0], 1);
  EXPECT_EQ(scene.joints[0].coupled[1], 2);
  EXPECT_EQ(scene.joints[0].ratio, 2.0);
  const std::vector<BadScene> cases = {
      {"/joints/0/joints", "[\"p\", \"p\"]",
       "/joints/0/joints: expected two different joints, got p twice"},
      {"/joints/0/joints", "[\"p\", \"gear\"]",
       "/joints/0/joints: expected revolute, prismatic or distance joints, got gear, which is none "
       "of these"},
      {"/joints/0/joints", "[\"p\", \"w\"]",
       "/joints/0/joints: expected revolute, prismatic or distance joints, got w, which is none of "
       "these"},
      {"/joints/0/joints", "[\"p\", \"d\"]",
       "/joints/0/joints: expected joints that move, got d, which keeps its distance ([0, null] as "
       "its limits leaves it free)"},
      {"/joints/0/joints", "[\"p\", \"z\"]",
       "/joints/0/joints/1: expected the name of a joint, got \"z\""},
      {"/joints/0/joints", "[\"p\"]",
       "/joints/0/joints: expected an array of 2 names of joints, got an array of 1"},
      {"/joints/0/joints", kRemove,
       "/joints/0/joints: missing, expected an array of 2 names of joints"},
      {"/joints/2/rate", "0.5",
       "/joints/0: expected initial rates with rate(p) + ratio * rate(q) = 0, got 2.0"},
      {"/joints/0/ratio", kRemove, "/joints/0/ratio: missing, expected a number"},
      {"/joints/0/bodies", "[\"a\", \"b\"]",
       "/joints/0/bodies: unknown key of a coupling joint, expected one of name, type, joints, "
       "contact, until, ratio, limits, limit_restitution, got \"bodies\""}};
  for (const BadScene& c : cases) EXPECT_EQ(ErrorIn(kGears, c), "bad.json: " + c.message);
  // A kept coupling may be of up to four bodies, one with limits of two.
  Json wide = Json::parse(kGears);
  wide["joints"][0]["joints"] = {"p", "r"};
  wide["joints"][1]["rate"] = 0.0;
  EXPECT_TRUE(ParseScene(wide.dump(), "wide.json", ::testing::TempDir(), &scene, &error)) << error;
  wide["joints"][0]["limits"] = {-0.1, 0.1};
  EXPECT_FALSE(ParseScene(wide.dump(), "wide.json", ::testing::TempDir(), &scene, &error));
  EXPECT_EQ(
      error,
      "wide.json: /joints/0/joints: expected joints of at most two moving bodies in all under "
      "a coupling with limits, got 3");
  // Play leaves the rates free.
  Json play = Json::parse(kGears);
  play["joints"][2]["rate"] = 3.0;
  play["joints"][0]["limits"] = {-0.1, 0.1};
  EXPECT_TRUE(ParseScene(play.dump(), "play.json", ::testing::TempDir(), &scene, &error)) << error;
}

TEST(BadSceneTest, Joints) {
  Check({
      {"/joints/0/bodies/0", "\"bal\"",
       "/joints/0/bodies/0: expected the name of a body (" + std::string(kBodies) +
           "), got \"bal\""},
      {"/joints/0/bodies", "[\"ball\"]",
       "/joints/0/bodies: expected an array of 2 names of bodies or world, got an array of 1"},
      {"/joints/0/bodies/1", "\"ball\"",
       "/joints/0/bodies: expected two different bodies, got \"ball\" twice"},
      {"/joints/0/bodies", "[\"world\", \"world\"]",
       "/joints/0/bodies: expected two different bodies, got \"world\" twice"},
      {"/joints/0/bodies/0", "\"paddle\"",
       "/joints/0/bodies: expected at least one moving body, got two that are static, kinematic or "
       "world"},
      {"/joints/0/type", "\"hinge\"",
       "/joints/0/type: expected one of revolute, prismatic, weld, distance, fixed_angle, "
       "coupling, "
       "got \"hinge\""},
      {"/joints/0/type", kRemove,
       "/joints/0/type: missing, expected one of revolute, prismatic, weld, distance, fixed_angle, "
       "coupling"},
      {"/joints/0/displacement", "0",
       "/joints/0/displacement: unknown key of a revolute joint, expected one of name, type, "
       "bodies, contact, until, anchor, angle, rate, damping, limits, limit_restitution, friction, "
       "kinetic_friction, stribeck_speed, motor, stiffness, rest_angle, effort, got "
       "\"displacement\""},
      {"/joints/1/angle", "0",
       "/joints/1/angle: unknown key of a prismatic joint, expected one of name, type, bodies, "
       "contact, until, anchor, axis, displacement, rate, damping, limits, limit_restitution, "
       "friction, "
       "kinetic_friction, stribeck_speed, motor, stiffness, rest_displacement, effort, got "
       "\"angle\""},
      {"/joints/2/damping", "0",
       "/joints/2/damping: unknown key of a weld joint, expected one of name, type, bodies, "
       "contact, until, anchor, got \"damping\""},
      {"/joints/3/anchor", "[0, 0]",
       "/joints/3/anchor: unknown key of a distance joint, expected one of name, type, bodies, "
       "contact, until, anchors, limits, limit_restitution, got \"anchor\""},
      {"/joints/4/anchor", "[0, 0]",
       "/joints/4/anchor: unknown key of a fixed_angle joint, expected one of name, type, bodies, "
       "contact, until, got \"anchor\""},
      {"/joints/0/anchor", kRemove,
       "/joints/0/anchor: missing, expected an array of 2 numbers [x, y]"},
      {"/joints/1/axis", "[0, 0]", "/joints/1/axis: expected a direction, got the zero vector"},
      {"/joints/1/axis", kRemove, "/joints/1/axis: missing, expected an array of 2 numbers [x, y]"},
      {"/joints/3/anchors", "[[1, 1], [1, 1]]",
       "/joints/3/anchors: expected two points apart, got a distance of 0"},
      {"/joints/0/limits", "[1, -1]",
       "/joints/0/limits: expected [low, high] with low <= high, got [1.0, -1.0]"},
      {"/joints/0/limits", "[1]",
       "/joints/0/limits: expected an array of 2 numbers [low, high], got an array of 1"},
      {"/joints/0/limits", "[null, null]",
       "/joints/0/limits: expected a number at one side at least, got [null, null]"},
      {"/joints/0/limits", kRemove,
       "/joints/0/limits: missing, expected [low, high] with limit_restitution"},
      {"/joints/0/limit_restitution", "1.5",
       "/joints/0/limit_restitution: expected a number in [0, 1], got 1.5"},
      {"/joints/0/motor", "3", "/joints/0/motor: expected an object, got 3"},
      {"/joints/0/motor/limit", "-1", "/joints/0/motor/limit: expected a number >= 0, got -1"},
      {"/joints/0/motor/limit", kRemove, "/joints/0/motor/limit: missing, expected a number >= 0"},
      {"/joints/0/motor/torque", "1",
       "/joints/0/motor/torque: unknown key of a motor, expected one of speed, limit, got "
       "\"torque\""},
      {"/joints/3/limits", "[0, 0]",
       "/joints/3/limits/1: expected a number > 0 (a revolute joint holds points together), got 0"},
      {"/joints/3/limits", "[-1, 20]", "/joints/3/limits/0: expected a number >= 0, got -1"},
      {"/joints/0/damping", "-1", "/joints/0/damping: expected a number >= 0, got -1"},
      {"/joints/0/contact", "0", "/joints/0/contact: expected true or false, got 0"},
      {"/joints/0/effort", "[1]",
       "/joints/0/effort: expected a number, {\"file\": ...} or {\"target\": ...}, got an array of "
       "1"},
  });
}

TEST(BadSceneTest, FrictionThatGrowsWithTheSpeed) {
  Scene scene;
  std::string error;
  ParseScene(
      R"({"bodies": [{"name": "m", "mass": 1, "inertia": 1, "position": [0, 0], "friction": 0.2,
      "kinetic_friction": 0.3, "stribeck_speed": 1}]})",
      "bad.json", ::testing::TempDir(), &scene, &error);
  EXPECT_EQ(error,
            "bad.json: /bodies/0/kinetic_friction: expected a number <= friction, which is 0.2, "
            "got 0.3");
}

// Ropes are measured where no joint starts turned.
TEST(BadSceneTest, ARopeThatStartsBeyondItsLimits) {
  const auto error_of = [](const std::string& limits) {
    Scene scene;
    std::string error;
    ParseScene(R"({"bodies": [{"name": "m", "mass": 1, "inertia": 1, "position": [3, 4]}],
        "joints": [{"name": "r", "type": "distance", "bodies": ["m", "world"],
        "anchors": [[3, 4], [0, 0]], "limits": )" +
                   limits + "}]}",
               "bad.json", ::testing::TempDir(), &scene, &error);
    return error;
  };
  const std::string beyond =
      "bad.json: /joints/0/anchors: expected points whose distance is within the limits, got 5.0";
  EXPECT_EQ(error_of("[0, 4.9]"), beyond);
  EXPECT_EQ(error_of("[5.1, null]"), beyond);
  EXPECT_EQ(error_of("[0, 4.999999999]"), "");  // taut, to rounding
  EXPECT_EQ(error_of("[5, 5]"), "");
}

TEST(BadSceneTest, InitialAnglesThatNothingCanTurn) {
  const std::string fixed =
      "expected 0 of a joint whose bodies[0] side is attached to the world or to a static or "
      "kinematic body (swap the two bodies), got ";
  const std::string loop =
      "expected 0 of a joint in a closed loop (write the bodies' poses and twists), got ";
  Check({
      {"/joints/0/bodies", R"(["world", "ball"])", "/joints/0/angle: " + fixed + "0.1"},
      {"/joints/1/bodies", R"(["ball", "rod"])", "/joints/1/displacement: " + fixed + "0.6"},
      // hull and rod are welded, so this closes a loop over the slider, the hinge and the floor.
      {"/joints/3/bodies", R"(["hull", "floor"])", "/joints/0/angle: " + loop + "0.1"},
  });
  Json json = Json::parse(kFullScene);
  json["joints"][0]["bodies"] = {"world", "ball"};
  json["joints"][0]["angle"] = 0;
  json["joints"][1]["displacement"] = 0;
  Scene scene;
  std::string error;
  EXPECT_FALSE(ParseScene(json.dump(), "bad.json", "", &scene, &error));
  EXPECT_EQ(error, "bad.json: /joints/0/rate: " + fixed + "-0.2");
  // With no angle and no rate there is nothing to turn.
  json["joints"][0]["rate"] = 0;
  json["joints"][1]["rate"] = 0;
  EXPECT_TRUE(ParseScene(json.dump(), "bad.json", "", &scene, &error)) << error;
}

TEST(BadSceneTest, SpringsAndForces) {
  Check({
      {"/springs/0/length", "1",
       "/springs/0/length: unknown key of a spring, expected one of name, bodies, anchors, "
       "stiffness, damping, rest_length, got \"length\""},
      {"/springs/0/stiffness", "-1", "/springs/0/stiffness: expected a number >= 0, got -1"},
      {"/springs/0/stiffness", kRemove, "/springs/0/stiffness: missing, expected a number >= 0"},
      {"/springs/0/damping", "-1", "/springs/0/damping: expected a number >= 0, got -1"},
      {"/springs/0/rest_length", "-1", "/springs/0/rest_length: expected a number >= 0, got -1"},
      {"/springs/0/anchors", "[[0, 0]]",
       "/springs/0/anchors: expected an array of 2 points [[x, y], [x, y]], got an array of 1"},
      {"/springs/0/anchors/1", "[0, 0, 0]",
       "/springs/0/anchors/1: expected an array of 2 numbers [x, y], got an array of 3"},
      {"/springs/1/bodies/1", "\"world\"",
       "/springs/1/bodies: expected at least one moving body, got two that are static, kinematic "
       "or world"},
      {"/springs/0/bodies/0", "\"nobody\"",
       "/springs/0/bodies/0: expected the name of a body (" + std::string(kBodies) +
           "), got \"nobody\""},
      {"/forces/0/body", "\"world\"",
       "/forces/0/body: expected the name of a body (" + std::string(kBodies) + "), got \"world\""},
      {"/forces/0/body", "\"floor\"", "/forces/0/body: expected a moving body, got \"floor\""},
      {"/forces/0/end", "0.125",
       "/forces/0/end: expected a number >= start, which is 0.25, got 0.125"},
      {"/forces/0/force", "1", "/forces/0/force: expected [x, y] or {\"file\": ...}, got 1"},
      {"/forces/0/torque", "[1, 2]",
       "/forces/0/torque: expected a number, {\"file\": ...} or {\"target\": ...}, got an array of "
       "2"},
      {"/forces/0/when", "1",
       "/forces/0/when: unknown key of a force, expected one of name, body, force, torque, at, "
       "start, end, got \"when\""},
  });
}

TEST(BadSceneTest, Signals) {
  const std::string folder = ::testing::TempDir();
  std::ofstream(folder + "tangible_bad.csv") << "time,x,value\n0,1,1\n0.5,1,1\n0.25,1,1\n";
  Check({
      {"/forces/0/force", R"({"file": "tangible_none.csv"})",
       "/forces/0/force/file: " + folder +
           "tangible_none.csv: cannot be read: No such file or directory"},
      {"/forces/0/force", R"({"file": "tangible_bad.csv"})",
       "/forces/0/force/file: " + folder +
           "tangible_bad.csv: line 4: time: expected a number > 0.5 (the time before), got 0.25"},
      {"/joints/0/effort", R"({"file": "tangible_bad.csv"})",
       "/joints/0/effort/file: " + folder +
           "tangible_bad.csv: line 4: time: expected a number > 0.5 (the time before), got 0.25"},
      {"/forces/0/torque", R"({"file": "x.csv", "interpolation": "cubic"})",
       "/forces/0/torque/interpolation: expected one of constant, linear, got \"cubic\""},
      {"/forces/0/torque", R"({})", "/forces/0/torque/file: missing, expected a string"},
      {"/forces/0/torque", R"({"file": "x.csv", "scale": 1})",
       "/forces/0/torque/scale: unknown key, expected one of file, interpolation, got \"scale\""},
      {"/forces/0/torque", R"({"time": [0, 1], "value": [1]})",
       "/forces/0/torque/value: expected 2 numbers, one for each time, got an array of 1"},
      {"/forces/0/torque", R"({"target": 1, "stiffness": -2})",
       "/forces/0/torque/stiffness: expected a number >= 0, got -2"},
      {"/joints/0/effort", R"({"target": 1, "stiffness": 2, "damping": -1})",
       "/joints/0/effort/damping: expected a number >= 0, got -1"},
      {"/joints/1/effort", R"({"target": 1, "stiffness": 2, "limit": 0})",
       "/joints/1/effort/limit: expected a number > 0, got 0"},
      {"/joints/1/effort", R"({"target": 1, "stiffness": 2, "speed": 0})",
       "/joints/1/effort/speed: unknown key of a servo, expected one of target, stiffness, "
       "damping, "
       "limit, got \"speed\""},
      {"/joints/1/effort", R"({"stiffness": 2})",
       "/joints/1/effort/target: missing, expected a number or {\"file\": ...}"},
      {"/forces/0/force", R"([{"target": 1}, 2])",
       "/forces/0/force/0/stiffness: missing, expected a number >= 0"},
      {"/forces/0/force", R"([0, {"target": {"file": "none.csv"}, "stiffness": 1}])",
       "/forces/0/force/1/target/file: " + folder +
           "none.csv: cannot be read: No such file or "
           "directory"},
      {"/forces/0/force", R"([{"target": 1, "stiffness": 1}])",
       "/forces/0/force: expected [x, y], each a number or a servo, got an array of 1"},
      {"/forces/0/torque", R"({"time": [0, 0], "value": [1, 1]})",
       "/forces/0/torque/time/1: expected a number > 0.0 (the time before), got 0"},
      {"/forces/0/force", R"({"time": []})",
       "/forces/0/force/time: expected an array of at least one time, got an array of 0"},
      {"/forces/0/force", R"({"time": [0]})", "/forces/0/force: missing x or y beside time"},
      {"/forces/0/force", R"({"time": [0], "value": [1]})",
       "/forces/0/force/value: unknown key, expected one of time, x, y, interpolation, got "
       "\"value\""},
  });
}

TEST(BadSceneTest, Supports) {
  Check({
      {"/bodies/0/support", "0.3", "/bodies/0/support: expected an object, got 0.3"},
      {"/bodies/0/support", "{}", "/bodies/0/support/friction: missing, expected a number >= 0"},
      {"/bodies/0/support", R"({"friction": -1})",
       "/bodies/0/support/friction: expected a number >= 0, got -1"},
      {"/bodies/0/support", R"({"friction": 1, "load": 0})",
       "/bodies/0/support/load: expected a number > 0, got 0"},
      {"/bodies/0/support", R"({"friction": 1, "radius": 0})",
       "/bodies/0/support/radius: expected a number > 0, got 0"},
      {"/bodies/0/support", R"({"friction": 1, "points": []})",
       "/bodies/0/support/points: expected an array of at least one point, got an array of 0"},
      {"/bodies/0/support", R"({"friction": 1, "points": [[0, 0]], "radius": 1})",
       "/bodies/0/support/radius: expected none beside points (a body stands on points or on a "
       "disc), got 1"},
      {"/bodies/0/support", R"({"friction": 1, "points": [[0, 0], [1, 0]], "shares": [1]})",
       "/bodies/0/support/shares: expected 2 numbers > 0, one for each point, got 1"},
      {"/bodies/0/support", R"({"friction": 1, "points": [[0, 0], [1, 0]], "shares": [1, -2]})",
       "/bodies/0/support/shares/1: expected a number > 0, got -2"},
      {"/bodies/0/support", R"({"friction": 1, "shares": [1]})",
       "/bodies/0/support/points: missing, expected an array of points with shares"},
      {"/bodies/0/support", R"({"friction": 1, "mu": 1})",
       "/bodies/0/support/mu: unknown key of a support, expected one of friction, load, points, "
       "shares, radius, got \"mu\""},
  });
}

TEST(BadSceneTest, PairsAndNoContact) {
  const std::string bodies = kBodies;
  Check({
      {"/pairs/0/bodies/1", "\"wall*\"",
       "/pairs/0/bodies/1: expected a name or pattern of a body (" + bodies + "), got \"wall*\""},
      {"/pairs/0/bodies/1", "\"ball\"",
       "/pairs/0/bodies: expected two different bodies, got \"ball\" twice"},
      {"/pairs/1/bodies", R"(["floor", "ball"])",
       "/pairs/1/bodies: expected a pair of its own, got floor:ball a second time"},
      {"/pairs/0/bodies/0", "\"b?\"",
       "/pairs/0/bodies/0: expected a name of letters, digits, _ . - *, got \"b?\""},
      {"/pairs/0/friction", "-1", "/pairs/0/friction: expected a number >= 0, got -1"},
      {"/pairs/0/restitution", "2", "/pairs/0/restitution: expected a number in [0, 1], got 2"},
      {"/pairs/0/name", "\"p\"",
       "/pairs/0/name: unknown key of a pair, expected one of bodies, friction, restitution, "
       "kinetic_friction, stribeck_speed, rolling_friction, got \"name\""},
      {"/no_contact/0", R"(["ball", "nobody"])",
       "/no_contact/0/1: expected a name or pattern of a body (" + bodies + "), got \"nobody\""},
      {"/no_contact/0", R"("ball")",
       "/no_contact/0: expected an array of 2 names of bodies, got \"ball\""},
      {"/no_contact/0", R"(["b*", "ball"])",
       "/no_contact/0: expected two different bodies, got \"ball\" twice"},
  });
}

TEST(BadSceneTest, Simulation) {
  const std::string place = "/simulation/";
  Check({
      {place + "step", "1",
       place + "step: unknown key of simulation, expected one of dt, duration, stepping, "
               "integrator, joint_correction, joint_tolerance, friction_mixing, "
               "restitution_mixing, impact_law, restitution_threshold, recovery_speed, "
               "contact_margin, max_events_per_step, lcp_tolerance, lcp_max_iterations, got "
               "\"step\""},
      {place + "dt", "0", place + "dt: expected a number > 0, got 0"},
      {place + "duration", "-1", place + "duration: expected a number >= 0, got -1"},
      {place + "dt", "1e-10",
       "/simulation: expected at most 1e9 steps, got duration / dt = 3.0 / 1e-10"},
      {place + "dt", "5e-324",
       "/simulation: expected at most 1e9 steps, got duration / dt = 3.0 / 5e-324"},
      {place + "stepping", "\"events\"",
       place + "stepping: expected one of fixed, event, got \"events\""},
      {place + "integrator", "\"euler\"",
       place + "integrator: expected one of semi_implicit_euler, trapezoidal, runge_kutta_4, got "
               "\"euler\""},
      {place + "joint_correction", "null",
       place + "joint_correction: expected one of none, projection, got null"},
      {place + "joint_tolerance", "0", place + "joint_tolerance: expected a number > 0, got 0"},
      {place + "friction_mixing", "\"mean\"",
       place + "friction_mixing: expected one of average, geometric_mean, got \"mean\""},
      {place + "restitution_mixing", "\"mean\"",
       place + "restitution_mixing: expected one of average, geometric_mean, got \"mean\""},
      {place + "impact_law", "\"huygens\"",
       place + "impact_law: expected one of newton, poisson, got \"huygens\""},
      {place + "restitution_threshold", "-1",
       place + "restitution_threshold: expected a number >= 0, got -1"},
      {place + "recovery_speed", "-1", place + "recovery_speed: expected a number >= 0, got -1"},
      {place + "contact_margin", "-1", place + "contact_margin: expected a number >= 0, got -1"},
      {place + "max_events_per_step", "1.5",
       place + "max_events_per_step: expected an integer in [0, 1000000], got 1.5"},
      {place + "lcp_tolerance", "0", place + "lcp_tolerance: expected a number > 0, got 0"},
      {place + "lcp_max_iterations", "0",
       place + "lcp_max_iterations: expected an integer in [1, 1000000], got 0"},
  });
}

TEST(BadSceneTest, WithdrawnSettingsSayWhatToWriteInstead) {
  const std::string place = "/simulation/";
  const std::string pair = "expected average, geometric_mean, or the pair's own value in \"pairs\"";
  Check({
      {place + "joint_correction", "\"baumgarte\"",
       place + "joint_correction: expected \"projection\", which closes joints, got \"baumgarte\""},
      {place + "baumgarte", "0.3",
       place + "baumgarte: expected no such key (\"joint_correction\": \"projection\" closes "
               "joints), got 0.3"},
      {place + "friction_mixing", "\"minimum\"",
       place + "friction_mixing: " + pair + ", got \"minimum\""},
      {place + "restitution_mixing", "\"maximum\"",
       place + "restitution_mixing: " + pair + ", got \"maximum\""},
      {place + "solver", "\"lemke\"",
       place + "solver: expected no such key (a step is solved by the first method that can), got "
               "\"lemke\""},
      {place + "smoothing", "1e-6",
       place + "smoothing: expected no such key (every step is solved to \"lcp_tolerance\"), got "
               "1e-06"},
  });
}

TEST(BadSceneTest, MalformedText) {
  const auto error_of = [](const std::string& text) {
    Scene scene;
    std::string error;
    EXPECT_FALSE(ParseScene(text, "bad.json", "", &scene, &error));
    EXPECT_EQ(error.find('\n'), std::string::npos);
    return error;
  };
  EXPECT_EQ(error_of("{\"bodies\": [{\"mass\": 1e999}]}"),
            "bad.json: line 1, column 26: malformed JSON: number overflow parsing '1e999'");
  EXPECT_EQ(error_of("{\"bodies\": [\n{\"mass\": NaN}]}").rfind("bad.json: line 2, column 10: ", 0),
            0u);
  EXPECT_EQ(error_of("{\"bodies\": [],\n \"bodies\": []}"),
            "bad.json: /bodies: key given twice in one object, expected once");
}

// Whatever replaces any value of a scene, reading ends with a scene or one line, never a crash.
TEST(BadSceneTest, AnyValueAnywhere) {
  const Json good = Json::parse(kFullScene);
  const Json flat = good.flatten();
  const std::vector<Json> values = {
      nullptr, true, -1, 0, 1e308, "", "world", "*", Json::array(), Json::object(), -1e-308};
  int refused = 0;
  for (const auto& item : flat.items()) {
    std::string pointer = item.key();
    while (!pointer.empty()) {
      for (const Json& value : values) {
        Json json = good;
        json[Json::json_pointer(pointer)] = value;
        Scene scene;
        std::string error;
        if (ParseScene(json.dump(), "bad.json", "", &scene, &error)) continue;
        ++refused;
        ASSERT_EQ(error.rfind("bad.json: /", 0), 0u) << error;
        ASSERT_EQ(error.find('\n'), std::string::npos) << error;
      }
      pointer.resize(pointer.rfind('/'));
    }
  }
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace tangible
