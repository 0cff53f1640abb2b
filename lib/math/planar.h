// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Planar vectors: rotation, cross products, poses. SI units; x right, y up; angles in radians,
// counter-clockwise. Pose order (x, y, angle), twist order (vx, vy, omega).

#include <cmath>

#include "tangible/math/scalar.h"

namespace tangible {

/// a × b = a_x b_y − a_y b_x, the out-of-plane component.
template <typename T>
T Cross(const Vector2<T>& a, const Vector2<T>& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// The vector turned by +90°: (−y, x); ω Perp(r) is the velocity of r at angular velocity ω.
template <typename T>
Vector2<T> Perp(const Vector2<T>& a) {
  return Vector2<T>(-a.y(), a.x());
}

/// A rotation by an angle, its sine and cosine computed once.
template <typename T>
struct Rotation {
  T cosine;
  T sine;

  Rotation() : cosine(1.0), sine(0.0) {}
  explicit Rotation(const T& angle) {
    using std::cos;
    using std::sin;
    cosine = cos(angle);
    sine = sin(angle);
  }
  /// R v.
  Vector2<T> operator*(const Vector2<T>& v) const {
    return Vector2<T>(cosine * v.x() - sine * v.y(), sine * v.x() + cosine * v.y());
  }
  /// Rᵀ v.
  Vector2<T> Inverse(const Vector2<T>& v) const {
    return Vector2<T>(cosine * v.x() + sine * v.y(), cosine * v.y() - sine * v.x());
  }
};

/// Position (m) of a body's origin, which is its centre of mass, and its orientation.
template <typename T>
struct Pose {
  Vector2<T> position;
  T angle;
  Rotation<T> rotation;

  Pose() : position(T(0.0), T(0.0)), angle(0.0) {}
  Pose(const Vector2<T>& p, const T& a) : position(p), angle(a), rotation(a) {}

  /// A point of the body frame, in the world.
  Vector2<T> operator*(const Vector2<T>& point) const { return position + rotation * point; }
  /// A point of the world, in the body frame.
  Vector2<T> Inverse(const Vector2<T>& point) const {
    return rotation.Inverse(Vector2<T>(point - position));
  }
};

}  // namespace tangible
