// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of event stepping and its derivatives: of what each is a share, then why. Lengths
// are those of dynamics/model/lengths.h; lib/simulation/README.md has a table.

#include <limits>

#include "tangible/geometry/tolerances.h"

namespace tangible {

/// Of the touching tolerance: what lies deeper is in penetration: bounces that do not leave the
/// tolerance sink by it, each time.
inline constexpr double kDeepTouches = 1000.0;
/// Of the touching tolerance: a limit broken by more is one that recovery should move: far above
/// what corrections leave.
inline constexpr double kBrokenTouches = 1e4;
/// Of the touching tolerance: a gap of more, at the start of a run, is meant.
inline constexpr double kMeantTouches = 10.0;
/// Of what recovers in a step: a broken limit that moves by less does not recover.
inline constexpr double kStuckLimit = 1e-3;

/// Of the size r, or rad, and ρ on top: poses are corrected to it, or to `joint_tolerance` if that
/// is more, where they do not get nearer.
inline constexpr double kCorrected = 1e-9;
/// Of the coordinate and size: errors of this are rounding, which another correction would only
/// exchange for other rounding.
inline constexpr double kSettled = 4.0 * std::numeric_limits<double>::epsilon();
/// Of ρ: a closed contact's gap below it is left as it is where it is above kLeastLeft: supports
/// whose heights round apart would turn a face that rests on both, now to and now fro.
inline constexpr double kLeftAlone = 0.5;
/// Of the size r: rounding below it turns no face, and gaps are corrected to it.
inline constexpr double kLeastLeft = 1e-12;

/// Of the size r, or value at the start of an interval: gaps, forces and slips are located to it.
inline constexpr double kLocatedOfSize = 8.0 * std::numeric_limits<double>::epsilon();
/// Of the coordinate x: gaps are located to it where that is more: a pose has no more digits.
inline constexpr double kLocatedOfCoordinate = std::numeric_limits<double>::epsilon();
/// Of the time of an event, since the start of a segment: brackets of it are not narrowed further.
inline constexpr double kBracket = 4.0 * std::numeric_limits<double>::epsilon();
/// Of the radius of the smallest body, and rounding on top: boxes are wider by it than motions
/// reach.
inline constexpr double kWiderBoxes = 1e-9;
/// Of the step or segment: what is left of a step below it is none, and to it the instant is found
/// at which a feature gives way to the next.
inline constexpr double kTimeRounding = 1e-14;
/// Of the step: a segment of less that ends with a contact touching counts as an event, of which a
/// pair may have `max_events_per_step`.
inline constexpr double kNoMotion = 1e-13;
/// Of the step or segment: parts are not shorter: a window of a force that opens nearer to an end
/// of the step acts from there, and searches do not divide further.
inline constexpr double kShortestPart = 1e-12;
/// Of dt, and rounding on top: two instants are the same: a kink nearer than the margin of a
/// certificate.
inline constexpr double kSameInstant = 1e-7;
/// Of the segment: after it, what starts where features change has left that place.
inline constexpr double kLeftBehind = 1e-9;

/// Of the speed of the fastest point, with gravity's in a step: what touches neither approaches nor
/// leaves nor slides below it, but for what turned faces add.
inline constexpr double kSlowShare = 1e-11;
/// Of ρ / r: a face whose ends touch, from −2 ρ to ρ, is turned by no more, with room.
inline constexpr double kTurnedFace = 4.0;
/// M/s: added to the speed above, so that it is not 0 in a scene at rest.
inline constexpr double kLeastSpeed = 1e-200;
/// Of the speed at which a contact would return within the touching tolerance: what nearly
/// dependent rows leave of speeds that were to vanish.
inline constexpr double kRattle = 1e-3;
/// Of the speed above: an impact that leaves no more of an approach has solved it.
inline constexpr double kSolvedApproach = 100.0;
/// Of the step: accelerations without a solution (Painlevé) are replaced by impulses of a step this
/// short.
inline constexpr double kPainleveStep = 1e-9;
/// Absolute: keeps what is divided by from being 0.
inline constexpr double kNoScale = 1e-300;

/// Of the forces at work: beyond it a force counts as negative, and friction as exceeded.
inline constexpr double kForceTolerance = 1e-10;
/// Of the largest acceleration, or terms that cancel in it: an implicit stage has converged; a
/// thousandfold of it is enough where rounding keeps it from the last digits.
inline constexpr double kImplicitStage = 1e-14;
/// Of the largest entry: the derivative of an implicit stage has converged.
inline constexpr double kStageDerivative = 1e-15;
/// Of the largest entry: the same, where the iteration does not fall any more.
inline constexpr double kStageDerivativeRounding = 1e-13;
/// Of the largest entry: the same, after the iterations of a stage that is left for Newton's
/// method.
inline constexpr double kStageDerivativeLate = 1e-12;
/// Of the terms of a joint's row, at the speeds that the segment's forces would give: more is left
/// only by joints that contradict each other: rounding of an ill-posed system leaves less.
inline constexpr double kUnmetRow = 1e-6;
/// Of the speed of the fastest body: added to the terms above: where no force acts an angular
/// velocity may be rounding of the speed.
inline constexpr double kSpeedOfTerms = 1e-6;
/// Of the terms of a joint's row: a row that leaves more names the joint in the message of an
/// impact that is not solved.
inline constexpr double kNamedJoint = 1e-9;

/// The norm of the difference of two normals: a vertex over a vertex by another name, where
/// rounding changes which of the two is found.
inline constexpr double kSameNormal = 1e-7;
/// The sine of the angle between two faces: faces are parallel: a body between them neither wedges
/// nor jams.
inline constexpr double kFreeSlide = 1e-6;
/// Of the size r: a pair that has moved by more since the start of a segment has passed its
/// meeting.
inline constexpr double kPassed = 1e-7;
/// Of the sum of the radii, as a power of two, which is at least half of the faces': ends of two
/// faces count as one above the other, as in `geometry`.
inline constexpr double kAlignedRadii = 8.0 * kAligned;

/// Of the terms of the rate: a rate below it, at which an event's equation changes with the
/// segment's length, is rounding: two features hand a contact over, and nothing depends on when.
inline constexpr double kNoRate = 1e-9;
/// Of the largest pivot: redundant rows: elimination leaves them at some thousand ε, and rounding
/// over them is no derivative; then δ is `kContactRegularisation`.
inline constexpr double kSingularPivot = 1e-11;
/// Of mean z s / κ: of the unrolled interior point: derivatives lag behind values.
inline constexpr double kUnrolledComplementarity = 1e-17;
/// Of the largest speed: an unrolled impact that differs by more from the one in double is on
/// another branch, or has stalled: its modes are eliminated instead.
inline constexpr double kUnrolledAgrees = 1e-9;
/// Of the derivatives: Newton's iteration for an event's time ends where it changes them by less.
inline constexpr double kLocatedDerivative = 1e-12;

}  // namespace tangible
