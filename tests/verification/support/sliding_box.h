// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What the tests of verification share.

#include <gtest/gtest.h>

#include <string>

#include "tangible/scene/parameter.h"
#include "tangible/scene/scene_json.h"

namespace tangible {

/// A box of friction mu, pushed along a floor at 1 m/s, for ten steps.
inline Scene SlidingBox(const std::string& mu) {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(R"({"bodies": [
    {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
     "velocity": [1, 0], "friction": )" +
                             mu + R"(},
    {"name": "floor", "static": true, "friction": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "pairs": [{"bodies": ["box", "floor"], "friction": )" +
                             mu + R"(}],
    "simulation": {"dt": 0.01, "duration": 0.1}})",
                         "scene.json", "", &scene, &error))
      << error;
  return scene;
}

/// A box between a floor and a kinematic box that comes down on it: it has nowhere to go.
inline Scene PressedBox() {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(R"({"bodies": [
    {"name": "box", "shape": {"box": {"size": [1, 0.2]}}, "mass": 1, "position": [0, 0.1]},
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
    {"name": "press", "kinematic": true, "shape": {"box": {"size": [1, 0.2]}},
     "position": [0, 0.301], "velocity": [0, -1]}],
    "simulation": {"dt": 0.01, "duration": 0.1}})",
                         "press.json", "", &scene, &error))
      << error;
  return scene;
}

inline ParameterPath PathTo(const Scene& scene, const std::string& text) {
  ParameterPath path;
  std::string error;
  EXPECT_TRUE(ResolveParameter(scene, text, &path, &error)) << error;
  return path;
}

}  // namespace tangible
