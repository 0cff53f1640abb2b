// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Areas and their moments, for any scalar; r radius, a, b semi-axes, L length between cap centres,
// w, h sides, and over a polygon's edges c_i = v_i × v_{i+1}:
//   circle   A = π r²                 I/m = r²/2
//   ellipse  A = π a b                I/m = (a² + b²)/4
//   box      A = w h                  I/m = (w² + h²)/12
//   capsule  A = r (2 L + π r)        I/m = (L (L² + 4 r²)/6 + π r³/2 + 4 L r²/3 + π r L²/4)
//                                           / (2 L + π r)
//   polygon  A = Σ c_i / 2            I/m = Σ c_i (v_i·v_i + v_i·v_{i+1} + v_{i+1}·v_{i+1})
//                                           / (6 Σ c_i)
// The capsule is a rectangle and two half discs, whose first moment about their diameter is 2 r³/3
// each; divided by r it holds for a thin rod too.

#include <numbers>

#include "tangible/geometry/mass_properties.h"

namespace tangible::internal {

/// Σ c, Σ c (v + v'), Σ c (v·v + v·v' + v'·v') over a polygon's edges.
template <typename T>
struct PolygonSums {
  T cross;
  Vector2<T> first;
  T second;
};

template <typename T>
PolygonSums<T> SumPolygon(const ShapeView<T>& shape) {
  PolygonSums<T> sums{T(0.0), Vector2<T>(T(0.0), T(0.0)), T(0.0)};
  const int num_vertices = NumVertices(shape.type, shape.num_numbers);
  for (int i = 0; i < num_vertices; ++i) {
    const Vector2<T> v = Vertex(shape, i);
    const Vector2<T> w = Vertex(shape, i + 1 == num_vertices ? 0 : i + 1);
    const T cross = Cross(v, w);
    sums.cross += cross;
    sums.first += Vector2<T>(cross * (v.x() + w.x()), cross * (v.y() + w.y()));
    sums.second += cross * (v.x() * v.x() + v.y() * v.y() + v.x() * w.x() + v.y() * w.y() +
                            w.x() * w.x() + w.y() * w.y());
  }
  return sums;
}

}  // namespace tangible::internal

namespace tangible {

template <typename T>
T Area(const ShapeView<T>& shape) {
  switch (shape.type) {
    case ShapeType::kCircle:
      return std::numbers::pi * shape.numbers[0] * shape.numbers[0];
    case ShapeType::kBox:
      return shape.numbers[0] * shape.numbers[1];
    case ShapeType::kEllipse:
      return std::numbers::pi * shape.numbers[0] * shape.numbers[1];
    case ShapeType::kCapsule:
      return shape.numbers[1] * (2.0 * shape.numbers[0] + std::numbers::pi * shape.numbers[1]);
    case ShapeType::kPolygon:
      return 0.5 * internal::SumPolygon(shape).cross;
    default:
      return T(0.0);
  }
}

template <typename T>
Vector2<T> Centroid(const ShapeView<T>& shape) {
  if (shape.type != ShapeType::kPolygon) {
    return Vector2<T>(T(0.0), T(0.0));
  }
  const internal::PolygonSums<T> sums = internal::SumPolygon(shape);
  const T scale = 3.0 * sums.cross;
  return Vector2<T>(sums.first.x() / scale, sums.first.y() / scale);
}

template <typename T>
T UniformInertia(const ShapeView<T>& shape, const T& mass) {
  const T* const numbers = shape.numbers;
  switch (shape.type) {
    case ShapeType::kCircle:
      return 0.5 * mass * numbers[0] * numbers[0];
    case ShapeType::kBox:
      return mass * (numbers[0] * numbers[0] + numbers[1] * numbers[1]) / 12.0;
    case ShapeType::kEllipse:
      return 0.25 * mass * (numbers[0] * numbers[0] + numbers[1] * numbers[1]);
    case ShapeType::kCapsule: {
      const T& length = numbers[0];
      const T& radius = numbers[1];
      const T rectangle = length * (length * length + 4.0 * radius * radius) / 6.0;
      const T discs = 0.5 * std::numbers::pi * radius * radius * radius +
                      4.0 / 3.0 * length * radius * radius +
                      0.25 * std::numbers::pi * radius * length * length;
      return mass * (rectangle + discs) / (2.0 * length + std::numbers::pi * radius);
    }
    case ShapeType::kPolygon: {
      const internal::PolygonSums<T> sums = internal::SumPolygon(shape);
      return mass * sums.second / (6.0 * sums.cross);
    }
    default:
      return T(0.0);
  }
}

}  // namespace tangible
