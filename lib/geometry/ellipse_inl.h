// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Support points of ellipses and their contacts with round shapes, for any scalar; equations (1) to
// (3) of ellipse.h.

#include <algorithm>
#include <cmath>

#include "tangible/geometry/collide.h"
#include "tangible/geometry/ellipse.h"

namespace tangible::internal {

/// x and ρ of (1); for a vertex of a core, the vertex itself and 0.
template <typename T>
struct Support {
  Vector2<T> arm;  ///< m, world, from the body's position
  T bend;          ///< m
};

template <typename T>
Support<T> SupportOf(const ShapeView<T>& shape, const Pose<T>& pose, int vertex,
                     const Vector2<T>& direction) {
  using std::sqrt;
  if (shape.type != ShapeType::kEllipse) {
    return {pose.rotation * Vertex(shape, vertex), T(0.0)};
  }
  // Lengths are in units of the larger axis, so that squares neither overflow nor vanish, however
  // large the ellipse is.
  const T& a = shape.numbers[0];
  const T& b = shape.numbers[1];
  const T& scale = ValueOf(a) < ValueOf(b) ? b : a;
  const T ratio_a = a / scale;
  const T ratio_b = b / scale;
  const Vector2<T> m = pose.rotation.Inverse(direction);
  const T along_x = ratio_a * m.x();
  const T along_y = ratio_b * m.y();
  const T height = sqrt(along_x * along_x + along_y * along_y);
  const T curved = ratio_a * ratio_b / height;
  return {pose.rotation * Vector2<T>(a * along_x / height, b * along_y / height),
          scale * curved * curved / height};
}

template <typename T>
RoundShape RoundShapeOf(const ShapeView<T>& shape, const Pose<T>& pose) {
  RoundShape round;
  round.rotation.cosine = ValueOf(pose.rotation.cosine);
  round.rotation.sine = ValueOf(pose.rotation.sine);
  for (int i = 0; i < 2 && shape.type == ShapeType::kEllipse; ++i) {
    round.axes[i] = ValueOf(shape.numbers[i]);
  }
  return round;
}

/// An ellipse against an ellipse or a vertex. The offset d is that between the vertices of the
/// cores; the vertex of an ellipse is its centre.
template <typename T>
ContactGeometry<T> RoundAgainstRound(const ContactFeature& feature, const ShapeView<T>& shape_a,
                                     const Pose<T>& pose_a, const ShapeView<T>& shape_b,
                                     const Pose<T>& pose_b) {
  using std::sqrt;
  const Vector2<T> fixed_a = pose_a.rotation * Vertex(shape_a, feature.a);
  const Vector2<T> fixed_b = pose_b.rotation * Vertex(shape_b, feature.b);
  const Vector2<T> between(pose_a.position.x() - pose_b.position.x(),
                           pose_a.position.y() - pose_b.position.y());
  const RoundShape round_a = RoundShapeOf(shape_a, pose_a);
  const RoundShape round_b = RoundShapeOf(shape_b, pose_b);
  const Vector2<double> apart(ValueOf(between.x() + fixed_a.x() - fixed_b.x()),
                              ValueOf(between.y() + fixed_a.y() - fixed_b.y()));
  const double size = std::abs(apart.x()) + std::abs(apart.y()) + round_a.axes[0] +
                      round_a.axes[1] + round_b.axes[0] + round_b.axes[1];
  const Vector2<double> found = SeparatingDirection(round_a, round_b, apart);
  Vector2<T> normal(T(found.x()), T(found.y()));
  Support<T> at_a;
  T gap;
  for (int step = 0;; ++step) {
    at_a = SupportOf(shape_a, pose_a, feature.a, Vector2<T>(-normal.x(), -normal.y()));
    const Support<T> at_b = SupportOf(shape_b, pose_b, feature.b, normal);
    const Vector2<T> w(between.x() + at_a.arm.x() - at_b.arm.x(),
                       between.y() + at_a.arm.y() - at_b.arm.y());
    gap = normal.x() * w.x() + normal.y() * w.y();
    const T bend = gap + at_a.bend + at_b.bend;
    constexpr int kSteps = 2;
    if (step == kSteps || IsUnbent(ValueOf(bend), size)) {
      break;
    }
    const T turn = (normal.x() * w.y() - normal.y() * w.x()) / bend;
    const T norm = sqrt(1.0 + turn * turn);
    normal = Vector2<T>((normal.x() - turn * normal.y()) / norm,
                        (normal.y() + turn * normal.x()) / norm);
  }
  const T radius_a = CoreRadius(shape_a);
  ContactGeometry<T> result;
  result.normal = normal;
  result.gap = gap - radius_a - CoreRadius(shape_b);
  const T depth = radius_a + 0.5 * result.gap;
  result.point = Vector2<T>(pose_a.position.x() + at_a.arm.x() - normal.x() * depth,
                            pose_a.position.y() + at_a.arm.y() - normal.y() * depth);
  return result;
}

}  // namespace tangible::internal
