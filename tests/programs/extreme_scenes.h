// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Twenty-one scenes at the engine's limits, in few lines each: mass ratios, piles, scales, speeds,
// friction, joints, paradoxes.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tangible {

struct ExtremeScene {
  std::string name;
  nlohmann::json scene;
};

namespace extreme_scenes {

using nlohmann::json;

inline json Body(const std::string& name, const json& shape, double mass, double x, double y,
                 const json& more = json::object()) {
  json body = {{"name", name},       {"shape", shape},  {"mass", mass},
               {"position", {x, y}}, {"friction", 0.4}, {"restitution", 0.1}};
  body.merge_patch(more);
  return body;
}
inline json Box(double width, double height) { return {{"box", {{"size", {width, height}}}}}; }
inline json Disc(double radius) { return {{"circle", {{"radius", radius}}}}; }
inline json Plane(const std::string& name, double x, double y, double friction = 0.4) {
  return {{"name", name},
          {"static", true},
          {"friction", friction},
          {"restitution", 0.1},
          {"shape", {{"half_plane", {{"normal", {x, y}}, {"offset", 0}}}}}};
}
inline json World(const json& bodies, double dt, int steps, const json& more = json::object()) {
  json scene = {{"bodies", bodies}, {"simulation", {{"dt", dt}, {"duration", dt * steps}}}};
  scene.merge_patch(more);
  return scene;
}

/// Unit boxes with these masses upon the floor.
inline json Stack(const std::vector<double>& masses) {
  json bodies = {Plane("floor", 0, 1)};
  for (size_t i = 0; i < masses.size(); ++i) {
    const double k = static_cast<double>(i);
    bodies.push_back(Body("box" + std::to_string(i), Box(1, 1), masses[i], 0.01 * k, 0.5 + k));
  }
  return World(bodies, 0.01, 60);
}

inline json Pyramid(int rows) {
  json bodies = {Plane("floor", 0, 1)};
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < rows - row; ++i) {
      bodies.push_back(Body("box" + std::to_string(row) + "_" + std::to_string(i), Box(1, 1), 1,
                            1.1 * (i + 0.5 * row), 0.5 + row));
    }
  }
  return World(bodies, 0.01, 40);
}

/// A box slides while a disc bounces, all lengths times `scale`, gravity too.
inline json SlideAndBounce(double scale) {
  return World(
      {Plane("floor", 0, 1),
       Body("box", Box(scale, 0.5 * scale), 2, 0, 0.25 * scale, {{"velocity", {2 * scale, 0}}}),
       Body("disc", Disc(0.2 * scale), 1, 3 * scale, 0.9 * scale,
            {{"velocity", {-scale, 0}}, {"restitution", 0.7}})},
      0.01, 60,
      {{"gravity", {0, -9.81 * scale}}, {"simulation", {{"contact_margin", 1e-4 * scale}}}});
}

/// Something fast against a wall of 1 mm.
inline json AgainstWall(const json& shape, double speed, double spin) {
  return World({Body("wall", Box(1e-3, 1e3), 1, 0, 0, {{"static", true}}),
                Body("flyer", shape, 1, -0.5 - 0.025 * speed, 0.05,
                     {{"velocity", {speed, 0}}, {"angular_velocity", spin}, {"angle", 0.2}})},
               0.01, 10, {{"gravity", {0, 0}}});
}

/// A chain hangs from the world, the last link of another mass; a ball of a mass flies at it.
inline json Chain(int count, double end, double ball) {
  json bodies;
  json joints;
  for (int i = 0; i < count; ++i) {
    const std::string name = "link" + std::to_string(i);
    bodies.push_back(Body(name, Box(0.1, 0.5), i + 1 == count ? end : 1, 0, -0.25 - 0.5 * i,
                          {{"velocity", {0.1 * i, 0}}}));
    joints.push_back({{"name", "pin" + std::to_string(i)},
                      {"type", "revolute"},
                      {"bodies", {name, i == 0 ? "world" : "link" + std::to_string(i - 1)}},
                      {"anchor", {0, -0.5 * i}},
                      {"damping", 0.01}});
  }
  bodies.push_back(Body("ball", Disc(0.2), ball, -0.6, -0.5 * count + 0.4, {{"velocity", {8, 0}}}));
  return World(
      bodies, 0.005, 80,
      {{"joints", joints}, {"no_contact", json::array({json::array({"link*", "link*"})})}});
}

/// Painlevé's rod: its end slides over the floor at an angle at which no acceleration exists.
inline json Rod(double friction) {
  return World({Plane("floor", 0, 1, friction),
                Body("rod", {{"polygon", {{"vertices", {{-1, 0}, {0, -0.01}, {1, 0}, {0, 0.01}}}}}},
                     1, 0, 0.8,
                     {{"inertia", 1.0 / 3.0},
                      {"angle", 0.9272952180016122},
                      {"velocity", {-1, 0}},
                      {"friction", friction}})},
               0.001, 50);
}

/// Discs in a funnel that narrows downwards.
inline json Funnel(double friction) {
  return World({Plane("left", 0.8, 0.6, friction), Plane("right", -0.8, 0.6, friction),
                Body("low", Disc(0.2), 1, 0.02, 0.4, {{"friction", friction}}),
                Body("high", Disc(0.3), 5, -0.05, 1.2, {{"friction", friction}})},
               0.01, 60);
}

inline json Slider() {
  return World({Body("cart", Box(1, 0.3), 1, 0, 0, {{"velocity", {5, 0}}}),
                Body("bob", Disc(0.1), 100, 0, -1)},
               0.005, 80,
               {{"joints",
                 {{{"name", "rail"},
                   {"type", "prismatic"},
                   {"bodies", {"cart", "world"}},
                   {"anchor", {0, 0}},
                   {"axis", {1, 0}},
                   {"limits", {-0.3, 0.5}},
                   {"effort", 30}},
                  {{"name", "pin"},
                   {"type", "revolute"},
                   {"bodies", {"bob", "cart"}},
                   {"anchor", {0, 0}}}}}});
}

inline json Paddle() {
  return World({Body("paddle", Box(2, 0.2), 1, 0, 0,
                     {{"kinematic", true}, {"velocity", {0, 1}}, {"angular_velocity", 3}}),
                Body("puck", Disc(0.1), 1e-3, 0.3, 0.5, {{"velocity", {0, -3}}})},
               0.01, 40);
}

inline json StiffSpring() {
  return World({Body("mass", Disc(0.1), 1e-3, 0.5, 0), Body("other", Disc(0.1), 1e3, 2, 0)}, 1e-4,
               100,
               {{"springs",
                 {{{"name", "s"},
                   {"bodies", {"mass", "other"}},
                   {"anchors", {{0.5, 0}, {2, 0}}},
                   {"stiffness", 1e4},
                   {"damping", 0.1},
                   {"rest_length", 1.4}}}}});
}

}  // namespace extreme_scenes

inline std::vector<ExtremeScene> ExtremeScenes() {
  using namespace extreme_scenes;  // NOLINT(google-build-using-namespace)
  std::vector<ExtremeScene> scenes = {
      {"stack_1e3_on_1", Stack({1, 1e3})},
      {"stack_1e6_on_1", Stack({1, 1e6})},
      {"stack_1e-6_on_1", Stack({1, 1, 1e-6})},
      {"stack_of_ten", Stack(std::vector<double>(10, 1.0))},
      {"pyramid", Pyramid(4)},
      {"scale_1e-4", SlideAndBounce(1e-4)},
      {"scale_1", SlideAndBounce(1.0)},
      {"scale_1e4", SlideAndBounce(1e4)},
      {"disc_1e4_m_per_s", AgainstWall(Disc(0.1), 1e4, 0)},
      {"box_spinning_1e3_m_per_s", AgainstWall(Box(0.2, 0.2), 1e3, 100)},
      {"needle_1e2_m_per_s", AgainstWall(Box(0.2, 1e-3), 100, 0)},
      {"chain_end_1e3", Chain(12, 1e3, 1)},
      {"chain_and_ball_1e6", Chain(6, 1, 1e6)},
      {"chain_and_ball_1e-3", Chain(6, 1, 1e-3)},
      {"rod_friction_0.3", Rod(0.3)},
      {"rod_friction_1e3", Rod(1e3)},
      {"funnel_frictionless", Funnel(0.0)},
      {"funnel_friction_10", Funnel(10.0)},
      {"slider_limits", Slider()},
      {"paddle", Paddle()},
      {"stiff_spring", StiffSpring()}};
  return scenes;
}

}  // namespace tangible
