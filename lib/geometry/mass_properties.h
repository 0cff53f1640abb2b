// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Area, centroid and moment of inertia of uniform shapes, in the body frame.

#include "tangible/geometry/shape.h"

namespace tangible {

/// The area of a shape that has one (not kNone, not kHalfPlane), m².
template <typename T>
T Area(const ShapeView<T>& shape);

/// The centroid in the body frame, m.
template <typename T>
Vector2<T> Centroid(const ShapeView<T>& shape);

/// The moment of inertia, kg m², of a uniform shape with this mass (kg) about the frame's origin,
/// which is the centre of mass.
template <typename T>
T UniformInertia(const ShapeView<T>& shape, const T& mass);

/// The largest distance of a surface point from the frame's origin, m; infinite for a half-plane.
double BoundingRadius(const ShapeView<double>& shape);

}  // namespace tangible
