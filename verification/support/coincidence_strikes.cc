// SPDX-License-Identifier: Apache-2.0
//
// Coincidences of impacts with friction, by Newton's law and in Poisson's two phases, and of the
// end of a face.
#include <cmath>

#include "tangible/verification/support/coincidence_maker.h"
#include "tangible/verification/support/reference_planar.h"

namespace tangible::internal {
namespace {

constexpr double kFaceTop = 20.0;  // m: above what may be fallen through in a run

// The motion of a box that strikes a wall, from the scene's numbers.
struct CornerStrike {
  StruckBox known;
  Real duration;
  std::string body, wall;

  PlanarMotion At(const NumberAt& at, Real* clearance = nullptr) const {
    StruckBox now = known;
    now.mass = at(body + "mass");
    now.inertia = at(body + "inertia");
    now.face = at(wall + "position/x") - 0.5L;
    now.friction = 0.5L * (at(body + "friction") + at(wall + "friction"));
    now.surface.restitution = 0.5L * (at(body + "restitution") + at(wall + "restitution"));
    PlanarMotion start;
    start.x = {at(body + "position/x"), at(body + "velocity/x")};
    start.y = {at(body + "position/y"), at(body + "velocity/y")};
    start.turn = {at(body + "angle"), at(body + "angular_velocity")};
    return StrikeWall(start, now, duration, clearance);
  }
};

}  // namespace

void CoincidenceMaker::SlipEndsInAnImpact() {
  JumpsAt();
  NameLaw();
  BasicBody<double>& disc = AddDisc();
  const std::string name = disc.name;
  const double friction = Pick({0.1, 0.2, 0.5});
  const double restitution = Pick({0.5, 0.25, 1.0});
  const double speed = count_ == 0 ? -1.0 : Pick({0.0, -1.0, -0.5});
  const double approach = gravity_ * at_ - speed;
  // The slip falls by three times friction's share of the normal speed's change: it ends with the
  // compression, or with the impact.
  const double phase = random_.Chance(0.5) ? 1.0 : 1.0 + restitution;
  // It is fast: away from another body.
  const double away = number_ == 0 ? -1.0 : 1.0;
  disc.angular_velocity = away * Pick({0.0, 2.0});
  disc.velocity = Vector2<double>(
      away * 3.0 * friction * phase * approach - disc.angular_velocity * disc.shape.numbers[0],
      speed);
  disc.position.y() += 0.5 * gravity_ * at_ * at_ - speed * at_;
  AddPair(name, friction, restitution);
  MayLandAtTheEnd(approach);
  RollDisc(name);
}

void CoincidenceMaker::StrikesAtACorner() {
  if (course_.stepping == Stepping::kFixed) {  // a step may reach the wall with two corners
    HitsAWall();
    return;
  }
  JumpsAt();
  NameLaw();
  BasicBody<double> box;
  box.name = Named("box");
  box.shape = {ShapeType::kBox, {Pick({0.4, 0.2}), 0.1}};
  box.mass = Pick({1.0, 2.0});
  box.inertia = Pick({0.02, 0.1});
  box.position = Vector2<double>(place_, 0.0);
  box.velocity = Vector2<double>(Pick({1.0, 2.0, 0.5}), mirror_ * Pick({0.0, 0.5, -0.25}));
  box.angular_velocity = mirror_ * Pick({0.0, 0.0, 1.0});
  const double angle = mirror_ * Pick({0.5, 1.0, 0.25});  // in the impact
  box.angle = angle - box.angular_velocity * at_;
  box.restitution = Pick({0.5, 0.8, 1.0});
  box.friction = Pick({0.0, 0.25, 0.5});
  const Vector2<double> half(0.5 * box.shape.numbers[0], 0.5 * box.shape.numbers[1]);
  const double reach = half.x() * std::abs(std::cos(angle)) + half.y() * std::abs(std::sin(angle));
  made_.scene.bodies.push_back(box);
  AddWall("wall", 0, place_ + box.velocity.x() * at_ + reach);
  made_.scene.bodies.back().friction = box.friction;
  CornerStrike strike;
  strike.known.half_width = half.x();
  strike.known.half_height = half.y();
  strike.known.law = made_.scene.simulation.impact_law;
  strike.duration = course_.duration;
  strike.body = "bodies/" + box.name + "/";
  strike.wall = "bodies/" + Named("wall") + "/";
  for (const char* what : {"velocity/x", "velocity/y", "mass", "inertia", "angular_velocity"}) {
    paths_.push_back(strike.body + what);
  }
  if (box.friction > 0.0) paths_.push_back(strike.body + "friction");
  if (box.restitution < 1.0) paths_.push_back(strike.body + "restitution");
  if (count_ > 0) {
    paths_.push_back(strike.body + "position/x");
    paths_.push_back(strike.body + "angle");
    paths_.push_back(strike.wall + "position/x");
  }
  KeepClear(strike.body, [strike](const NumberAt& at) {
    Real clearance = 0.0L;
    strike.At(at, &clearance);
    return clearance > 0.0L;
  });
  parts_.emplace_back([strike](const NumberAt& at) {
    const PlanarMotion end = strike.At(at);
    return std::vector<Real>{end.x.position, end.y.position, end.turn.position,
                             end.x.speed,    end.y.speed,    end.turn.speed};
  });
}

void CoincidenceMaker::LeavesAFace() {
  BasicBody<double>& disc = AddDisc();
  const std::string body = "bodies/" + disc.name + "/";
  const double radius = disc.shape.numbers[0];
  // Faster than √(g r): it leaves the corner at once.
  const double speed = Pick({2.0, 3.0});
  // Not at the height of another ledge, onto which it would pass.
  const double top = kFaceTop * (1.0 + number_);
  disc.position.y() = top + radius;
  disc.velocity.x() = mirror_ * speed;
  BasicBody<double> ledge;
  ledge.name = Named("ledge");
  ledge.motion = Motion::kStatic;
  ledge.shape = {ShapeType::kBox, {10.0, 0.5}};
  // By fixed steps it passes the edge within a step: where two features tie as a step starts, the
  // engine's derivative of either side is that of one of them.
  const bool is_within = course_.stepping == Stepping::kFixed;
  const double leaves = at_ + (is_within ? 0.5 * made_.scene.simulation.dt : 0.0);
  const double edge = place_ + mirror_ * speed * leaves;
  ledge.position = Vector2<double>(edge - 5.0 * mirror_, top - 0.25);
  made_.scene.bodies.push_back(ledge);
  const std::string face = "bodies/" + ledge.name + "/position/x";
  paths_.push_back(face);
  parts_.emplace_back([=, course = course_, side = mirror_](const NumberAt& at) {
    const Real radius_now = at(body + "shape/radius");
    const PlanarMotion end = SlideOffFace(
        {side * at(body + "position/x"), side * at(body + "velocity/x")}, {radius_now, 0.0L},
        radius_now, side * at(face) + 5.0L, -at("gravity/y"), Surface(), course);
    return std::vector<Real>{side * end.x.position, top + end.y.position, 0.0L,
                             side * end.x.speed,    end.y.speed,          0.0L};
  });
}

}  // namespace tangible::internal
