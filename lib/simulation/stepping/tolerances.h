// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of fixed steps, of the projection onto the joints and of the warnings of a run.
// Each comment names the quantity of which the tolerance is a fraction, then the reason.
// lib/simulation/README.md has the table.

#include <limits>

namespace tangible {

/// Of ρ / r, of bodies that touch or are joined: larger coordinates are reported as too large,
/// because corners at a distance of kCorner of a body must be distinguished; a box of half a metre
/// at 1e6 m is still accepted.
inline constexpr double kLargeCoordinates = 1e-7;
/// Of the size of the joined bodies: a joint that is open by more is reported: it is visible in a
/// view and in the second digit of a body's motion.
inline constexpr double kOpenJoint = 0.01;
/// Of speeds and poses, at least 1: unrolled steps that differ by more from those in double are on
/// another branch.
inline constexpr double kBranchTolerance = 1e-8;

/// Of the determinant of M: a body's block of W with a smaller determinant is shifted by twice this
/// value; refinement then gains three digits in each sweep, and a pivot costs no more.
inline constexpr double kSingularBlock = 1e-3;
/// Of the radius of gyration: shorter steps of Newton's method are in its quadratic range, where
/// rounding would decide the merit.
inline constexpr double kQuadraticStep = 1e-6;
/// Of the radius of gyration: after a step of this size the next one would be of the size of
/// rounding.
inline constexpr double kLastNewtonStep = 1e-8;
/// Of the radius of gyration: the last step where a block is shifted, and convergence is linear.
inline constexpr double kLastShiftedStep = 1e-14;
/// Of the kinetic energies at both ends of a run: energy that grows by more without a cause is
/// reported; it shows in the second digit of a speed.
inline constexpr double kEnergyGrowth = 0.01;
/// The same where fixed steps have pushed bodies apart that overlap deeply.
inline constexpr double kGrownByOverlap = 1e-3;
/// Of the kinetic energy of all bodies at the speed of what drives them: more is reported.
inline constexpr double kSqueezed = 1e4;
/// Of a step of Newton's method: the shortest part of it that is tried; then descent follows.
inline constexpr double kShortestNewton = 1e-3;
/// Of a step of descent: the shortest part of it that is tried.
inline constexpr double kShortestDescent = 1e-12;

/// Of the longer side of a box: ten times the distance kBeyondEnd by which a corner may be beyond
/// the end of a face and still count as touching.
inline constexpr double kCoupledBeyond = 1e-5;
/// Of the coordinates of a box: rounding, added to the above.
inline constexpr double kCoupledRounding = 16.0 * std::numeric_limits<double>::epsilon();

/// Of the speed of a body of given motion at a joint, and of its fastest: where the other body
/// begins with another one, by more than this, a line says so.
inline constexpr double kBegunApart = 1e-3;

}  // namespace tangible
