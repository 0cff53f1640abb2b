// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/reference_planar.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tangible {
namespace {

constexpr int kNewtonSteps = 50;
constexpr int kSamples = 400;  // of the clearance

void Free(Real time, PlanarMotion* body) {
  for (Coordinate* one : {&body->x, &body->y, &body->turn}) one->position += time * one->speed;
}

// A corner of the box, from the centre.
struct Corner {
  Real x, y;
};

Corner CornerAt(const StruckBox& box, int i, Real angle) {
  const Real x = (i & 1) != 0 ? box.half_width : -box.half_width;
  const Real y = (i & 2) != 0 ? box.half_height : -box.half_height;
  return {cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y};
}

Real GapAt(const StruckBox& box, int i, const PlanarMotion& body) {
  return box.face - body.x.position - CornerAt(box, i, body.turn.position).x;
}

int Foremost(const StruckBox& box, const PlanarMotion& body) {
  int foremost = 0;
  for (int i = 1; i < 4; ++i) {
    if (GapAt(box, i, body) < GapAt(box, foremost, body)) foremost = i;
  }
  return foremost;
}

// When the corner meets the wall, by Newton's method; not before 0.
Real TouchesAfter(const StruckBox& box, int i, const PlanarMotion& start) {
  Real time = 0.0L;
  for (int step = 0; step < kNewtonSteps; ++step) {
    PlanarMotion body = start;
    Free(time, &body);
    const Corner arm = CornerAt(box, i, body.turn.position);
    time += GapAt(box, i, body) / (body.x.speed - body.turn.speed * arm.y);
  }
  return std::max(time, Real());
}

// The relative speeds of the contact of a corner at `arm` are
//   u_n = −vx + ω arm.y,   u_t = vy + ω arm.x
// and impulses (λn, λt) change them by W λ.
struct SingleContact {
  Real nn, nt, tt;       // W
  Real normal, tangent;  // u
  Real friction;

  Real FrictionOf(Real normal_impulse) const {
    const Real most = friction * normal_impulse;
    return std::clamp(-(tangent + nt * normal_impulse) / tt, -most, most);
  }
};

struct ContactImpulse {
  Real normal = 0.0L, tangent = 0.0L;
};

// u_n⁺ ≥ target ⊥ λn ≥ least, with Coulomb's friction.
ContactImpulse Resolve(const SingleContact& contact, Real target, Real least) {
  const ContactImpulse first = {least, contact.FrictionOf(least)};
  if (contact.normal + contact.nn * first.normal + contact.nt * first.tangent >= target) {
    return first;
  }
  const Real up = target - contact.normal;
  const Real determinant = contact.nn * contact.tt - contact.nt * contact.nt;
  const ContactImpulse sticks = {(contact.tt * up + contact.nt * contact.tangent) / determinant,
                                 (-contact.nt * up - contact.nn * contact.tangent) / determinant};
  if (abs(sticks.tangent) <= contact.friction * sticks.normal) return sticks;
  for (const Real side : {1.0L, -1.0L}) {
    const Real normal = up / (contact.nn - side * contact.friction * contact.nt);
    const Real tangent = -side * contact.friction * normal;
    const Real slip = contact.tangent + contact.nt * normal + contact.tt * tangent;
    if (normal >= 0.0L && side * slip >= 0.0L) return {normal, tangent};
  }
  return sticks;
}

SingleContact ContactAt(const StruckBox& box, Corner arm, const PlanarMotion& body) {
  return {1.0L / box.mass + arm.y * arm.y / box.inertia, arm.y * arm.x / box.inertia,
          1.0L / box.mass + arm.x * arm.x / box.inertia, -body.x.speed + body.turn.speed * arm.y,
          body.y.speed + body.turn.speed * arm.x,        box.friction};
}

void Push(const StruckBox& box, Corner arm, const ContactImpulse& impulse, PlanarMotion* body) {
  body->x.speed -= impulse.normal / box.mass;
  body->y.speed += impulse.tangent / box.mass;
  body->turn.speed += (arm.y * impulse.normal + arm.x * impulse.tangent) / box.inertia;
}

void Impact(const StruckBox& box, Corner arm, PlanarMotion* body) {
  const SingleContact before = ContactAt(box, arm, *body);
  const Real e = before.normal < -box.surface.threshold ? box.surface.restitution : 0.0L;
  if (box.law == ImpactLaw::kNewton) {
    Push(box, arm, Resolve(before, -e * before.normal, Real()), body);
    return;
  }
  const ContactImpulse compression = Resolve(before, 0.0L, Real());
  Push(box, arm, compression, body);
  Push(box, arm, Resolve(ContactAt(box, arm, *body), 0.0L, e * compression.normal), body);
}

Real ClearanceOf(const StruckBox& box, PlanarMotion body, Real left) {
  Real least = std::numeric_limits<long double>::infinity();
  if (left <= 0.0L) return least;
  Free(0.1L * left, &body);
  for (int sample = 0; sample <= kSamples; ++sample) {
    least = std::min(least, GapAt(box, Foremost(box, body), body));
    Free(0.9L * left / kSamples, &body);
  }
  return least;
}

}  // namespace

PlanarMotion StrikeWall(PlanarMotion start, const StruckBox& box, Real duration, Real* clearance) {
  PlanarMotion body = start;
  Real touches = std::numeric_limits<long double>::infinity();
  int corner = 0;
  for (int i = 0; i < 4; ++i) {
    const Real after = TouchesAfter(box, i, start);
    if (after < touches) corner = i;
    touches = std::min(touches, after);
  }
  const Real time = std::min(touches, duration);
  Free(time, &body);
  if (touches <= duration) Impact(box, CornerAt(box, corner, body.turn.position), &body);
  if (clearance != nullptr) *clearance = ClearanceOf(box, body, duration - time);
  Free(duration - time, &body);
  return body;
}

PlanarMotion SlideOffFace(Coordinate along, Coordinate above, Real radius, Real edge, Real gravity,
                          const Surface& surface, const Course& course) {
  if (course.stepping == Stepping::kEvent) {
    const Real leaves = (edge - along.position) / along.speed;
    const Real falls = std::max(course.duration - std::max(leaves, Real()), Real());
    along.position += course.duration * along.speed;
    above.position -= 0.5L * gravity * falls * falls;
    above.speed -= gravity * falls;
    return {along, above, {}};
  }
  for (int k = 0; k < course.steps; ++k) {
    const Real h = course.StepEnd(k + 1) - course.StepEnd(k);
    const Real beyond = std::max(along.position - edge, Real());
    const Real distance = hypot(beyond, above.position);
    const Real n_x = beyond / distance;
    const Real n_y = above.position / distance;
    const Real before = n_x * along.speed + n_y * above.speed;
    above.speed -= gravity * h;
    const Real free = n_x * along.speed + n_y * above.speed;
    const Real target = LeastSpeed({distance - radius, before}, free, h, surface);
    const Real change = std::max(target - free, Real());
    along.speed += n_x * change;
    above.speed += n_y * change;
    along.position += h * along.speed;
    above.position += h * above.speed;
  }
  return {along, above, {}};
}

}  // namespace tangible
