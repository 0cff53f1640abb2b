// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of fixed steps, of the projection onto the joints and of the warnings of a run: of
// what each is a share, then why. lib/simulation/README.md has a table.

#include <limits>

namespace tangible {

/// Of ρ / r, of bodies that touch or are joined: coordinates are too large: corners kCorner of a
/// body apart must be told from each other; at 1e6 m a box of half a metre still holds.
inline constexpr double kLargeCoordinates = 1e-7;
/// Of the size of the joined bodies: a joint is open, and a run says so: it shows in a view and in
/// the second digit of a body's motion.
inline constexpr double kOpenJoint = 0.01;
/// Of speeds and poses, at least 1: unrolled steps that differ by more from those in double are on
/// another branch.
inline constexpr double kBranchTolerance = 1e-8;

/// Of the determinant of M: a body's block of W below it is shifted by twice it: refinement gains
/// three digits a sweep, and a pivot costs no more.
inline constexpr double kSingularBlock = 1e-3;
/// Of the radius of gyration: shorter steps of Newton's method are in its quadratic range, where
/// rounding would decide the merit.
inline constexpr double kQuadraticStep = 1e-6;
/// Of the radius of gyration: after one of it the next would be of rounding's size.
inline constexpr double kLastNewtonStep = 1e-8;
/// Of the radius of gyration: the same where a block is shifted, and convergence is linear.
inline constexpr double kLastShiftedStep = 1e-14;
/// Of a step of Newton's method: the shortest part of it that is tried; then descent follows.
inline constexpr double kShortestNewton = 1e-3;
/// Of a step of descent: the shortest part of it that is tried.
inline constexpr double kShortestDescent = 1e-12;

/// Of the longer side of a box: a corner beyond the end of a face by kBeyondEnd counts as touching,
/// with ten times room.
inline constexpr double kCoupledBeyond = 1e-5;
/// Of the coordinates of a box: rounding on top of the above.
inline constexpr double kCoupledRounding = 16.0 * std::numeric_limits<double>::epsilon();

}  // namespace tangible
