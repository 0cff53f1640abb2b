// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of geometry: of what each is a share, then why. The README has a table.

#include <limits>

namespace tangible {

/// Of the the length of the faces at hand, or an angle in rad: lengths below it are rounding, and
/// edges that turn by less are one face.
inline constexpr double kLengthRounding = 1e-12;
/// Of the the length of two faces, as a power of two: their ends count as one above the other: a
/// stack of equal boxes has the same features step after step.
inline constexpr double kAligned = 1e-9;
/// Of the the length of a face: the same where its neighbour is longer.
inline constexpr double kBeyondEnd = 1e3 * kAligned;
/// Of the the length of the neighbouring edge: a shorter edge is a tip, which a half-plane touches
/// with one vertex.
inline constexpr double kTip = 1e-3;
/// Of the size of two shapes and their distance: where the distance and the radii of curvature sum
/// up to less, a direction is rounding, as that between two circles about one centre.
inline constexpr double kUnbent = 4.0 * std::numeric_limits<double>::epsilon();
/// A turn in rad: below it two directions are one, but for rounding.
inline constexpr double kTurnRounding = 2.0 * std::numeric_limits<double>::epsilon();

}  // namespace tangible
