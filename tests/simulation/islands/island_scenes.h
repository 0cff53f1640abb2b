// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Scenes of balls that are far apart, and of each of them alone.

#include <cstdio>
#include <string>
#include <vector>

#include "../../support/scenes.h"

namespace tangible::test_scenes {

inline std::string Number(double x) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.17g", x);
  return text;
}

/// Ball i of a row. Two by two they land in the same step, but not at the same time; else height,
/// speed and spin differ from ball to ball.
inline std::string BallOfRow(int i) {
  return R"({"name": "ball)" + std::to_string(i) + R"(", "shape": {"circle": {"radius": )" +
         Number(0.1 + 0.01 * (i / 2 % 3)) + R"(}}, "mass": )" + Number(1.0 + 0.5 * (i % 4)) +
         R"(, "position": [)" + Number(2.0 * i) + ", " +
         Number(0.25 + 0.037 * (i / 2 % 7) + 0.002 * (i % 2)) + R"(], "velocity": [)" +
         Number(0.1 * (i % 3)) + R"(, 0], "angular_velocity": )" + Number(0.5 * (i % 2)) +
         R"(, "friction": 0.3, "restitution": 0.7})";
}

/// These balls of the row above a floor and a belt, which moves and rises beneath the first two.
inline std::string Row(const std::vector<int>& balls, double duration) {
  std::string bodies =
      R"({"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1]}},
          "friction": 0.3, "restitution": 0.7},
         {"name": "belt", "kinematic": true, "shape": {"box": {"size": [6, 0.1]}},
          "position": [0, -0.02], "velocity": [-0.2, 0.01], "friction": 0.3, "restitution": 0.7})";
  for (const int ball : balls) {
    bodies += ", " + BallOfRow(ball);
  }
  return R"({"bodies": [)" + bodies + R"(], "simulation": {"stepping": "event", "dt": 0.01,
      "duration": )" +
         Number(duration) + "}}";
}

}  // namespace tangible::test_scenes
