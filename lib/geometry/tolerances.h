// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of geometry. Each comment names the quantity of which the tolerance is a fraction,
// then the reason. The README has the table.

#include <limits>

namespace tangible {

/// Of the length of the faces that are compared, or an angle in rad: smaller lengths are rounding,
/// and edges that turn by a smaller angle belong to one face.
inline constexpr double kLengthRounding = 1e-12;
/// Of the length of two faces, as a power of two: ends that are no farther apart along the faces
/// count as one above the other, so that a stack of equal boxes has the same features step after
/// step.
inline constexpr double kAligned = 1e-9;
/// Of the length of a face: the same tolerance where the other face is longer.
inline constexpr double kBeyondEnd = 1e3 * kAligned;
/// Of the length of the neighbouring edge: a shorter edge is a tip, which a half-plane touches with
/// one vertex.
inline constexpr double kTip = 1e-3;
/// Of the size of two shapes and their distance: where the sum of the distance and the radii of
/// curvature is smaller, the direction of the normal is rounding, as it is between two circles
/// about one centre.
inline constexpr double kUnbent = 4.0 * std::numeric_limits<double>::epsilon();
/// Rad: two directions that differ by a smaller angle are the same up to rounding.
inline constexpr double kTurnRounding = 2.0 * std::numeric_limits<double>::epsilon();
/// M: shapes at rest that are no farther apart touch, and a step up of that height between faces of
/// equal normal counts as flush: it is more than the rounding of coordinates within 1e6 m, and less
/// than any step that is built.
inline constexpr double kFlushStep = 1e-8;
/// Of the coordinate: the rounding of the place of one shape relative to another.
inline constexpr double kSeamRounding = 64.0 * std::numeric_limits<double>::epsilon();
/// Of the length of a run: a corner that is no deeper behind it than this, and faces no other run,
/// is a contact of it up to its end.
inline constexpr double kBehindFace = 1e-3;
/// Rad: faces that turn by a smaller angle have equal normals.
inline constexpr double kFlushTurn = 1e-9;
/// Of the extent of a concave polygon: corners that are no farther inside of its convex hull have
/// rows against a half-plane, so that feet of equal length are seen, and of nearly equal length.
inline constexpr double kNearHull = 1e-6;
/// Rad: a piece of a spline that turns by no more has at most one nearest point to any other one.
/// Of others each quarter is looked at.
inline constexpr double kStraightPiece = 0.1;
/// The cosine of the angle up to which a face and an edge face each other: the farther end of their
/// overlap is then a second contact, as that of two convex shapes.
inline constexpr double kFacing = 0.5;

}  // namespace tangible
