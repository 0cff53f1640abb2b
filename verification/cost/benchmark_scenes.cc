// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/benchmark_scenes.h"

#include <cmath>
#include <string>

namespace tangible {
namespace {

constexpr double kRadius = 0.1;
constexpr double kFriction = 0.5;

void AddHalfPlane(const std::string& name, double x, double y, double offset, Scene* scene) {
  BasicBody<double> body;
  body.name = name;
  body.motion = Motion::kStatic;
  body.shape = {ShapeType::kHalfPlane, {x, y, offset}};
  body.friction = kFriction;
  scene->bodies.push_back(body);
}

void AddDiscs(const std::string& prefix, int discs, double middle, Scene* scene) {
  const DiscPile pile = PileOf(discs);
  for (int i = 0; i < discs; ++i) {
    BasicBody<double> body;
    body.name = prefix + std::to_string(i);
    body.shape = {ShapeType::kCircle, {kRadius}};
    body.mass = 1.0;
    body.friction = kFriction;
    const Vector2<double> start = DiscStart(pile, i);
    body.position = {middle + start.x(), start.y()};
    scene->bodies.push_back(body);
  }
}

}  // namespace

DiscPile PileOf(int discs) {
  const int columns = static_cast<int>(std::ceil(std::sqrt(discs)));
  return {columns, 0.25 * columns};
}

Vector2<double> DiscStart(const DiscPile& pile, int i) {
  const int row = i / pile.columns;
  const int column = i % pile.columns;
  return Vector2<double>(-0.5 * pile.width + 0.125 + 0.25 * column + 0.01 * std::sin(12.9898 * i),
                         0.15 + 0.22 * row);
}

Scene DiscsScene(int discs) {
  Scene scene;
  const double width = PileOf(discs).width;
  AddHalfPlane("floor", 0.0, 1.0, 0.0, &scene);
  AddHalfPlane("left", 1.0, 0.0, -0.5 * width, &scene);
  AddHalfPlane("right", -1.0, 0.0, -0.5 * width, &scene);
  AddDiscs("disc", discs, 0.0, &scene);
  scene.simulation.dt = 0.002;
  scene.simulation.duration = 1.0;
  return scene;
}

Scene PilesScene(int piles, int discs) {
  Scene scene;
  AddHalfPlane("floor", 0.0, 1.0, 0.0, &scene);
  const double width = PileOf(discs).width;
  for (int pile = 0; pile < piles; ++pile) {
    const double middle = pile * (width + 1.0);
    for (const double side : {-1.0, 1.0}) {
      BasicBody<double> wall;
      wall.name = (side < 0.0 ? "left" : "right") + std::to_string(pile);
      wall.motion = Motion::kStatic;
      wall.shape = {ShapeType::kBox, {0.1, 2.0 * width}};
      wall.friction = kFriction;
      wall.position = {middle + side * (0.5 * width + 0.05), width};
      scene.bodies.push_back(wall);
    }
    AddDiscs("disc" + std::to_string(pile) + "_", discs, middle, &scene);
  }
  scene.simulation.dt = 0.002;
  scene.simulation.duration = 1.0;
  return scene;
}

Scene PyramidScene(int base) {
  Scene scene;
  AddHalfPlane("floor", 0.0, 1.0, 0.0, &scene);
  for (int row = 0; row < base; ++row) {
    for (int i = 0; i < base - row; ++i) {
      BasicBody<double> body;
      body.name = "box" + std::to_string(row) + "_" + std::to_string(i);
      body.shape = {ShapeType::kBox, {1.0, 1.0}};
      body.mass = 1.0;
      body.friction = kFriction;
      body.position = {1.125 * (i - 0.5 * (base - row - 1)), 0.5 + 1.05 * row};
      scene.bodies.push_back(body);
    }
  }
  scene.simulation.dt = 1.0 / 60.0;
  scene.simulation.duration = 1.0;
  return scene;
}

Scene ChainScene(int links) {
  Scene scene;
  constexpr double kLength = 0.3;
  const double top = kLength * links + 1.0;
  for (int i = 0; i < links; ++i) {
    BasicBody<double> link;
    link.name = "link" + std::to_string(i);
    link.shape = {ShapeType::kBox, {0.06, kLength}};
    link.mass = 1.0;
    link.position = {0.0, top - kLength * (i + 0.5)};
    link.friction = 0.3;
    scene.bodies.push_back(link);
    BasicJoint<double> pin;
    pin.name = "pin" + std::to_string(i);
    pin.bodies[0] = i;
    pin.bodies[1] = i - 1;  // the world for the first
    pin.anchors[0] = {0.0, top - kLength * i};
    scene.joints.push_back(pin);
  }
  BasicBody<double> ball;
  ball.name = "ball";
  ball.shape = {ShapeType::kCircle, {kRadius}};
  ball.mass = 1.0;
  ball.position = {-0.8, top - 1.8};
  ball.velocity = {4.0, 0.0};
  ball.friction = 0.3;
  scene.bodies.push_back(ball);
  scene.no_contact.push_back({"link*", "link*"});
  scene.simulation.dt = 0.002;
  scene.simulation.duration = 1.0;
  return scene;
}

}  // namespace tangible
