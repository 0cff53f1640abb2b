// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/random_starts.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

class StartMaker {
 public:
  StartMaker(unsigned seed, Stepping stepping)
      : random_(0x57a127ULL + 0x9e3779b97f4a7c15ULL * seed) {
    scene_.name = "start " + std::to_string(seed);
    scene_.simulation.stepping = stepping;
  }

  Scene Make() {
    Settings();
    Floor();
    switch (random_.Integer(0, 5)) {
      case 0:
      case 1:
        Rod();
        break;
      case 2:
        BoxOnACorner();
        break;
      case 3:
        FlatBox();
        break;
      case 4:
        Disc();
        break;
      default:
        Ladder();
    }
    if (random_.Chance(0.25)) {
      SecondBody();
    }
    Tilt();
    return scene_;
  }

 private:
  double U(double low, double high) { return random_.Uniform(low, high); }
  double Sign() { return random_.Chance(0.5) ? 1.0 : -1.0; }

  void Settings() {
    SimulationSettings& s = scene_.simulation;
    const double steps[] = {0.0002, 0.0005, 0.001, 0.005};
    s.dt = steps[random_.Integer(0, 3)];
    s.duration = s.dt * random_.Integer(3, 12);
    const double kind = U(0.0, 1.0);
    const double law = U(0.0, 1.0);
    slope_ = random_.Chance(0.3) ? U(-0.4, 0.4) : 0.0;
    if (s.stepping == Stepping::kEvent) {
      s.integrator = kind < 0.6 ? Integrator::kRungeKutta4 : Integrator::kTrapezoidal;
      s.impact_law = law < 0.25 ? ImpactLaw::kPoisson : ImpactLaw::kNewton;
    }
  }

  void Floor() {
    BasicBody<double> floor;
    floor.name = "floor";
    floor.motion = Motion::kStatic;
    floor.shape = {ShapeType::kHalfPlane, {0.0, 1.0, 0.0}};
    if (random_.Chance(0.2)) {
      floor.motion = Motion::kKinematic;
      floor.velocity = Vector2<double>(U(-1.0, 1.0), 0.0);
    }
    scene_.bodies.push_back(floor);
  }

  BasicBody<double> Body(const BasicShape<double>& shape, double inertia_of_mass) {
    BasicBody<double> body;
    body.name = "body";
    body.shape = shape;
    body.mass = U(0.3, 3.0);
    body.inertia = body.mass * inertia_of_mass * U(0.7, 1.2);
    body.restitution = random_.Chance(0.3) ? U(0.2, 0.8) : 0.0;
    return body;
  }

  // Coefficients of all bodies, as mixing keeps them.
  void SetFriction(double friction) {
    for (BasicBody<double>& body : scene_.bodies) {
      body.friction = friction;
    }
  }

  // Draws a slip of the contact at the arm r and a rotation, and sets the twist that neither opens
  // nor closes the contact.
  void SetTwist(const Vector2<double>& r, BasicBody<double>* body) {
    const double slip = random_.Chance(0.2) ? 0.0 : Sign() * U(0.3, 3.0);
    const double turn = random_.Chance(0.5) ? 0.0 : Sign() * U(0.2, 6.0);
    body->angular_velocity = turn;
    body->velocity =
        Vector2<double>(scene_.bodies[0].velocity.x() + slip + turn * r.y(), -turn * r.x());
  }

  // Draws friction around the coefficient at which a slip jams, which depends only on the bodies'
  // arms.
  double FrictionAt(const Vector2<double>& r, const BasicBody<double>& body) {
    const double normal = 1.0 / body.mass + r.x() * r.x() / *body.inertia;
    const double mixed = std::abs(r.x() * r.y()) / *body.inertia;
    const double critical = mixed > 1e-3 * normal ? normal / mixed : 2.0;
    const double shares[] = {U(0.1, 0.8), U(0.9, 0.99), U(1.01, 1.1), U(1.2, 3.0)};
    return std::min(critical * shares[random_.Integer(0, 3)], 20.0);
  }

  void Stand(BasicBody<double> body, const Vector2<double>& r) {
    body.position = Vector2<double>(0.0, -r.y());
    SetTwist(r, &body);
    const double friction = FrictionAt(r, body);
    scene_.bodies.push_back(std::move(body));
    SetFriction(friction);
  }

  // After a rotation, the arm to the lowest point of the shape with these ends (or corners) and
  // radius.
  static Vector2<double> Lowest(const std::vector<Vector2<double>>& points, double angle,
                                double radius) {
    Vector2<double> lowest(0.0, HUGE_VAL);
    for (const Vector2<double>& point : points) {
      const double c = std::cos(angle);
      const double s = std::sin(angle);
      const Vector2<double> turned(c * point.x() - s * point.y(), s * point.x() + c * point.y());
      if (turned.y() < lowest.y()) lowest = turned;
    }
    return lowest - Vector2<double>(0.0, radius);
  }

  void Rod() {
    const double length = U(0.5, 1.5);
    const double radius = U(0.001, 0.03);
    BasicBody<double> rod = Body({ShapeType::kCapsule, {length, radius}}, length * length / 12.0);
    rod.angle = Sign() * U(0.4, 1.35);
    const Vector2<double> end(0.5 * length, 0.0);
    Stand(rod, Lowest({end, Vector2<double>(-end)}, rod.angle, radius));
  }

  void BoxOnACorner() {
    const double width = U(0.2, 1.0);
    const double height = U(0.02, 0.4);
    BasicBody<double> box =
        Body({ShapeType::kBox, {width, height}}, (width * width + height * height) / 12.0);
    box.angle = Sign() * U(0.3, 1.2);
    std::vector<Vector2<double>> corners;
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        corners.emplace_back(x * width, y * height);
      }
    }
    Stand(box, Lowest(corners, box.angle, 0.0));
  }

  void FlatBox() {
    const double width = U(0.1, 0.5);
    const double height = U(0.1, 0.8);
    BasicBody<double> box =
        Body({ShapeType::kBox, {width, height}}, (width * width + height * height) / 12.0);
    const double friction = FrictionAt(Vector2<double>(0.5 * width, -0.5 * height), box);
    box.position = Vector2<double>(0.0, 0.5 * height);
    const double slip = random_.Chance(0.3) ? 0.0 : Sign() * U(0.3, 3.0);
    box.velocity = Vector2<double>(scene_.bodies[0].velocity.x() + slip, 0.0);
    scene_.bodies.push_back(std::move(box));
    SetFriction(friction);
  }

  void Disc() {
    const double radius = U(0.05, 0.3);
    BasicBody<double> disc = Body({ShapeType::kCircle, {radius}}, 0.5 * radius * radius);
    Stand(disc, Vector2<double>(0.0, -radius));
  }

  // Its foot slides away from a wall, or towards it, or it rests.
  void Ladder() {
    const double length = U(0.5, 1.5);
    const double radius = U(0.002, 0.03);
    const double angle = U(0.4, 1.2);
    const Vector2<double> half(0.5 * length * std::cos(angle), -0.5 * length * std::sin(angle));
    BasicBody<double> rod = Body({ShapeType::kCapsule, {length, radius}}, length * length / 12.0);
    rod.angle = -angle;
    rod.position = Vector2<double>(radius + half.x(), radius - half.y());
    rod.angular_velocity = random_.Chance(0.3) ? 0.0 : Sign() * U(0.2, 3.0);
    rod.velocity =
        Vector2<double>(-rod.angular_velocity * half.y(), -rod.angular_velocity * half.x());
    BasicBody<double> wall;
    wall.name = "wall";
    wall.motion = Motion::kStatic;
    wall.shape = {ShapeType::kHalfPlane, {1.0, 0.0, 0.0}};
    scene_.bodies[0].motion = Motion::kStatic;
    scene_.bodies[0].velocity = Vector2<double>(0.0, 0.0);
    const double friction = random_.Chance(0.5) ? U(0.05, 0.6) : FrictionAt(half, rod);
    scene_.bodies.push_back(std::move(rod));
    scene_.bodies.push_back(std::move(wall));
    SetFriction(friction);
  }

  // A box that rests or slides beside the first, or a disc on top of a flat box.
  void SecondBody() {
    const BasicBody<double> first = scene_.bodies[1];
    const bool on_top = first.shape.type == ShapeType::kBox && first.angle == 0.0;
    BasicBody<double> body = on_top ? Body({ShapeType::kCircle, {0.1}}, 0.005)
                                    : Body({ShapeType::kBox, {0.4, 0.2}}, 0.2 / 12.0);
    body.name = "second";
    body.position = on_top
                        ? Vector2<double>(first.position.x(),
                                          first.position.y() + 0.5 * first.shape.numbers[1] + 0.1)
                        : Vector2<double>(3.0, 0.1);
    body.velocity = on_top ? first.velocity : Vector2<double>(U(-1.0, 1.0), 0.0);
    body.friction = scene_.bodies[0].friction;
    scene_.bodies.push_back(std::move(body));
  }

  // Rotates the whole scene, but not gravity.
  void Tilt() {
    const double c = std::cos(slope_);
    const double s = std::sin(slope_);
    const auto turn = [&](Vector2<double>* x) {
      *x = Vector2<double>(c * x->x() - s * x->y(), s * x->x() + c * x->y());
    };
    for (BasicBody<double>& body : scene_.bodies) {
      turn(&body.position);
      turn(&body.velocity);
      if (body.shape.type == ShapeType::kHalfPlane) {
        Vector2<double> normal(body.shape.numbers[0], body.shape.numbers[1]);
        turn(&normal);
        body.shape.numbers = {normal.x(), normal.y(), 0.0};
      } else {
        body.angle += slope_;
      }
    }
  }

  RandomNumbers random_;
  Scene scene_;
  double slope_ = 0.0;
};

}  // namespace

Scene RandomStart(unsigned seed, Stepping stepping) { return StartMaker(seed, stepping).Make(); }

std::vector<ParameterPath> StartParameters(const Scene& scene) {
  std::vector<std::string> paths = {"gravity/y", "bodies/*/friction"};
  for (const BasicBody<double>& body : scene.bodies) {
    if (body.motion != Motion::kMoving) continue;
    for (const char* what : {"velocity/x", "velocity/y", "angular_velocity"}) {
      paths.push_back("bodies/" + body.name + "/" + what);
    }
    for (const char* what : {"position/x", "angle", "mass"}) {
      if (body.name == "body") paths.push_back("bodies/" + body.name + "/" + what);
    }
  }
  std::vector<ParameterPath> parameters;
  for (const std::string& path : paths) {
    std::string error;
    ParameterPath parameter;
    if (ResolveParameter(scene, path, &parameter, &error)) {
      parameters.push_back(std::move(parameter));
    }
  }
  return parameters;
}

}  // namespace tangible
