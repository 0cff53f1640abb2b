// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/coordinate_watch.h"

#include <cmath>
#include <cstdio>

#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {

void CoordinateWatch::Look(const State<double>& state, double time, int a, int b) {
  const double size = lengths_.Size(a, b);
  const double rounding = lengths_.Rounding(state, a, b);
  // Values that are not finite are reported by the step itself.
  if (!(rounding > rounding_ * size) || size == 0.0 || !std::isfinite(rounding)) return;
  rounding_ = rounding / size;
  size_ = size;
  body_ = lengths_.Coordinate(state, a, a) >= lengths_.Coordinate(state, b, b) ? a : b;
  distance_ = std::hypot(state.pose[3 * body_], state.pose[3 * body_ + 1]);
  angle_ = state.pose[3 * body_ + 2];
  time_ = time;
}

void CoordinateWatch::LookAtContacts(const State<double>& state, double time,
                                     const std::vector<ActiveContact>& contacts) {
  for (const ActiveContact& contact : contacts) {
    Look(state, time, contact.a, contact.b);
  }
}

void CoordinateWatch::LookAtJoints(const Model<double>& model, const State<double>& state,
                                   double time) {
  for (const JointIndex& joint : model.structure->joints) {
    Look(state, time, joint.a, joint.b);
  }
}

void CoordinateWatch::LookAtBodies(const Model<double>& model, const State<double>& state,
                                   double time) {
  for (const int body : model.structure->moving) {
    Look(state, time, body, body);
  }
}

std::string CoordinateWatch::Message(const Model<double>& model) const {
  if (!(rounding_ > kLargeCoordinates)) return "";
  const bool turned = std::abs(angle_) * lengths_.size(body_) > distance_;
  char where[64];
  std::snprintf(where, sizeof where,
                turned ? "has turned by %.3g rad" : "is %.3g m from the origin",
                turned ? angle_ : distance_);
  char text[256];
  std::snprintf(
      text, sizeof text,
      " at t = %.4g s, where gaps and joints round to %.2g m, more than 1e-7 of the "
      "smaller body's size (%.2g m): expected %s",
      time_, rounding_ * size_, size_,
      turned ? "an angle without its whole turns" : "an origin of the scene near its bodies");
  return "coordinates are too large: body " + model.structure->bodies[body_].name + " " + where +
         text;
}

}  // namespace tangible
