// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The lengths of which tolerances on gaps and joints are multiples: the size of the bodies of a
// pair, and the accuracy of their coordinates.
//
//   size        r = of the smaller body, m
//   coordinate  x = max(|x|, |y|, |angle| r) over both bodies, m
//   rounding    ρ = 64 ε x: what a gap or a joint's error of the pair may be off by, m
//   touching    1e-10 r + ρ
//
// A pose is stored to ε x / 2, and a gap is computed from poses by a few sums and products: the
// factor 64 leaves an order of magnitude of room. Where ρ > 1e-7 r no tolerance fits between
// rounding and the lengths that matter to the motion, and a run prints a warning
// (simulation/stepping/coordinate_watch.h).

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tangible/dynamics/model/model.h"
#include "tangible/dynamics/model/tolerances.h"
#include "tangible/geometry/broad_phase.h"

namespace tangible {

/// max(|x|, |y|) over two bodies, m.
template <typename T>
double PlaceOf(const State<T>& state, int a, int b) {
  double place = 0.0;
  for (const int body : {a, b}) {
    place = std::max({place, std::abs(ValueOf(state.pose[3 * body])),
                      std::abs(ValueOf(state.pose[3 * body + 1]))});
  }
  return place;
}

/// max |angle| over two bodies, rad.
template <typename T>
double AngleOf(const State<T>& state, int a, int b) {
  return std::max(std::abs(ValueOf(state.pose[3 * a + 2])),
                  std::abs(ValueOf(state.pose[3 * b + 2])));
}

/// The largest speed of a body's points within `radius` (m) of its centre of mass, m/s, at most.
inline double SpeedOf(const double* twist, double radius) {
  return std::sqrt(twist[0] * twist[0] + twist[1] * twist[1]) + std::abs(twist[2]) * radius;
}

/// The largest distance of a body's shape and contact points from its centre of mass, m; 0 of a
/// body without any. Half-planes are not counted.
double RadiusOf(const Model<double>& model, int body);

/// The box of a body's shape and contact points, grown by `margin`.
Aabb BoxOf(const Model<double>& model, int body, const Pose<double>& pose, double margin);

/// Whether row k of a joint's error is an angle, rad; else it is a length, m.
inline bool IsAngle(JointType type, int k) {
  return type == JointType::kFixedAngle || (type == JointType::kWeld && k == 2) ||
         (type == JointType::kPrismatic && k == 1);
}

/// The same of the joint itself: the error of a coupling is of the kind of its coordinate.
inline bool IsAngle(const JointIndex& joint, int k) {
  return joint.type == JointType::kCoupling ? joint.is_angular : IsAngle(joint.type, k);
}

class Lengths {
 public:
  explicit Lengths(const Model<double>& model);

  /// RadiusOf.
  double radius(int body) const { return radius_[body]; }
  /// The same, but √(3 I / m) of a moving body without a shape, which is half the length of a
  /// uniform rod with its mass and inertia. 0 of a body without any length.
  double size(int body) const { return size_[body]; }
  /// The smallest of these radii above 0, m; 1 where none is.
  double smallest_radius() const { return smallest_radius_; }

  /// r, m: the smaller of the two sizes, or the one that is above 0; 0 where neither is.
  double Size(int a, int b) const {
    return size_[a] > 0.0 && size_[b] > 0.0 ? std::min(size_[a], size_[b])
                                            : std::max(size_[a], size_[b]);
  }
  /// x, m.
  double Coordinate(const State<double>& state, int a, int b) const {
    return std::max({PlaceOf(state, a, b), std::abs(state.pose[3 * a + 2]) * size_[a],
                     std::abs(state.pose[3 * b + 2]) * size_[b]});
  }
  /// ρ, m.
  double Rounding(const State<double>& state, int a, int b) const {
    return kCoordinateRounding * Coordinate(state, a, b);
  }
  /// Gap below which two bodies touch, m.
  double Touch(const State<double>& state, int a, int b) const {
    return kTouchShare * Size(a, b) + Rounding(state, a, b);
  }
  /// Distance below which a joint is at its limit, rad, or m where it is a length.
  double LimitTouch(const State<double>& state, const JointIndex& joint) const {
    return !joint.is_angular ? Touch(state, joint.a, joint.b)
                             : kTouchAngle + kCoordinateRounding * AngleOf(state, joint.a, joint.b);
  }

 private:
  std::vector<double> radius_, size_;
  double smallest_radius_ = 1.0;
};

}  // namespace tangible
