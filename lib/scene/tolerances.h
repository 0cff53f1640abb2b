// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of reading a scene. Each comment names the quantity of which the tolerance is a
// fraction, then the reason. The README has a table.

namespace tangible {

/// The sine of the turn, or area of the polygon over its extent squared: a corner of a polygon that
/// turns by less counts as straight, because it cannot be distinguished from rounding. A vertex
/// that is nearer to an edge than this share of the extent touches it.
inline constexpr double kStraightCorner = 1e-12;
/// Of the extent of a polygon: a centroid nearer to the origin counts as the origin, so that the
/// inertia about the origin is known.
inline constexpr double kCentred = 1e-9;
/// Of the larger radius of an ellipse: the smaller one is at least as large: beyond, the curvature
/// at its ends, of (b / a)² of its size, is below rounding.
inline constexpr double kSlenderEllipse = 1e-9;
/// Of the distance of a rope's ends: a rope that starts longer than its limit by less starts taut,
/// because lengths are written with rounding.
inline constexpr double kRopeRounding = 1e-9;
/// Of the sum of the magnitudes of the rates that a coupling adds: their sum may be off from 0 by
/// this much, because rates are written with rounding.
inline constexpr double kCoupledRates = 1e-9;
/// Of the larger of two rates of a path: they are equal to the rounding of its knots.
inline constexpr double kEqualRates = 1e-12;

}  // namespace tangible
