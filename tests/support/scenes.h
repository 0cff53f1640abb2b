// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Small scenes for tests of more than one module, as text.

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "tangible/scene/scene_json.h"

namespace tangible::test_scenes {

inline constexpr double kGravity = 9.81;  ///< m/s², as scenes have it by default

/// A number that reads back to the same bits.
inline std::string Text(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", x);
  return text;
}

/// The scene of a text that is known to be good.
inline Scene SceneOf(const std::string& text) {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(text, "test.json", ".", &scene, &error)) << error;
  return scene;
}

/// Ten links of 0.1 m and 1 kg, but the last, that swing from an angle of 0.5; `more` as in a
/// scene's simulation.
inline std::string HeavyEnd(const std::string& end,
                            const std::string& more = R"("dt": 0.01, "duration": 1)") {
  std::string bodies, joints;
  for (int i = 0; i < 10; ++i) {
    const std::string comma = i > 0 ? "," : "";
    const std::string name = "link" + std::to_string(i);
    bodies += comma + R"({"name": ")" + name +
              R"(", "shape": {"box": {"size": [0.02, 0.1]}}, "mass": )" + (i < 9 ? "1" : end) +
              R"(, "position": [0, )" + std::to_string(-0.1 * (i + 0.5)) + "]}";
    joints += comma + R"({"name": "pin)" + std::to_string(i) +
              R"(", "type": "revolute", "bodies": [")" + name + R"(", ")" +
              (i > 0 ? "link" + std::to_string(i - 1) : "world") + R"("], "anchor": [0, )" +
              std::to_string(-0.1 * i) + "]" + (i > 0 ? "" : R"(, "angle": 0.5)") + "}";
  }
  return R"({"bodies": [)" + bodies + R"(], "joints": [)" + joints +
         R"(], "no_contact": [["link*", "link*"]],
      "simulation": {"joint_correction": "projection", )" +
         more + "}}";
}

/// A square loop of three unit rods of 1 kg on the ground, which swings through; `simulation` as in
/// a scene file.
inline std::string FourBar(const std::string& simulation) {
  return R"({"bodies": [
      {"name": "left", "mass": 1, "inertia": 0.08333333333333333, "position": [0, 0.5],
       "velocity": [0.5, 0], "angular_velocity": -1},
      {"name": "top", "mass": 1, "inertia": 0.08333333333333333, "position": [0.5, 1],
       "velocity": [1, 0]},
      {"name": "right", "mass": 1, "inertia": 0.08333333333333333, "position": [1, 0.5],
       "velocity": [0.5, 0], "angular_velocity": -1}],
    "joints": [
      {"name": "pin0", "type": "revolute", "bodies": ["left", "world"], "anchor": [0, 0]},
      {"name": "pin1", "type": "revolute", "bodies": ["left", "top"], "anchor": [0, 1]},
      {"name": "pin2", "type": "revolute", "bodies": ["top", "right"], "anchor": [1, 1]},
      {"name": "pin3", "type": "revolute", "bodies": ["right", "world"], "anchor": [1, 0]}],
    "simulation": )" +
         simulation + "}";
}

inline constexpr char kFloor[] =
    R"({"name": "floor", "static": true, "friction": 0.3, "restitution": 0.5,
        "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})";

/// A ball that falls from `height` above its rest, without restitution; `simulation` as in a scene
/// file.
inline std::string FallingBall(double height, const std::string& simulation) {
  return R"({"bodies": [{"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
                         "position": [0, )" +
         std::to_string(0.1 + height) + R"(]},
                        {"name": "floor", "static": true, "friction": 0.3,
                         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
             "simulation": )" +
         simulation + "}";
}

/// Every kind of thing: a ball that bounces with spin, a crate that lands on a
/// corner and slides, a rod
/// on a pin with a damper, a limit and a spring, a push in a time window.
inline std::string Mixture() {
  return R"({"name": "mixture", "bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.6],
       "velocity": [1, 0.1], "angular_velocity": 2, "friction": 0.3, "restitution": 0.5,
       "linear_damping": 0.02, "angular_damping": 0.001},
      {"name": "crate", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "inertia": 0.04,
       "position": [-1.5, 0.9], "angle": 0.4, "velocity": [1.2, 0], "friction": 0.4},
      {"name": "rod", "shape": {"capsule": {"length": 0.5, "radius": 0.05}}, "mass": 0.5,
       "position": [1.3, 0.9], "friction": 0.2}, )" +
         std::string(kFloor) + R"(],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [1.05, 0.9],
                "damping": 0.01, "limits": [-1.5, 2], "angle": 0.1, "rate": -0.2, "effort": 0.05}],
    "springs": [{"name": "s", "bodies": ["rod", "world"], "anchors": [[1.55, 0.9], [1.55, 1.6]],
                 "stiffness": 5, "damping": 0.1, "rest_length": 0.5}],
    "forces": [{"name": "push", "body": "crate", "force": [1, 0.2], "torque": 0.01, "at": [0.1, 0.02],
                "start": 0.013, "end": 0.187}],
    "pairs": [{"bodies": ["crate", "floor"], "restitution": 0}],
    "simulation": {"dt": 0.01, "duration": 0.63, "joint_correction": "projection"}})";
}

/// Two links of 0.1 kg that whip about one of 10 kg: joints drift by up to 4 mm a step.
inline std::string WhippingChain(double duration) {
  return R"({"bodies": [
      {"name": "a", "shape": {"box": {"size": [0.1, 1]}}, "mass": 0.1, "position": [0, -0.5]},
      {"name": "b", "shape": {"box": {"size": [0.1, 1]}}, "mass": 0.1, "position": [0, -1.5]},
      {"name": "c", "shape": {"box": {"size": [0.1, 1]}}, "mass": 10, "position": [0, -2.5]}],
    "joints": [{"name": "i", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "angle": -1.45},
               {"name": "j", "type": "revolute", "bodies": ["b", "a"], "anchor": [0, -1],
                "angle": 1.11},
               {"name": "k", "type": "revolute", "bodies": ["c", "b"], "anchor": [0, -2],
                "angle": 1.1}],
    "no_contact": [["*", "*"]],
    "simulation": {"dt": 0.01, "joint_correction": "projection", "duration": )" +
         std::to_string(duration) + "}}";
}

}  // namespace tangible::test_scenes
