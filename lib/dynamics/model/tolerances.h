// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of dynamics. Each comment names the quantity of which the tolerance is a fraction,
// then the reason. Lengths and coordinates are those of lengths.h; lib/dynamics/README.md has the
// table.

#include <limits>

namespace tangible {

/// Of the coordinate x: ρ, the rounding of a gap or of a joint's error of the pair: poses are
/// stored to ε x / 2, and a few sums and products follow.
inline constexpr double kCoordinateRounding = 64.0 * std::numeric_limits<double>::epsilon();
/// Of the size r, and ρ on top: a contact with a smaller gap touches: the tolerance lies above
/// rounding and the accuracy to which gaps are located, and far below what moves a body visibly.
inline constexpr double kTouchShare = 1e-10;
/// Rad, and rounding on top: a joint whose angle is nearer to its limit is at the limit.
inline constexpr double kTouchAngle = 1e-10;
/// Of the coordinates of two bodies: divided by the step, the rounding of the constant of a
/// contact's row; smaller changes do not change its mode.
inline constexpr double kCornerRounding = 4.0 * std::numeric_limits<double>::epsilon();

/// Of the coordinates of two bodies: a gap that is smaller is the rounding of some thousand steps,
/// and counts as 0: what just fits between two walls is in one of them by as much.
inline constexpr double kGapRounding = 1024.0 * std::numeric_limits<double>::epsilon();

/// Of the step: times that differ by less are the same, because an end of a step is k dt rounded.
inline constexpr double kSameTime = 1e-9;
/// Of the step: knots of a body's path that are nearer to the end of a step fall on it.
inline constexpr double kSameInstantShare = 1e-12;
/// Of the time: the same where that is more, because knots and ends of steps are rounded sums.
inline constexpr double kInstantRounding = 4.0 * std::numeric_limits<double>::epsilon();
/// Of the speeds of the contact: a slower approach counts as none; the tolerance lies an order of
/// magnitude above the residual of the solver.
inline constexpr double kNoApproach = 1e-9;
/// Of the size of the smaller body, or length of an edge: how far bodies move on after two corners
/// have met: farther than the ends of faces that count as aligned, and less than any other length.
inline constexpr double kCorner = 1e-6;
/// Of the touching tolerance: a larger gap that closes just as a step ends closes in the next.
inline constexpr double kArrives = 4.0;
/// Of the same as kCorner: bodies that go farther while they close that much have not passed at a
/// corner.
inline constexpr double kBesideCorner = 0.01;
/// Of the bound of a speed: a speed that exceeds its bound by less is rounding, and no search is
/// repeated.
inline constexpr double kSpeedBound = 1e-12;
/// Of the distance within which contacts may close in a fixed step: those a little beyond it are
/// listed too, so that certificates see what just fails to close.
inline constexpr double kListedBeyond = 1.000004;

/// Of m, the squared ratio of the speeds of a disc's centre and rim: nearer to 1 the elliptic
/// integrals of its support are those at this distance, because they are infinite at 1.
inline constexpr double kRimCentre = 1e-12;
/// Of the speed that a body would have without its support: slower points of the body alone are
/// held; a smoothed dissipation leaves less where 5e-11 of a limit are left.
inline constexpr double kHeldPoint = 1e-10;
/// One over the share of a joint or contact: what a support gives where both keep the same motion,
/// so that it needs no more force than it must. The square of that share is far below the tolerance
/// of its limit, and a proximal step still gains five digits.
inline constexpr double kSupportGive = 1e5;
/// Of `contact_margin`: bodies that are held by their supports, and overlap by less, stay so.
inline constexpr double kHeldOverlap = 1e-3;
/// Of the speed that a body would have without its support: where all points are faster the
/// dissipation is smooth enough for Newton's method without smoothing it.
inline constexpr double kSlowPoint = 1e-4;
/// Of the wrench that a support balances: a smaller reserve is none.
inline constexpr double kLeastReserve = 1e-12;
/// Of a free body's speed: the length over which the dissipation of points is smoothed at last.
inline constexpr double kSmoothedSpeed = 1e-15;

}  // namespace tangible
