// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/random_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace tangible {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kColumn = 0.7;  // m, between places where bodies start

// A body's half height above a level floor, as drawn at angle 0 (or a bound of it).
double HalfHeight(const BasicShape<double>& shape) {
  switch (shape.type) {
    case ShapeType::kCircle:
      return shape.numbers[0];
    case ShapeType::kBox:
      return 0.5 * shape.numbers[1];
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

class SceneMaker {
 public:
  SceneMaker(unsigned seed, const RandomSceneOptions& options)
      : random_(0x7a6e67ULL + 0x9e3779b97f4a7c15ULL * seed), options_(options) {
    scene_.name = "random " + std::to_string(seed);
  }

  Scene Make() {
    Settings();
    Floor();
    const int bodies = random_.Integer(1, options_.max_bodies);
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
    return scene_;
  }

 private:
  double U(double low, double high) { return random_.Uniform(low, high); }

  void Settings() {
    SimulationSettings& s = scene_.simulation;
    const double steps[] = {0.002, 0.005, 0.01, 0.02};
    s.dt = steps[random_.Integer(0, 3)];
    const double length = U(0.0, 1.0);
    const int short_run = std::min(40, options_.max_steps);
    const int count = length < 0.08   ? random_.Integer(1, 2)
                      : length < 0.92 ? random_.Integer(std::min(5, short_run), short_run)
                                      : random_.Integer(short_run, options_.max_steps);
    // Every fifth run ends within a step.
    s.duration = s.dt * (random_.Chance(0.2) ? count - 0.4 : count);
    const JointCorrection corrections[] = {JointCorrection::kNone, JointCorrection::kBaumgarte,
                                           JointCorrection::kProjection};
    s.joint_correction = corrections[random_.Integer(0, 2)];
    const Mixing mixings[] = {Mixing::kAverage, Mixing::kGeometricMean, Mixing::kMinimum,
                              Mixing::kMaximum};
    bounces_ = random_.Chance(0.4);
    // Regimes of a whole scene: none, little, ordinary, large.
    const double frictions[] = {0.0, 0.05, 0.5, 3.0};
    friction_ = frictions[random_.Integer(0, 3)];
    // Coefficients that are all 0 are at a kink of every rule but the average.
    s.friction_mixing = mixings[friction_ > 0.0 || random_.Chance(0.2) ? random_.Integer(0, 3) : 0];
    s.restitution_mixing = mixings[bounces_ || random_.Chance(0.2) ? random_.Integer(0, 3) : 0];
    if (random_.Chance(0.3)) {
      scene_.gravity = Vector2<double>(U(-4.0, 4.0), U(-12.0, -6.0));
    }
    s.recovery_speed = random_.Chance(0.3) ? U(0.2, 1.0) : 3.0;
  }

  double Friction() { return friction_ * (random_.Chance(0.1) ? 1.0 : U(0.7, 1.3)); }
  double Restitution() { return bounces_ ? (random_.Chance(0.1) ? 0.5 : U(0.2, 0.9)) : 0.0; }

  BasicShape<double> Polygon() {
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

  BasicShape<double> Shape() {
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

  BasicBody<double> Body(const std::string& name) {
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

  // The floor: a half-plane (tilted or not, its normal not unit), a box or a polygon; static, or a
  // conveyor. floor_ is its height at x = 0 and slope_ its angle.
  void Floor() {
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
      floor.shape = kind < 0.8
                        ? BasicShape<double>{ShapeType::kBox, {20.0, 0.5}}
                        : BasicShape<double>{ShapeType::kPolygon,
                                             {-9.0, -0.3, 9.0, -0.3, 10.0, 0.25, -10.0, 0.25}};
    }
    scene_.bodies.push_back(floor);
  }

  // The point of the floor's surface below column `column`, and the way up from it.
  Vector2<double> FloorPoint(double along) const {
    return Vector2<double>(along * std::cos(slope_), along * std::sin(slope_));
  }
  Vector2<double> Up() const { return Vector2<double>(-std::sin(slope_), std::cos(slope_)); }
  Vector2<double> Along() const { return Vector2<double>(std::cos(slope_), std::sin(slope_)); }

  // On or above the floor: at rest, sliding, about to land, in penetration, or thrown; or on top of
  // the last one.
  void FreeBody() {
    BasicBody<double> body = Body("body");
    const int kind = random_.Integer(0, 5);
    double height = HalfHeight(body.shape);
    body.angle = slope_;
    if (kind == 0 && (body.shape.type != ShapeType::kPolygon)) {
      // At rest, exactly so on a level floor.
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

  std::string JointName() const { return "joint" + std::to_string(scene_.joints.size()); }

  void Finish(BasicJoint<double>* joint, bool in_tree) {
    joint->name = JointName();
    const bool turns = joint->type == JointType::kRevolute;
    if (turns || joint->type == JointType::kPrismatic) {
      joint->damping = random_.Chance(0.4) ? U(0.01, 0.1) : 0.0;
      joint->effort = random_.Chance(0.3) ? U(-1.0, 1.0) : 0.0;
      if (random_.Chance(0.35)) {
        joint->limits = {random_.Chance(0.5) ? U(-0.03, 0.0) : -0.3, U(0.01, 0.3)};
      }
      if (in_tree && random_.Chance(0.5)) {
        const double reach = joint->limits ? 0.005 : 0.3;
        joint->angle = U(0.0, reach) * (turns ? 1.0 : 0.2);
        joint->rate = U(-1.5, 1.5);
      }
    }
    scene_.joints.push_back(*joint);
  }

  JointType AnyType() {
    const JointType types[] = {JointType::kRevolute, JointType::kPrismatic, JointType::kWeld,
                               JointType::kDistance, JointType::kFixedAngle};
    return random_.Chance(0.4) ? JointType::kRevolute : types[random_.Integer(0, 4)];
  }

  // A chain (a tree) that hangs from the world, from a kinematic body, or lies free above the
  // floor; its lower end may reach the floor.
  int Chain(int links) {
    const bool hangs = random_.Chance(0.75);
    int parent = -1;
    const double x = -1.2;
    const double top = hangs ? U(0.5, 0.9) : 0.45;
    if (hangs && random_.Chance(0.25)) {
      parent = Carrier(x, top + 0.1);
    }
    const double turn = U(-1.2, 1.2);
    Vector2<double> end = FloorPoint(x) + Vector2<double>(0.0, top);
    const Vector2<double> direction(std::sin(turn), -std::cos(turn));
    // Links of one joint overlap, and could not part.
    if (links > 1) {
      scene_.no_contact.emplace_back("link*", "link*");
    }
    int count = 0;
    for (; count < links; ++count) {
      BasicBody<double> link = Body("link");
      const double length = 0.24;
      link.shape = random_.Chance(0.5) ? BasicShape<double>{ShapeType::kBox, {0.05, length}}
                                       : BasicShape<double>{ShapeType::kCircle, {0.07}};
      link.angle = turn;
      link.position = end + 0.5 * length * direction;
      const int index = static_cast<int>(scene_.bodies.size());
      scene_.bodies.push_back(link);
      if (count > 0 || hangs) {
        BasicJoint<double> joint;
        joint.type = AnyType();
        joint.bodies[0] = index;
        joint.bodies[1] = parent;
        joint.anchors[0] = end;
        joint.anchors[1] = end - 0.3 * direction + Vector2<double>(0.05, 0.02);
        joint.axis = Vector2<double>(U(-1.0, 1.0), U(0.2, 1.0));
        Finish(&joint, true);
      }
      // A tree branches now and then.
      parent = random_.Chance(0.8) || parent < 0 ? index : parent;
      end += length * direction * (parent == index ? 1.0 : 0.1);
    }
    return count;
  }

  // A kinematic body without a shape.
  int Carrier(double x, double y) {
    BasicBody<double> body;
    body.name = "carrier";
    body.motion = Motion::kKinematic;
    body.position = FloorPoint(x) + Vector2<double>(0.0, y);
    body.velocity = Vector2<double>(U(-0.5, 0.5), U(-0.5, 0.5));
    body.angular_velocity = U(-1.0, 1.0);
    scene_.bodies.push_back(body);
    return static_cast<int>(scene_.bodies.size()) - 1;
  }

  void LoopJoint(JointType type, int a, int b, const Vector2<double>& at) {
    BasicJoint<double> joint;
    joint.type = type;
    joint.bodies[0] = a;
    joint.bodies[1] = b;
    joint.anchors[0] = at;
    Finish(&joint, false);
  }

  // A closed four-bar linkage that hangs from the world, or two bodies pinned twice, whose rows are
  // redundant. Returns how many bodies it took.
  int Loop() {
    const Vector2<double> at = FloorPoint(2.5) + Vector2<double>(0.0, 1.0);
    const auto bar = [&](const Vector2<double>& from, const Vector2<double>& to) {
      BasicBody<double> body = Body("bar");
      const Vector2<double> reach = to - from;
      body.shape = {ShapeType::kCapsule, {0.8 * reach.norm(), 0.03}};
      body.position = 0.5 * (from + to);
      body.angle = std::atan2(reach.y(), reach.x());
      scene_.bodies.push_back(body);
      return static_cast<int>(scene_.bodies.size()) - 1;
    };
    // Drift makes redundant rows contradict each other under Baumgarte's correction.
    const bool redundant =
        scene_.simulation.joint_correction != JointCorrection::kBaumgarte && random_.Chance(0.4);
    if (redundant) {
      const int first = bar(at, at + Vector2<double>(0.3, 0.0));
      const int second = bar(at + Vector2<double>(0.0, -0.2), at + Vector2<double>(0.3, -0.15));
      LoopJoint(JointType::kRevolute, first, second, at + Vector2<double>(0.05, -0.1));
      LoopJoint(JointType::kRevolute, first, second, at + Vector2<double>(0.25, -0.1));
      LoopJoint(JointType::kRevolute, first, -1, at);
      return 2;
    }
    const Vector2<double> b = at + Vector2<double>(U(-0.1, 0.1), -0.3);
    const Vector2<double> c = at + Vector2<double>(0.4, U(-0.4, -0.2));
    const Vector2<double> d = at + Vector2<double>(U(0.3, 0.5), 0.05);
    const int first = bar(at, b);
    const int second = bar(b, c);
    const int third = bar(c, d);
    LoopJoint(JointType::kRevolute, first, -1, at);
    LoopJoint(JointType::kRevolute, second, first, b);
    LoopJoint(JointType::kRevolute, third, second, c);
    LoopJoint(JointType::kRevolute, third, -1, d);
    return 3;
  }

  // A kinematic paddle that moves into the bodies, a static bump or a wall.
  void Obstacles() {
    // A paddle that presses a body against a wall, or one that friction holds, asks for what cannot
    // be.
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

  int AnyMoving() {
    int body = -1;
    while (body < 0 || scene_.bodies[body].motion != Motion::kMoving) {
      body = random_.Integer(0, static_cast<int>(scene_.bodies.size()) - 1);
    }
    return body;
  }

  void Springs() {
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

  void Forces() {
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
        force.force_signal = AnySignal(dt);
      }
      scene_.forces.push_back(force);
    }
  }

  Signal AnySignal(double dt) {
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

  int CountNamed(const std::string& start) const {
    int count = 0;
    for (const BasicBody<double>& body : scene_.bodies) {
      count += body.name.rfind(start, 0) == 0 ? 1 : 0;
    }
    return count;
  }

  void Pairs() {
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

  RandomNumbers random_;
  const RandomSceneOptions options_;
  Scene scene_;
  bool level_ = true;
  bool bounces_ = false;
  double slope_ = 0.0;
  double friction_ = 0.0;
  double next_column_ = 0.0;
  int last_free_ = -1;
};

}  // namespace

Scene RandomScene(unsigned seed, const RandomSceneOptions& options) {
  return SceneMaker(seed, options).Make();
}

}  // namespace tangible
