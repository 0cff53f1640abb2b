// SPDX-License-Identifier: Apache-2.0
//
// Springs, forces and pairs of random scenes.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "tangible/scene/coupling.h"
#include "tangible/scene/joint_graph.h"
#include "tangible/scene/validate.h"
#include "tangible/verification/support/random_scene_maker.h"

namespace tangible::internal {

int SceneMaker::AnyMoving() {
  int body = -1;
  while (body < 0 || scene_.bodies[body].motion != Motion::kMoving) {
    body = random_.Integer(0, static_cast<int>(scene_.bodies.size()) - 1);
  }
  return body;
}

void SceneMaker::Springs() {
  for (int i = 0; i < 2; ++i) {
    if (!random_.Chance(0.25)) {
      continue;
    }
    BasicSpring<double> spring;
    spring.name = "spring" + std::to_string(i);
    spring.bodies[0] = AnyMoving();
    const int other = AnyMoving();
    spring.bodies[1] = other == spring.bodies[0] ? -1 : other;
    const Vector2<double> offset(U(-0.05, 0.05), U(-0.05, 0.05));
    spring.anchors[0] = scene_.bodies[spring.bodies[0]].position + offset;
    spring.anchors[1] = spring.bodies[1] >= 0 ? scene_.bodies[spring.bodies[1]].position
                                              : Vector2<double>(U(-1.0, 1.0), 1.5);
    spring.stiffness = U(1.0, 40.0);
    spring.damping = random_.Chance(0.5) ? U(0.1, 1.0) : 0.0;
    spring.rest_length = U(0.1, 0.8);
    scene_.springs.push_back(spring);
  }
}

void SceneMaker::Forces() {
  const double dt = scene_.simulation.dt;
  for (int i = 0; i < 2; ++i) {
    if (!random_.Chance(0.3)) {
      continue;
    }
    BasicForce<double> force;
    force.name = "force" + std::to_string(i);
    force.body = AnyMoving();
    force.force = Vector2<double>(U(-8.0, 8.0), U(-4.0, 8.0));
    force.torque = random_.Chance(0.5) ? U(-0.3, 0.3) : 0.0;
    force.at = Vector2<double>(U(-0.05, 0.05), U(-0.05, 0.05));
    // Edges at fractions of a step: on its boundary the derivative has a kink.
    if (random_.Chance(0.7)) {
      force.start = dt * (random_.Integer(0, 3) + U(0.2, 0.8));
    }
    if (random_.Chance(0.7)) {
      force.end = dt * (random_.Integer(4, 12) + U(0.2, 0.8));
    }
    if (random_.Chance(0.2)) {
      force.force_signal = ForceSignal(dt);
    }
    scene_.forces.push_back(force);
  }
}

Signal SceneMaker::ForceSignal(double dt) {
  Signal signal;
  signal.file = "force.csv";
  signal.interpolation =
      random_.Chance(0.5) ? Signal::Interpolation::kConstant : Signal::Interpolation::kLinear;
  for (int k = 0; k < 5; ++k) {
    signal.time.push_back(dt * (3.3 * k + U(0.0, 1.0)));
    signal.x.push_back(U(-6.0, 6.0));
    signal.y.push_back(U(-6.0, 6.0));
  }
  return signal;
}

Signal SceneMaker::ValueSignal(double dt, double largest) {
  Signal signal;
  signal.file = "value.csv";
  signal.interpolation =
      random_.Chance(0.5) ? Signal::Interpolation::kConstant : Signal::Interpolation::kLinear;
  for (int k = 0; k < 5; ++k) {
    signal.time.push_back(dt * (3.3 * k + U(0.0, 1.0)));
    signal.value.push_back(U(-largest, largest));
  }
  return signal;
}

int SceneMaker::CountNamed(const std::string& start) const {
  int count = 0;
  for (const BasicBody<double>& body : scene_.bodies) {
    count += body.name.rfind(start, 0) == 0 ? 1 : 0;
  }
  return count;
}

void SceneMaker::Pairs() {
  if (random_.Chance(0.25)) {
    BasicPair<double> pair;
    pair.bodies[0] = "body*";
    pair.bodies[1] = random_.Chance(0.5) ? "floor" : "body*";
    if (random_.Chance(0.8)) {
      pair.friction = Friction();
    }
    if (random_.Chance(0.5) || !pair.friction) {
      pair.restitution = Restitution();
    }
    if (CountNamed("body") >= (pair.bodies[1] == "floor" ? 1 : 2)) {
      scene_.pairs.push_back(pair);
    }
  }
  if (random_.Chance(0.15) && CountNamed("link") > 0) {
    scene_.no_contact.emplace_back("link*", "*");
  }
}

void SceneMaker::Rarities() {
  const double dt = scene_.simulation.dt;
  for (BasicForce<double>& force : scene_.forces) {
    if (random_.Chance(0.15)) {
      force.torque_signal = ValueSignal(dt, 0.3);
    }
  }
  for (BasicJoint<double>& joint : scene_.joints) {
    if (joint.type == JointType::kPrismatic && random_.Chance(0.5)) {
      // Its own weight takes it there.
      joint.limits = {joint.angle - U(0.0005, 0.003), joint.angle + U(0.0005, 0.003)};
    }
    if (joint.effort != 0.0 && random_.Chance(0.25)) {
      joint.effort = 0.0;
      joint.effort_signal = ValueSignal(dt, 1.0);
    }
  }
  if (random_.Chance(0.04)) {
    scene_.gravity.setZero();
  }
}

void SceneMaker::Mechanisms() {
  if (seed_ % 4 != 0) {
    return;
  }
  RandomNumbers random(0x6d656368ULL + 0x9e3779b97f4a7c15ULL * seed_);
  for (BasicBody<double>& body : scene_.bodies) {
    if (body.motion == Motion::kMoving && random.Chance(0.4)) {
      body.quadratic_drag = random.Chance(0.1) ? 0.0 : random.Uniform(0.05, 1.0);
    }
  }
  for (BasicJoint<double>& joint : scene_.joints) {
    const bool has_coordinate =
        joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic;
    if (has_coordinate && random.Chance(0.4)) {
      joint.stiffness = random.Uniform(0.5, 20.0);
      joint.rest = random.Uniform(-0.2, 0.2);
    }
  }
  for (BasicJoint<double>& joint : scene_.joints) {
    const bool has_coordinate =
        joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic;
    if (has_coordinate && random.Chance(0.5)) {
      joint.friction = random.Chance(0.1) ? 0.0 : std::pow(10.0, random.Uniform(-2.0, 1.0));
      if (options_.stepping == Stepping::kEvent && random.Chance(0.5)) {
        joint.kinetic_friction = *joint.friction * random.Uniform(0.2, 1.1);
        joint.stribeck_speed = std::pow(10.0, random.Uniform(-1.0, 1.0));
      }
    }
  }
}

void SceneMaker::Drives() {
  if (seed_ % 4 != 2) {
    return;
  }
  RandomNumbers random(0x6d6f746fULL + 0x9e3779b97f4a7c15ULL * seed_);
  for (BasicJoint<double>& joint : scene_.joints) {
    const bool has_coordinate =
        joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic;
    if (has_coordinate && random.Chance(0.4)) {
      joint.motor = {random.Chance(0.2) ? 0.0 : random.Uniform(-3.0, 3.0),
                     random.Chance(0.1) ? 0.0 : std::pow(10.0, random.Uniform(-2.0, 1.0))};
    }
    if (joint.type == JointType::kDistance && random.Chance(0.6)) {
      const double length = (joint.anchors[0] - joint.anchors[1]).norm();
      joint.limits = {random.Chance(0.5) ? 0.0 : random.Uniform(0.5, 0.99) * length,
                      random.Chance(0.2) ? length : random.Uniform(1.0, 1.05) * length};
    }
    if (joint.limits && random.Chance(0.6)) {
      joint.limit_restitution = random.Uniform(0.0, 1.0);
      constexpr double kInfinity = std::numeric_limits<double>::infinity();
      if (random.Chance(0.2)) joint.limits->first = -kInfinity;
    }
  }
  for (BasicBody<double>& body : scene_.bodies) {
    if (options_.stepping == Stepping::kEvent && random.Chance(0.3)) {
      body.kinetic_friction = body.friction * random.Uniform(0.3, 1.0);
      body.stribeck_speed = std::pow(10.0, random.Uniform(-1.0, 1.0));
    }
  }
}

BasicServo<double> SceneMaker::Servo(double at, RandomNumbers* random) {
  BasicServo<double> servo;
  servo.target = at + random->Uniform(-0.5, 0.5);
  if (random->Chance(0.3)) {
    Signal& signal = servo.target_signal.emplace();
    signal.file = "target.csv";
    signal.interpolation =
        random->Chance(0.3) ? Signal::Interpolation::kConstant : Signal::Interpolation::kLinear;
    for (int k = 0; k < 4; ++k) {
      signal.time.push_back(scene_.simulation.dt * (4.3 * k + random->Uniform(0.0, 1.0)));
      signal.value.push_back(at + random->Uniform(-0.3, 0.3));
    }
  }
  servo.stiffness = std::pow(10.0, random->Uniform(-1.0, 1.5));
  servo.damping = random->Chance(0.3) ? 0.0 : std::pow(10.0, random->Uniform(-2.0, 0.0));
  if (random->Chance(0.6)) servo.limit = std::pow(10.0, random->Uniform(-1.0, 1.0));
  return servo;
}

void SceneMaker::Servos() {
  if (seed_ % 4 != 3) {
    return;
  }
  RandomNumbers random(0x73657276ULL + 0x9e3779b97f4a7c15ULL * seed_);
  for (BasicJoint<double>& joint : scene_.joints) {
    const bool has_coordinate =
        joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic;
    if (has_coordinate && random.Chance(0.4)) {
      joint.effort = 0.0;
      joint.effort_signal.reset();
      joint.effort_servo = Servo(joint.angle, &random);
    }
  }
  for (BasicForce<double>& force : scene_.forces) {
    const BasicBody<double>& body = scene_.bodies[force.body];
    for (int i = 0; i < 2 && !force.force_signal; ++i) {
      if (!random.Chance(0.3)) continue;
      force.force[i] = 0.0;
      force.force_servos[i] = Servo(body.position[i], &random);
    }
    if (!force.torque_signal && random.Chance(0.3)) {
      force.torque = 0.0;
      force.torque_servo = Servo(body.angle, &random);
    }
  }
}

void SceneMaker::Couplings() {
  if (seed_ % 4 != 1) {
    return;
  }
  RandomNumbers random(0x67656172ULL + 0x9e3779b97f4a7c15ULL * seed_);
  const std::vector<JointPlace> places = ClassifyJoints(scene_);
  const int count = static_cast<int>(scene_.joints.size());
  // A joint is part of one coupling at most, and those in loops, whose coordinates depend on each
  // other, of one with limits.
  for (int first = 0; first + 1 < count; ++first) {
    if (!random.Chance(0.5)) continue;
    BasicJoint<double> coupling;
    coupling.name = "gear" + std::to_string(first);
    coupling.type = JointType::kCoupling;
    coupling.coupled[0] = first;
    coupling.coupled[1] = first + 1;
    coupling.ratio = random.Uniform(0.3, 2.0) * (random.Chance(0.5) ? 1.0 : -1.0);
    if (!EndsOf(scene_, coupling).fault.empty()) continue;
    const auto in_tree = [&](int joint) { return places[joint] != JointPlace::kLoop; };
    const BasicJoint<double>& a = scene_.joints[first];
    const BasicJoint<double>& b = scene_.joints[first + 1];
    if (a.rate != 0.0 && b.rate != 0.0) coupling.ratio = -a.rate / b.rate;
    scene_.joints.push_back(coupling);
    BasicJoint<double>& added = scene_.joints.back();
    if (!in_tree(first) || !in_tree(first + 1) || random.Chance(0.4) ||
        !CoupledRatesFault(scene_, "").empty()) {
      // It may begin at one of them, but in a loop, whose other joints may leave it no way.
      const double at_one = in_tree(first) && in_tree(first + 1) ? 0.2 : 0.0;
      const double low = random.Chance(at_one) ? 0.0 : -random.Uniform(0.001, 0.02);
      const double high = low < 0.0 && random.Chance(at_one) ? 0.0 : random.Uniform(0.001, 0.02);
      added.limits = {low, high};
      if (random.Chance(0.5)) added.limit_restitution = random.Uniform(0.0, 1.0);
    }
    // Limits, which not all joints may have that can be kept.
    if (!EndsOf(scene_, added).fault.empty()) scene_.joints.pop_back();
    ++first;
  }
}

void SceneMaker::Ends() {
  if (seed_ % 4 != 1) {
    return;
  }
  RandomNumbers random(0x656e6473ULL + 0x9e3779b97f4a7c15ULL * seed_);
  for (BasicJoint<double>& joint : scene_.joints) {
    if (random.Chance(0.3)) joint.until = random.Uniform(0.05, 1.1) * scene_.simulation.duration;
  }
}

void SceneMaker::RollingFriction() {
  if (seed_ % 8 != 7) return;
  RandomNumbers random(0x726f6c6cULL + 0x9e3779b97f4a7c15ULL * seed_);
  for (BasicBody<double>& body : scene_.bodies) {
    if (body.shape.type == ShapeType::kNone || random.Chance(0.4)) continue;
    body.rolling_friction = 0.3 * std::pow(10.0, random.Uniform(-4.0, -1.0));
  }
}

void SceneMaker::Supports() {
  const bool by_events = options_.stepping == Stepping::kEvent;
  if (by_events ? seed_ % 16 != 10 : seed_ % 4 != 2) {
    return;
  }
  RandomNumbers random(0x73757070ULL + 0x9e3779b97f4a7c15ULL * seed_);
  for (BasicBody<double>& body : scene_.bodies) {
    if (body.motion != Motion::kMoving || !random.Chance(0.6)) continue;
    // Not of a mechanism, where a step whose friction does not settle is not rare.
    const int place = static_cast<int>(&body - scene_.bodies.data());
    const bool has_joint = std::any_of(
        scene_.joints.begin(), scene_.joints.end(),
        [&](const auto& joint) { return joint.bodies[0] == place || joint.bodies[1] == place; });
    if (has_joint) continue;
    BasicSupport<double>& support = body.support.emplace();
    // Gravity lies in the plane: from a body that it drags along to one that it cannot move.
    // By events the motions of a body that friction stops quickly are many.
    support.friction = std::pow(10.0, random.Uniform(-2.0, by_events ? -0.7 : 0.3));
    if (random.Chance(0.5) && !by_events) support.load = body.mass * random.Uniform(1.0, 20.0);
    const double size = random.Uniform(0.05, 0.3);
    if (random.Chance(0.3)) {
      support.radius = size;
    } else if (random.Chance(0.6)) {
      for (int k = random.Integer(1, 4); k > 0; --k) {
        support.points.emplace_back(random.Uniform(-size, size), random.Uniform(-size, size));
      }
      for (size_t k = 0; k < support.points.size() && support.points.size() > 2; ++k) {
        support.shares.push_back(random.Uniform(0.5, 2.0));
      }
    }
  }
}

void SceneMaker::Outlines() {
  if (seed_ % 4 != 1) {
    return;
  }
  RandomNumbers random(0x6f75746cULL + 0x9e3779b97f4a7c15ULL * seed_);
  for (BasicBody<double>& body : scene_.bodies) {
    // Not of a mechanism: what its joints hold in the floor asks for what cannot be.
    const bool is_free = body.name.rfind("body", 0) == 0 || body.name == "wall";
    if (!is_free || body.shape.type == ShapeType::kNone) {
      continue;
    }
    // As high as the shape was, so that what rests goes on resting.
    const double height = HalfHeight(body.shape);
    if (random.Chance(0.6)) {
      body.shape = {ShapeType::kEllipse, {height * random.Uniform(0.6, 1.8), height}};
    }
    if (random.Chance(0.4)) {
      for (int k = random.Integer(1, 2); k > 0; --k) {
        const double side = random.Chance(0.5) ? 1.0 : -1.0;
        body.contact_points.emplace_back(side * random.Uniform(0.5, 1.5) * height,
                                         random.Uniform(-1.1, 0.8) * height);
      }
    }
  }
}

namespace {

double HalfWidth(const BasicShape<double>& shape) {
  switch (shape.type) {
    case ShapeType::kBox:
      return 0.5 * shape.numbers[0];
    case ShapeType::kCapsule:
      return 0.5 * shape.numbers[0] + shape.numbers[1];
    case ShapeType::kPolygon: {
      double widest = 0.0;
      for (size_t i = 0; i < shape.numbers.size(); i += 2) {
        widest = std::max(widest, std::abs(shape.numbers[i]));
      }
      return widest;
    }
    default:
      return shape.numbers[0];
  }
}

// An angle, a trough, an arch or a star that is as low as a shape and no wider, with a level edge
// or feet there unless it is a star: a wider one might be wedged between others.
std::vector<double> ConcaveOutline(const BasicShape<double>& shape, RandomNumbers* random) {
  const double h = HalfHeight(shape);
  const double w = HalfWidth(shape) * random->Uniform(0.7, 1.0);
  const double t = std::min(h, w) * random->Uniform(0.4, 0.9);
  const double top = h * random->Uniform(0.6, 1.0);
  const int kind = random->Integer(0, 3);
  if (kind == 0) return {-w, -h, w, -h, w, t - h, t - w, t - h, t - w, top, -w, top};
  const double u = w * random->Uniform(0.3, 0.7);
  if (kind == 1) return {-w, -h, w, -h, w, top, u, top, u, t - h, -u, t - h, -u, top, -w, top};
  if (kind == 2) return {-w, -h, -u, -h, -u, t - h, u, t - h, u, -h, w, -h, w, top, -w, top};
  std::vector<double> star;
  const int points = random->Integer(3, 5);
  for (int i = 0; i < 2 * points; ++i) {
    // The first one is the lowest.
    const double radius = i % 2 == 1 ? h * random->Uniform(0.4, 0.6)
                                     : h * (i == 0 ? 1.0 : random->Uniform(0.8, 0.95));
    const double angle = std::numbers::pi * (i / static_cast<double>(points) - 0.5);
    star.push_back(w / h * radius * std::cos(angle));
    star.push_back(radius * std::sin(angle));
  }
  return star;
}

}  // namespace

void SceneMaker::ConcavePolygons() {
  if (seed_ % 8 != 7) {
    return;
  }
  RandomNumbers random(0x636f6e63ULL + 0x9e3779b97f4a7c15ULL * seed_);
  for (BasicBody<double>& body : scene_.bodies) {
    const bool is_free = body.name.rfind("body", 0) == 0 || body.name == "wall";
    if (!is_free || body.shape.type == ShapeType::kNone || !random.Chance(0.6)) {
      continue;
    }
    body.shape = {ShapeType::kPolygon, ConcaveOutline(body.shape, &random)};
    if (body.motion == Motion::kMoving) body.inertia = body.mass * random.Uniform(0.005, 0.02);
  }
}

// Its hills are as high as the floor was, so that nothing starts in it.
void SceneMaker::SplineFloor() {
  if (seed_ % 8 != 5) {
    return;
  }
  RandomNumbers random(0x73706c69ULL + 0x9e3779b97f4a7c15ULL * seed_);
  const auto floor = std::find_if(scene_.bodies.begin(), scene_.bodies.end(),
                                  [](const auto& body) { return body.name == "floor"; });
  if (floor == scene_.bodies.end() || !random.Chance(0.8)) return;
  const double depth = random.Uniform(0.01, 0.2);
  const double spacing = random.Uniform(0.2, 0.5);
  const double wave = spacing * random.Uniform(5.0, 9.0);
  floor->shape = {ShapeType::kSpline, {}};
  floor->shape.solid = SolidSide::kRight;
  const double phase = random.Uniform(0.0, 1.0);
  for (double at = -1.5; at < 4.5; at += spacing * random.Uniform(0.8, 1.2)) {
    const double height =
        -0.5 * depth * (1.0 - std::cos(2.0 * std::numbers::pi * (at / wave + phase)));
    const Vector2<double> point = FloorPoint(at) + Up() * height;
    floor->shape.numbers.insert(floor->shape.numbers.end(), {point.x(), point.y()});
  }
  floor->position.setZero();
  floor->angle = 0.0;
}

}  // namespace tangible::internal
