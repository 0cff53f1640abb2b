// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A ball of radius r dropped from the height h of its centre on a floor, with restitution e:
//
//   t_1 = √(2 (h − r) / g),   t_n = t_1 (1 + 2 (e + e² + … + e^(n−1)))      the n-th bounce

#include <cmath>
#include <string>

namespace tangible {

inline constexpr char kBouncingBall[] = R"({"name": "bouncing ball", "bodies": [
  {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1.1]},
  {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
  "pairs": [{"bodies": ["ball", "floor"], "restitution": 0.8}],
  "simulation": {"dt": 0.01, "duration": 4, "stepping": "event"}})";

struct Bounces {
  double height = 1.1, restitution = 0.8, gravity = 9.81, radius = 0.1;

  double First() const { return std::sqrt(2.0 * (height - radius) / gravity); }
  double Time(int n) const {
    double sum = 1.0;
    for (int k = 1; k < n; ++k) sum += 2.0 * std::pow(restitution, k);
    return First() * sum;
  }
  double ByHeight(int n) const { return 0.5 * Time(n) / (height - radius); }
  double ByRestitution(int n) const {
    double sum = 0.0;
    for (int k = 1; k < n; ++k) sum += 2.0 * k * std::pow(restitution, k - 1);
    return First() * sum;
  }
  double ByGravity(int n) const { return -0.5 * Time(n) / gravity; }
};

}  // namespace tangible
