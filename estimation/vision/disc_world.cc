// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/vision/disc_world.h"

#include <algorithm>
#include <cmath>

namespace tangible {

DiscWorld BilliardWorld() {
  DiscWorld world;
  world.cloth = {0.05, 0.25, 0.15};
  world.colours = {{0.95, 0.9, 0.3}, {0.9, 0.15, 0.2}, {0.3, 0.45, 1.0}};
  world.radii = {5.0, 5.0, 5.0};
  world.masses = {1.0, 2.0, 0.5};
  world.disc_restitution = 0.9;
  world.side_restitution = 1.0;
  world.end_restitution = 0.7;
  world.linear_damping = 0.02;
  return world;
}

DiscWorld SimbWorld() {
  DiscWorld world;
  world.style = DiscStyle::kSoft;
  world.high = kPictureSize - 1;
  world.colours = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
  world.radii = {2.0, 2.0, 2.0};
  world.masses = {1.0, 1.0, 1.0};
  return world;
}

Scene SceneOf(const DiscWorld& world, int frames) {
  Scene scene;
  scene.name = "discs";
  scene.gravity = {0.0, 0.0};
  scene.simulation.dt = 1.0;
  scene.simulation.duration = frames;
  scene.simulation.stepping = Stepping::kEvent;
  const double middle = 0.5 * (world.low + world.high);
  for (int i = 0; i < world.size(); ++i) {
    BasicBody<double> disc;
    disc.name = "disc" + std::to_string(i);
    disc.shape = {ShapeType::kCircle, {world.radii[i]}};
    disc.mass = world.masses[i];
    disc.linear_damping = world.linear_damping;
    // The initial positions only have to be apart, because each rollout is given a state.
    disc.position = {middle, world.low + (world.high - world.low) * (i + 1.0) / (world.size() + 1)};
    scene.bodies.push_back(disc);
  }
  const auto wall = [&](const char* name, Vector2<double> normal, double offset) {
    BasicBody<double> body;
    body.name = name;
    body.motion = Motion::kStatic;
    body.shape = {ShapeType::kHalfPlane, {normal.x(), normal.y(), offset}};
    scene.bodies.push_back(body);
  };
  wall("side_left", {1.0, 0.0}, world.low);
  wall("side_right", {-1.0, 0.0}, -world.high);
  wall("end_top", {0.0, 1.0}, world.low);
  wall("end_bottom", {0.0, -1.0}, -world.high);
  const auto pair = [&](const std::string& a, const std::string& b, double restitution) {
    BasicPair<double>& of_two = scene.pairs.emplace_back();
    of_two.bodies[0] = a;
    of_two.bodies[1] = b;
    of_two.restitution = restitution;
  };
  for (int i = 0; i < world.size(); ++i) {
    const std::string disc = "disc" + std::to_string(i);
    for (int j = i + 1; j < world.size(); ++j) {
      pair(disc, "disc" + std::to_string(j), world.disc_restitution);
    }
    for (const char* side : {"side_left", "side_right"}) pair(disc, side, world.side_restitution);
    for (const char* end : {"end_top", "end_bottom"}) pair(disc, end, world.end_restitution);
  }
  return scene;
}

namespace {

// The fraction of a pixel at (x, y) from the disc's centre that the disc covers, by 4 x 4 points.
double Coverage(double x, double y, double radius) {
  const double d = std::hypot(x, y);
  // Half the diagonal of a pixel is 0.71.
  if (d < radius - 0.8) return 1.0;
  if (d > radius + 0.8) return 0.0;
  int inside = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      inside += std::hypot(x + (i - 1.5) / 4.0, y + (j - 1.5) / 4.0) < radius ? 1 : 0;
    }
  }
  return inside / 16.0;
}

}  // namespace

std::string DrawDiscs(const DiscWorld& world, const std::vector<double>& centres) {
  std::vector<double> picture(kPictureBytes);
  for (int c = 0; c < 3; ++c) {
    std::fill_n(picture.begin() + c * kPicturePixels, kPicturePixels, world.cloth[c]);
  }
  for (int disc = 0; disc < world.size(); ++disc) {
    const double radius = world.radii[disc];
    // Beyond twice the radius exp(−4⁴) is 0.
    const double reach = world.style == DiscStyle::kSoft ? 2.0 * radius : radius + 1.0;
    const double centre_x = centres[2 * disc], centre_y = centres[2 * disc + 1];
    const auto bound = [](double at) {
      return static_cast<int>(std::clamp(at, 0.0, static_cast<double>(kPictureSize)));
    };
    for (int j = bound(centre_y - reach); j < bound(centre_y + reach + 1.0); ++j) {
      for (int i = bound(centre_x - reach); i < bound(centre_x + reach + 1.0); ++i) {
        const double x = i + 0.5 - centre_x, y = j + 0.5 - centre_y;
        const bool soft = world.style == DiscStyle::kSoft;
        const double share = soft ? std::exp(-std::pow((x * x + y * y) / (radius * radius), 4))
                                  : Coverage(x, y, radius);
        for (int c = 0; c < 3; ++c) {
          double& value = picture[c * kPicturePixels + j * kPictureSize + i];
          value = soft ? std::min(1.0, value + share * world.colours[disc][c])
                       : value + share * (world.colours[disc][c] - value);
        }
      }
    }
  }
  std::string bytes(kPictureBytes, '\0');
  for (int k = 0; k < kPictureBytes; ++k) {
    bytes[k] = static_cast<char>(static_cast<unsigned char>(std::lround(255.0 * picture[k])));
  }
  return bytes;
}

}  // namespace tangible
