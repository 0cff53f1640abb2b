// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A rod on its foot that slides over a floor: with enough friction it jams (Painlevé).

#include <cmath>
#include <string>

#include "scenes.h"

namespace tangible::test_scenes {

inline constexpr double kRodAngle = 0.8726646259971648;  // 50 degrees

/// The coefficient at which the foot of the rod of SlidingRod jams when it slides to the left: a
/// push by its contact no longer lifts it, 1 / m + r_x² / I = μ |r_x r_y| / I.
inline double JammingFriction() {
  const double x = 0.5 * std::cos(kRodAngle);
  const double y = 0.5 * std::sin(kRodAngle) + 0.001;
  return (1.0 / 12.0 + x * x) / (x * y);
}

/// 1 m, 1 kg, at 50 degrees on its foot, 50 steps of 1 ms by events; `more` of the rod.
inline Scene SlidingRod(double friction, double speed_x, double speed_y = 0.0,
                        const std::string& more = "") {
  Scene scene = SceneOf(R"({"bodies": [
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
    {"name": "rod", "shape": {"capsule": {"length": 1.0, "radius": 0.001}}, "mass": 1,
     "inertia": 0.08333333333333333, "position": [0.3213938048432697, 0.384022221559489],
     "angle": 0.8726646259971648)" +
                        more + R"(}],
    "simulation": {"dt": 0.001, "duration": 0.05, "stepping": "event",
                   "integrator": "runge_kutta_4"}})");
  for (BasicBody<double>& body : scene.bodies) {
    body.friction = friction;
  }
  scene.bodies[1].velocity = Vector2<double>(speed_x, speed_y);
  return scene;
}

}  // namespace tangible::test_scenes
