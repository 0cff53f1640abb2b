// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of reading a scene: of what each is a share, then why. The README has a table.

namespace tangible {

/// The sine of the turn, or area of the polygon over its extent squared: a corner of a polygon that
/// turns by less is straight: more cannot be told from rounding.
inline constexpr double kStraightCorner = 1e-12;
/// Of the extent of a polygon: its centroid is the origin, and its inertia about the origin is
/// known.
inline constexpr double kCentred = 1e-9;
/// Of the larger radius of an ellipse: the smaller one is at least as large: beyond, the curvature
/// at its ends, of (b / a)² of its size, is below rounding.
inline constexpr double kSlenderEllipse = 1e-9;

}  // namespace tangible
