// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/random_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tangible/dynamics/model/settings.h"
#include "tangible/scene/scene_names.h"
#include "tangible/verification/support/random_scene_maker.h"

namespace tangible {
namespace internal {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kColumn = 0.7;  // m, between places where bodies start

}  // namespace

double HalfHeight(const BasicShape<double>& shape) {
  switch (shape.type) {
    case ShapeType::kCircle:
      return shape.numbers[0];
    case ShapeType::kBox:
      return 0.5 * shape.numbers[1];
    case ShapeType::kEllipse:
    case ShapeType::kCapsule:
      return shape.numbers[1];
    case ShapeType::kPolygon: {
      double lowest = 0.0;
      for (size_t i = 1; i < shape.numbers.size(); i += 2) {
        lowest = std::min(lowest, shape.numbers[i]);
      }
      return -lowest;
    }
    default:
      return 0.1;
  }
}

SceneMaker::SceneMaker(unsigned seed, const RandomSceneOptions& options)
    : random_(0x7a6e67ULL + 0x9e3779b97f4a7c15ULL * seed), options_(options), seed_(seed) {
  scene_.name = "random " + std::to_string(seed);
}

Scene SceneMaker::Make() {
  Settings();
  Floor();
  int bodies = random_.Integer(1, options_.max_bodies);
  if (options_.stepping == Stepping::kEvent &&
      scene_.simulation.duration > 40.0 * scene_.simulation.dt) {
    bodies = std::min(bodies, 2);
  }
  int left = bodies;
  if (left >= 3 && random_.Chance(0.15)) {
    left -= Loop();
  }
  if (left >= 1 && random_.Chance(0.5)) {
    left -= Chain(random_.Integer(1, std::min(left, 4)));
  }
  while (left > 0) {
    FreeBody();
    --left;
  }
  Obstacles();
  Springs();
  Forces();
  Pairs();
  Rarities();
  if (options_.stepping == Stepping::kEvent) {
    scene_.simulation.integrator =
        random_.Chance(0.5) ? Integrator::kTrapezoidal : Integrator::kRungeKutta4;
    if (random_.Chance(0.25)) {
      scene_.simulation.impact_law = ImpactLaw::kPoisson;
    }
  }
  Mechanisms();
  Drives();
  Outlines();
  ConcavePolygons();
  SplineFloor();
  Servos();
  Couplings();
  Ends();
  Supports();
  RollingFriction();
  return scene_;
}

void SceneMaker::Settings() {
  SimulationSettings& s = scene_.simulation;
  const double steps[] = {0.002, 0.005, 0.01, 0.02};
  s.dt = steps[random_.Integer(0, 3)];
  s.stepping = options_.stepping;
  const double length = U(0.0, 1.0);
  // An event step costs ten fixed ones.
  const bool by_events = options_.stepping == Stepping::kEvent;
  const int short_run = std::min(by_events ? 12 : 40, options_.max_steps);
  const int count = length < 0.08 ? random_.Integer(1, 2)
                    : length < (by_events ? 0.98 : 0.92)
                        ? random_.Integer(std::min(5, short_run), short_run)
                        : random_.Integer(short_run, options_.max_steps);
  // Every fifth run ends within a step.
  s.duration = s.dt * (random_.Chance(0.2) ? count - 0.4 : count);
  s.joint_correction = random_.Chance(0.5) ? JointCorrection::kNone : JointCorrection::kProjection;
  const Mixing mixings[] = {Mixing::kAverage, Mixing::kGeometricMean};
  bounces_ = random_.Chance(0.4);
  // Regimes of a whole scene: none, little, ordinary, large.
  const double frictions[] = {0.0, 0.05, 0.5, 3.0};
  friction_ = frictions[random_.Integer(0, 3)];
  // Coefficients that are all 0 are at a kink of every rule but the average.
  s.friction_mixing = mixings[friction_ > 0.0 || random_.Chance(0.2) ? random_.Integer(0, 1) : 0];
  s.restitution_mixing = mixings[bounces_ || random_.Chance(0.2) ? random_.Integer(0, 1) : 0];
  if (random_.Chance(0.3)) {
    scene_.gravity = Vector2<double>(U(-4.0, 4.0), U(-12.0, -6.0));
  }
  s.recovery_speed = random_.Chance(0.3) ? U(0.2, 1.0) : 3.0;
}

BasicShape<double> SceneMaker::Polygon() {
  BasicShape<double> shape{ShapeType::kPolygon, {}};
  const int corners = random_.Integer(3, 6);
  const double radius = U(0.1, 0.2);
  const double turn = U(0.0, 2.0 * kPi);
  for (int i = 0; i < corners; ++i) {
    const double angle = turn + (i + U(-0.15, 0.15)) * 2.0 * kPi / corners;
    shape.numbers.push_back(radius * std::cos(angle));
    shape.numbers.push_back(radius * std::sin(angle));
  }
  return shape;
}

BasicShape<double> SceneMaker::Shape() {
  switch (random_.Integer(0, 3)) {
    case 0:
      return {ShapeType::kCircle, {U(0.08, 0.2)}};
    case 1:
      return {ShapeType::kBox, {U(0.15, 0.4), U(0.15, 0.35)}};
    case 2:
      return {ShapeType::kCapsule, {U(0.1, 0.25), U(0.06, 0.12)}};
    default:
      return Polygon();
  }
}

BasicBody<double> SceneMaker::Body(const std::string& name) {
  BasicBody<double> body;
  body.name = name + std::to_string(scene_.bodies.size());
  body.shape = Shape();
  body.mass = U(0.3, 3.0);
  if (body.shape.type == ShapeType::kPolygon || random_.Chance(0.4)) {
    body.inertia = body.mass * U(0.005, 0.02);
  }
  body.friction = Friction();
  body.restitution = Restitution();
  if (random_.Chance(0.2)) {
    body.linear_damping = U(0.05, 0.5);
  }
  if (random_.Chance(0.2)) {
    body.angular_damping = U(0.001, 0.01);
  }
  return body;
}

void SceneMaker::Floor() {
  BasicBody<double> floor;
  floor.name = "floor";
  floor.motion = Motion::kStatic;
  floor.friction = Friction();
  floor.restitution = Restitution();
  level_ = random_.Chance(0.6);
  slope_ = level_ ? 0.0 : U(-0.4, 0.4);
  const double kind = U(0.0, 1.0);
  if (kind < 0.5) {
    const double length = random_.Chance(0.5) ? 1.0 : U(0.5, 2.0);
    floor.shape = {ShapeType::kHalfPlane,
                   {-length * std::sin(slope_), length * std::cos(slope_), 0.0}};
    if (level_) {
      floor.shape.numbers = {0.0, length, 0.0};
    }
    if (random_.Chance(0.2)) {
      floor.motion = Motion::kKinematic;
      const double speed = U(-1.0, 1.0);
      floor.velocity = Vector2<double>(speed * std::cos(slope_), speed * std::sin(slope_));
    }
  } else {
    floor.angle = slope_;
    floor.position = Vector2<double>(0.25 * std::sin(slope_), -0.25 * std::cos(slope_));
    floor.shape = kind < 0.8 ? BasicShape<double>{ShapeType::kBox, {20.0, 0.5}}
                             : BasicShape<double>{ShapeType::kPolygon,
                                                  {-9.0, -0.3, 9.0, -0.3, 10.0, 0.25, -10.0, 0.25}};
  }
  scene_.bodies.push_back(floor);
}
Vector2<double> SceneMaker::FloorPoint(double along) const {
  return Vector2<double>(along * std::cos(slope_), along * std::sin(slope_));
}

Vector2<double> SceneMaker::Up() const {
  return Vector2<double>(-std::sin(slope_), std::cos(slope_));
}

Vector2<double> SceneMaker::Along() const {
  return Vector2<double>(std::cos(slope_), std::sin(slope_));
}

void SceneMaker::FreeBody() {
  BasicBody<double> body = Body("body");
  const int kind = random_.Integer(0, 5);
  double height = HalfHeight(body.shape);
  body.angle = slope_;
  if (kind == 0 && (body.shape.type != ShapeType::kPolygon)) {
    // The body is at rest, exactly so on a level floor.
  } else if (kind == 1) {
    const double speed = U(-2.0, 2.0);
    body.velocity = Along() * speed;
    body.angular_velocity = body.shape.type == ShapeType::kCircle ? U(-8.0, 8.0) : 0.0;
  } else if (kind == 2) {
    height -= U(0.0, 0.02);
    body.velocity = Along() * U(-1.0, 1.0);
  } else {
    const double rise = U(0.0, 0.06);
    body.angle += U(-0.6, 0.6);
    height = 0.0;
    const double radius = 0.5 * std::hypot(0.42, 0.42);
    height = std::min(radius, HalfHeight(body.shape) * 1.5) + rise;
    const Vector2<double> velocity = Along() * U(-2.0, 2.0) + Up() * U(-3.0, 0.5);
    body.velocity = velocity;
    body.angular_velocity = U(-4.0, 4.0);
  }
  if (last_free_ >= 0 && random_.Chance(0.3)) {
    // Above its neighbour, onto which it falls.
    const BasicBody<double>& below = scene_.bodies[last_free_];
    body.position = below.position + Up() * (0.32 + U(0.0, 0.15)) + Along() * U(-0.1, 0.1);
    body.velocity = below.velocity - Up() * U(0.0, 2.0);
  } else {
    body.position = FloorPoint(next_column_) + Up() * height;
    next_column_ += random_.Chance(0.3) ? 0.46 : kColumn;
  }
  last_free_ = static_cast<int>(scene_.bodies.size());
  scene_.bodies.push_back(body);
}

void SceneMaker::Obstacles() {
  // If a paddle presses a body against a wall, or presses a body that friction holds, the problem
  // has no solution.
  const bool paddle_fits = friction_ <= 0.5;
  if (paddle_fits && random_.Chance(0.4)) {
    BasicBody<double> paddle;
    paddle.name = "paddle";
    paddle.motion = Motion::kKinematic;
    paddle.shape = random_.Chance(0.5) ? BasicShape<double>{ShapeType::kBox, {0.1, 0.5}}
                                       : BasicShape<double>{ShapeType::kCapsule, {0.3, 0.06}};
    paddle.position = FloorPoint(-0.35) + Up() * 0.3;
    paddle.angle = slope_ + U(-0.3, 0.3);
    paddle.velocity = Along() * U(0.3, 2.0);
    paddle.angular_velocity = U(-1.0, 1.0);
    paddle.friction = Friction();
    paddle.restitution = Restitution();
    scene_.bodies.push_back(paddle);
  }
  if (scene_.bodies.back().name != "paddle" && random_.Chance(0.5)) {
    BasicBody<double> wall;
    wall.name = "wall";
    wall.motion = Motion::kStatic;
    wall.shape = random_.Chance(0.4) ? BasicShape<double>{ShapeType::kBox, {0.2, 1.0}} : Shape();
    wall.position = FloorPoint(next_column_ - 0.2) + Up() * 0.1;
    wall.angle = U(-0.5, 0.5);
    wall.friction = Friction();
    wall.restitution = Restitution();
    scene_.bodies.push_back(wall);
  }
}

}  // namespace internal

Scene RandomScene(unsigned seed, const RandomSceneOptions& options) {
  return internal::SceneMaker(seed, options).Make();
}

}  // namespace tangible
