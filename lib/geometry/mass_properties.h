// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Area, centroid and moment of inertia of uniform shapes, in the body frame.

#include "tangible/geometry/shape.h"

namespace tangible {

/// m²; of shapes with an area (not kNone, not kHalfPlane).
template <typename T>
T Area(const ShapeView<T>& shape);

/// m, body frame.
template <typename T>
Vector2<T> Centroid(const ShapeView<T>& shape);

/// kg m² about the frame's origin (the centre of mass) of the uniform shape of this mass (kg).
template <typename T>
T UniformInertia(const ShapeView<T>& shape, const T& mass);

/// The largest distance of a surface point from the frame's origin, m; infinite for a half-plane.
double BoundingRadius(const ShapeView<double>& shape);

}  // namespace tangible
