// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of dynamics: of what each is a share, then why. Lengths and coordinates are those
// of lengths.h; lib/dynamics/README.md has a table.

#include <limits>

namespace tangible {

/// Of the coordinate x: ρ, what a gap or a joint's error of the pair may be off by: poses are
/// stored to ε x / 2, and some sums and products follow.
inline constexpr double kCoordinateRounding = 64.0 * std::numeric_limits<double>::epsilon();
/// Of the size r, and ρ on top: a gap below it touches: between rounding and what gaps are located
/// to on one side, and what moves a body visibly on the other.
inline constexpr double kTouchShare = 1e-10;
/// Rad, and rounding on top: the same of an angle: a joint is at its limit.
inline constexpr double kTouchAngle = 1e-10;
/// Of the coordinates of two bodies: what the constant of a contact's row is uncertain by, over the
/// step: modes do not follow it.
inline constexpr double kCornerRounding = 4.0 * std::numeric_limits<double>::epsilon();

/// Of the step: times that are closer are the same: an end of a step is k dt rounded.
inline constexpr double kSameTime = 1e-9;
/// Of speeds at hand: an approach below it is none; an order above what the solver leaves.
inline constexpr double kNoApproach = 1e-9;
/// Of the size of the smaller body, or length of an edge: beyond the meeting of two corners: above
/// what ends of faces may be apart, below what anything else is.
inline constexpr double kCorner = 1e-6;
/// Of the bound of a speed: a speed that exceeds its bound by less is rounding, and no search is
/// repeated.
inline constexpr double kSpeedBound = 1e-12;

}  // namespace tangible
