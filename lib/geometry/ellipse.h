// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The nearest points of an ellipse and another shape, which is an ellipse or a point (the centre of
// a circle, a corner, an end of a capsule).
//
// With the support function h of a convex shape and its support point x,
//   h(n) = max over its points p of n·p,
//   ellipse with semi-axes a, b along body x, y:   m = Rᵀ n,
//     h = √(a² m_x² + b² m_y²),   x = R (a² m_x, b² m_y) / h,   ρ = a² b² / h³          (1)
// (ρ: the radius of curvature at x), the distance of two shapes with the offset d from the second
// one's centre to the first one's is the largest separation over all unit directions n,
//   s(n) = n·w,   w = d + x_a(−n) − x_b(n),                                              (2)
// in penetration as well, where it is minus the depth. With n = n(φ), t = dn/dφ:
//   s' = t·w,   s'' = −(s + ρ_a + ρ_b),                                                  (3)
// and a direction with s' = 0, s'' < 0 is that of a nearest pair of points (or of least depth). The
// root of s' has no closed form and is found in double. Two Newton steps from there in T make the
// value and the derivatives up to the third order exact, because each step doubles the order of the
// derivatives that are exact.

#include "tangible/geometry/shape.h"

namespace tangible::internal {

/// The rotation and the semi-axes of a shape; those of a point are 0.
struct RoundShape {
  double axes[2] = {0.0, 0.0};  ///< m
  Rotation<double> rotation;
};

/// The unit direction of the largest separation (2), from the second shape to the first; `apart` =
/// d, m. Where all directions have the same separation (two circles about one centre) it is (0, 1).
Vector2<double> SeparatingDirection(const RoundShape& a, const RoundShape& b,
                                    const Vector2<double>& apart);

/// Whether −s'' is so small that the direction has no derivative, because both shapes have the same
/// centre of curvature. `size`: m, of both shapes and their distance.
bool IsUnbent(double bend, double size);

}  // namespace tangible::internal
