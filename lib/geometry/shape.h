// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Shapes in the body frame, as vertices with a radius.
//
// Every shape but the half-plane and the ellipse is a convex core (a point, a segment or a polygon,
// counter-clockwise) grown by a radius: circle = point, capsule = segment, box and polygon have
// radius 0. The half-plane is solid where n·r ≤ d, with n = normal / |normal|, d = offset /
// |normal|. An ellipse is a point, its centre, grown by a radius that depends on the direction
// (ellipse.h). A polyline is no core: its edges bound a solid to the left of the way along its
// points (outline.h); where it is closed the first point is repeated at the end. A spline is a
// smooth curve through its points and bounds a solid in the same way (curve.h); the second
// derivatives at all points follow after the points.

#include "tangible/math/planar.h"
#include "tangible/math/scalar.h"
#include "tangible/math/shape_type.h"

namespace tangible {

/// A view of the parameters of a shape, in the order that BasicShape has for each type. Functions
/// read only the parameters that they need, so that unused ones may be uninitialised (local Jets
/// rely on it).
template <typename T>
struct ShapeView {
  ShapeType type = ShapeType::kNone;
  const T* numbers = nullptr;
  int num_numbers = 0;
};

/// The number of vertices of the core: 1 of a circle or ellipse, 2 of a capsule, 4 of a box, n of a
/// polygon, polyline or spline; 0 of a half-plane and of no shape.
inline int NumVertices(ShapeType type, int num_numbers) {
  switch (type) {
    case ShapeType::kCircle:
    case ShapeType::kEllipse:
      return 1;
    case ShapeType::kCapsule:
      return 2;
    case ShapeType::kBox:
      return 4;
    case ShapeType::kPolygon:
    case ShapeType::kPolyline:
      return num_numbers / 2;
    case ShapeType::kSpline:
      return num_numbers / 4;
    default:
      return 0;
  }
}

/// Vertex i of the core in the body frame, counter-clockwise. The first vertex of a box is its
/// lower left corner, that of a capsule the centre of the cap at −x.
template <typename T>
Vector2<T> Vertex(const ShapeView<T>& shape, int i) {
  switch (shape.type) {
    case ShapeType::kBox: {
      const double sign_x = (i == 1 || i == 2) ? 0.5 : -0.5;
      const double sign_y = (i >= 2) ? 0.5 : -0.5;
      return Vector2<T>(sign_x * shape.numbers[0], sign_y * shape.numbers[1]);
    }
    case ShapeType::kCapsule:
      return Vector2<T>((i == 0 ? -0.5 : 0.5) * shape.numbers[0], T(0.0));
    case ShapeType::kPolygon:
    case ShapeType::kPolyline:
    case ShapeType::kSpline:
      return Vector2<T>(shape.numbers[2 * i], shape.numbers[2 * i + 1]);
    default:
      return Vector2<T>(T(0.0), T(0.0));
  }
}

/// The radius by which the core is grown; 0 for an ellipse, whose radius is not constant.
template <typename T>
T CoreRadius(const ShapeView<T>& shape) {
  switch (shape.type) {
    case ShapeType::kCircle:
      return shape.numbers[0];
    case ShapeType::kCapsule:
      return shape.numbers[1];
    default:
      return T(0.0);
  }
}

/// Whether the core is grown by a radius, so that its corners are round.
inline bool IsRound(const ShapeView<double>& shape) {
  return shape.type == ShapeType::kEllipse || CoreRadius(shape) > 0.0;
}

}  // namespace tangible
