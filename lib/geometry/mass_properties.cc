// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "tangible/geometry/mass_properties_inl.h"
#include "tangible/geometry/spline_inl.h"

namespace tangible {

double BoundingRadius(const ShapeView<double>& shape) {
  if (shape.type == ShapeType::kHalfPlane) {
    return std::numeric_limits<double>::infinity();
  }
  if (shape.type == ShapeType::kEllipse) {
    return std::fmax(shape.numbers[0], shape.numbers[1]);
  }
  const int num_vertices = NumVertices(shape.type, shape.num_numbers);
  double square = 0.0;
  for (int i = 0; i < num_vertices; ++i) {
    square = std::fmax(square, Vertex(shape, i).squaredNorm());
  }
  for (int i = 0; shape.type == ShapeType::kSpline && i + 1 < num_vertices; ++i) {
    for (const Vector2<double>& point : ControlPointsOf(internal::PieceOf(shape, i))) {
      square = std::fmax(square, point.squaredNorm());
    }
  }
  return std::sqrt(square) + CoreRadius(shape);
}

#define TANGIBLE_INSTANTIATE_SCALAR(T)               \
  template T Area(const ShapeView<T>&);              \
  template Vector2<T> Centroid(const ShapeView<T>&); \
  template T UniformInertia(const ShapeView<T>&, const T&);
#define TANGIBLE_INSTANTIATE(N) TANGIBLE_INSTANTIATE_SCALAR(Jet<N>)
TANGIBLE_INSTANTIATE_SCALAR(double)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE)
#undef TANGIBLE_INSTANTIATE
#undef TANGIBLE_INSTANTIATE_SCALAR

}  // namespace tangible
