// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/contacts_ahead.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/dynamics/model/tolerances.h"
#include "tangible/geometry/tolerances.h"

namespace tangible {

Pose<double> PoseAfter(const State<double>& state, int body, double time) {
  const double* pose = &state.pose[3 * body];
  const double* twist = &state.twist[3 * body];
  return Pose<double>(Vector2<double>(pose[0] + time * twist[0], pose[1] + time * twist[1]),
                      pose[2] + time * twist[2]);
}

ContactsAhead FindContactsAhead(const Model<double>& model, const State<double>& state,
                                const ActiveContact& contact, double approach, double size,
                                double tolerance, double slow) {
  ContactsAhead ahead;
  const double time = (std::max(contact.gap, 0.0) + kCorner * size) / -approach;
  const int a = contact.a;
  const int b = contact.b;
  ContactFeature features[2];
  const int count =
      FindFeatures(model, a, PoseAfter(state, a, time), b, PoseAfter(state, b, time),
                   contact.Parts(), std::numeric_limits<double>::infinity(), features);
  for (int k = 0; k < count; ++k) {
    ActiveContact& next = ahead.contacts[k];
    next = contact;
    next.feature = features[k];
    ContactRows<double> rows;
    EvaluateContactRows(model, state, next, &rows);
    next.gap = rows.geometry.gap;
    ahead.speed[k] = RelativeSpeed(state, a, rows.normal_a, b, rows.normal_b);
    if (!(std::abs(next.gap) <= tolerance && ahead.speed[k] > approach + slow)) {
      return ContactsAhead();
    }
  }
  ahead.count = count;
  return ahead;
}

bool HaveCorners(const ModelStructure& structure, const ActiveContact& contact) {
  const auto has = [&](int body) {
    const ShapeType shape = structure.bodies[body].shape;
    return shape != ShapeType::kCircle && shape != ShapeType::kHalfPlane &&
           shape != ShapeType::kSpline;
  };
  return has(contact.a) && has(contact.b);
}

bool PassesBy(const Model<double>& model, const State<double>& state, const ActiveContact& contact,
              double approach, double size, double slow) {
  const double time = (std::max(contact.gap, 0.0) + kCorner * size) / -approach;
  const double past = kCorner * size / -approach;
  const auto speed = [&](int body) {
    const double* twist = &state.twist[3 * body];
    return std::hypot(twist[0], twist[1]) + size * std::abs(twist[2]);
  };
  // What comes down slowly is beside something else by then.
  if (past * (speed(contact.a) + speed(contact.b)) > kBesideCorner * size) return false;
  const Pose<double> pose_a = PoseAfter(state, contact.a, time);
  const Pose<double> pose_b = PoseAfter(state, contact.b, time);
  ContactFeature features[2];
  const int count = FindFeatures(model, contact.a, pose_a, contact.b, pose_b, contact.Parts(),
                                 std::numeric_limits<double>::infinity(), features);
  for (int k = 0; k < count; ++k) {
    ActiveContact next = contact;
    next.feature = features[k];
    if (next.SameAs(contact)) return false;
    ContactRows<double> rows;
    EvaluateContactRows(model, pose_a, pose_b, next, &rows);
    // A step up of more than kFlushStep is a wall, however low.
    if (rows.geometry.gap < -kFlushStep ||
        RelativeSpeed(state, contact.a, rows.normal_a, contact.b, rows.normal_b) < -slow) {
      return false;
    }
  }
  // Behind the end of a run of an outline nothing of it is near.
  return true;
}

}  // namespace tangible
