// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of event stepping and its derivatives. Each comment names the quantity of which
// the tolerance is a fraction, then the reason. Lengths are those of dynamics/model/lengths.h;
// lib/simulation/README.md has the table.

#include <limits>

#include "tangible/geometry/tolerances.h"

namespace tangible {

/// Of the touching tolerance: a deeper contact counts as penetration; bounces that do not leave the
/// touching tolerance sink by that tolerance each time.
inline constexpr double kDeepTouches = 1000.0;
/// Of the touching tolerance: a joint limit violated by more should be moved by recovery; it lies
/// far above the errors that corrections leave.
inline constexpr double kBrokenTouches = 1e4;
/// Of the touching tolerance: a larger gap at the start of a run is regarded as intended.
inline constexpr double kMeantTouches = 10.0;
/// Of what recovers in a step: a violated limit that moves by less counts as not recovering.
inline constexpr double kStuckLimit = 1e-3;

/// Of the size r, or rad, and ρ on top: poses are corrected to it, or to `joint_tolerance` if that
/// is larger, where corrections do not reduce the error further.
inline constexpr double kCorrected = 1e-9;
/// Of the coordinate and size: smaller errors are rounding, which another correction would only
/// replace by other rounding.
inline constexpr double kSettled = 4.0 * std::numeric_limits<double>::epsilon();
/// Of ρ: a closed contact's gap below it and above kLeastLeft is not corrected: supports whose
/// heights differ by rounding would turn a face that rests on both, in changing directions.
inline constexpr double kLeftAlone = 0.5;
/// Of the size r: smaller rounding does not turn a face, and gaps are corrected to it.
inline constexpr double kLeastLeft = 1e-12;

/// Of the size r, or value at the start of an interval: gaps, forces and slips are located to it.
inline constexpr double kLocatedOfSize = 8.0 * std::numeric_limits<double>::epsilon();
/// Of the terms of a servo's effort and its limit: its bound is located to it.
inline constexpr double kServoLocated = 8.0 * std::numeric_limits<double>::epsilon();
/// Of the same terms: within it a servo is on its bound, and the rate of its effort tells its mode;
/// it lies well above what locating leaves, and either mode has the same effort there.
inline constexpr double kServoBound = 1e-11;
/// Of dt: the rate of a servo's effort is its difference over so short a time, in which
/// accelerations stay as they are, and which changes it by much more than rounding.
inline constexpr double kServoRateShare = 1e-4;
/// Of the coordinate x: gaps are located to it where that is larger, because a pose has no more
/// digits.
inline constexpr double kLocatedOfCoordinate = std::numeric_limits<double>::epsilon();
/// Rad, times h / a: the direction in which an ellipse touches turns by no more in a motion. The
/// error of a motion of fourth order is about its fifth power, 3e-8, of what it changes.
inline constexpr double kEllipseTurn = 1.0 / 32.0;
/// Rad: the phase by which an ellipse rocks on its flat side in a motion, whose error is about its
/// fifth power over 72, so that rocking loses 1e-5 of its energy in a radian.
inline constexpr double kEllipsePhase = 0.25;
/// Of the time of an event, since the start of a segment: brackets of that time are not narrowed
/// further.
inline constexpr double kBracket = 4.0 * std::numeric_limits<double>::epsilon();
/// Of the radius of the smallest body, and rounding on top: bounding boxes are wider by it than
/// motions reach.
inline constexpr double kWiderBoxes = 1e-9;
/// Of the step or segment: a smaller rest of a step counts as none; the instant at which a feature
/// hands over to the next is found to this accuracy.
inline constexpr double kTimeRounding = 1e-14;
/// Of the change of a sliding speed's rate over a motion: where the speed falls and rises again and
/// the cubic through its ends comes nearer to 0, it is evaluated there.
inline constexpr double kDipMargin = 1e-3;
/// Of the step: a shorter segment that ends with a contact touching counts as an event, of which a
/// pair may have `max_events_per_step`.
inline constexpr double kNoMotion = 1e-13;
/// Of the step or segment: the shortest part: a force window that opens nearer to an end of the
/// step acts from there, and searches do not divide further.
inline constexpr double kShortestPart = 1e-12;
/// Of dt, and rounding on top: two instants no farther apart are the same, a kink nearer than the
/// margin of a certificate.
inline constexpr double kSameInstant = 1e-7;
/// Of the segment: after it, a contact that starts where features change has left that place.
inline constexpr double kLeftBehind = 1e-9;

/// Of the speed of the fastest point, with gravity's in a step: below it a touching contact counts
/// as neither approaching nor leaving nor sliding; turned faces add to it.
inline constexpr double kSlowShare = 1e-11;
/// Of the speed to which loads and the friction of joints accelerate a body in a time step: the
/// same below it. Where nothing but friction acts, a body that it has stopped has no other scale,
/// and its speed is the rounding, some 1e-15, of what it lost.
inline constexpr double kLoadShare = 1e-13;
/// Of a body's size in a time step: friction counts in that speed up to this one, because the
/// friction of a locked joint may have any size.
inline constexpr double kStoppedSizes = 100.0;
/// Of ρ / r: a face whose ends touch, at gaps from −2 ρ to ρ, is turned by less.
inline constexpr double kTurnedFace = 4.0;
/// M/s: added to the speed above, so that it is not 0 in a scene at rest.
inline constexpr double kLeastSpeed = 1e-200;
/// Of the speed at which a contact would return within the touching tolerance: the remainder that
/// nearly dependent rows leave of speeds that should vanish.
inline constexpr double kRattle = 1e-3;
/// Of the speed above: an approach speed that is not larger after an impact counts as solved.
inline constexpr double kSolvedApproach = 100.0;
/// Of the approach before an impact: what is left of it is rounding, and no other impact. Where no
/// load acts it is all that moves.
inline constexpr double kRemainder = 1e-12;
/// Of the size of a contact's bodies: the height of the rest of a sequence of rebounds that come
/// ever faster, which then ends at once (rebounds.h).
inline constexpr double kReboundHeight = 1e-9;
/// Of the speed at which a contact left: a steady acceleration brings it back as fast. What another
/// impact sends back has another speed, and its rebound decides how bodies go on.
inline constexpr double kReturnsAsFast = 0.01;
/// Of the step: accelerations without a solution (Painlevé) are replaced by impulses of a step this
/// short.
inline constexpr double kPainleveStep = 1e-9;
/// Of the share of a motion at which a contact's mode ends: contacts that differ by less keep their
/// order.
inline constexpr double kSameShare = 1e-6;
/// Absolute: keeps divisors from being 0.
inline constexpr double kNoScale = 1e-300;

/// Of the forces at work: a force that is negative by more counts as negative, and friction that
/// exceeds its limit by more as exceeded.
inline constexpr double kForceTolerance = 1e-10;
/// Of the same, of accelerations: those without held modes differ from those with them.
inline constexpr double kDeparts = 1e-9;
/// Of the largest rate at which contacts let go together: a smaller one is rounding.
inline constexpr double kSmallRate = 1e-6;
/// Of a motion: what lets go so soon after its end may do so at it.
inline constexpr double kPastEnd = 1e-6;
/// Of the time of a release: how long before it nothing may have let go.
inline constexpr double kBeforeRelease = 1e-3;
/// Of the largest normal force: a contact without a load that holds with more has a share of what
/// others bear.
inline constexpr double kIdleShare = 1e-9;
/// Of the acceleration that loads alone give a body: what is accelerated more, from rest and
/// backwards, is thrown about between others that jam.
inline constexpr double kJams = 1e3;
/// Of the same: a slip from rest that goes backwards more slowly is what rounding leaves of bodies
/// that jam.
inline constexpr double kLeastBack = 1e-5;
/// Relative residual of a transposed solve: a force at which rows leave no more is determined by
/// them, while the share of a redundant contact leaves a part of order 1.
inline constexpr double kDetermined = 1e-6;
/// The same: what is not determined is taken from a motion down to it.
inline constexpr double kFullyDetermined = 1e-14;
/// Of the motion that a support lets begin: where less of it is left free by joints and by what
/// else holds the body, the share of the support is not determined.
inline constexpr double kLeastMotion = 0.1;
/// Of the largest acceleration, or terms that cancel in it: an implicit stage has converged; a
/// thousand times this is enough where rounding prevents the last digits.
inline constexpr double kImplicitStage = 1e-14;
/// Of the largest entry: the derivative of an implicit stage has converged.
inline constexpr double kStageDerivative = 1e-15;
/// Of the largest entry: the same, where the changes of the iteration no longer fall.
inline constexpr double kStageDerivativeRounding = 1e-13;
/// Of the largest entry: the same, after the iterations of a stage that is left for Newton's
/// method.
inline constexpr double kStageDerivativeLate = 1e-12;
/// Of the terms of a joint's row, at the speeds that the segment's forces would give: a larger
/// residual means that joints contradict each other, because rounding of an ill-posed system leaves
/// less.
inline constexpr double kUnmetRow = 1e-6;
/// Of the speed of the fastest body: added to the terms above, because where no force acts an
/// angular velocity may be rounding of the speed.
inline constexpr double kSpeedOfTerms = 1e-6;
/// Of the terms of a joint's row: a joint whose row has a larger residual is named in the message
/// about an unsolved impact.
inline constexpr double kNamedJoint = 1e-9;

/// Of √(g g'), the changes of two rows' speeds by a unit impulse along each: where an impulse along
/// one changes the speed along the other by less, that is rounding, and they are not coupled.
inline constexpr double kUncoupled = 1e-12;
/// The norm of the difference of two normals: below it two contacts of a vertex above a vertex are
/// the same, where rounding decides which of the two is found.
inline constexpr double kSameNormal = 1e-7;
/// The sine of the angle between two faces: below it faces count as parallel, and a body between
/// them neither wedges nor jams.
inline constexpr double kFreeSlide = 1e-6;
/// Of the size r: corners of a pair that has moved by more since the start of a segment have passed
/// each other.
inline constexpr double kPassed = 1e-7;
/// Of the sum of the radii, as a power of two, which is at least half of the faces': the ends of
/// two faces no farther apart count as one above the other, as in `geometry`.
inline constexpr double kAlignedRadii = 8.0 * kAligned;

/// Of the terms of the rate: a smaller rate, at which an event's equation changes with the
/// segment's length, is rounding: a contact changes from one feature to another, and nothing
/// depends on the time.
inline constexpr double kNoRate = 1e-9;
/// Of the speeds of the two bodies: a gap that closes more slowly, as where a body passes from one
/// of two flush faces to the other one, is rounding in the same way.
inline constexpr double kTouchRounding = 1e-13;
/// Of the largest pivot: smaller pivots belong to redundant rows, which elimination leaves at some
/// thousand ε; division by them would turn rounding into derivatives, so that
/// δ = `kContactRegularisation` is added.
inline constexpr double kSingularPivot = 1e-11;
/// Of mean z s / κ: goal of the unrolled interior point, because derivatives lag behind values.
inline constexpr double kUnrolledComplementarity = 1e-17;
/// Of the largest speed: an unrolled impact that differs by more from the one in double is on
/// another branch, or has stalled: its modes are eliminated instead.
inline constexpr double kUnrolledAgrees = 1e-9;
/// Of the largest impulse and derivative: the unrolled iteration on the limits of rolling friction
/// ends where it changes them by less.
inline constexpr double kRollingRounding = 1e-14;
/// Of the derivatives: Newton's iteration for an event's time ends where it changes them by less.
inline constexpr double kLocatedDerivative = 1e-12;
/// Of the scales of impulse and slack: impulses and slacks below it count as 0; it lies two orders
/// of magnitude above the error of a solve.
inline constexpr double kDegenerateTolerance = 1e-10;

/// Of μ N: friction of a support that differs by less from that of the new twist has settled; it is
/// some hundred roundings.
inline constexpr double kSupportSettled = 1e-13;
/// Of the velocity of a point on a support: its friction counts as linearised about the new twist
/// where the two differ by less, because derivatives are those of the linearised friction.
inline constexpr double kSupportAbout = 1e-11;
/// Of the speed that its friction takes from a body in a step: a point of a support that is slower
/// has no direction, and any friction within its limit is that of a point at rest.
inline constexpr double kStandingPoint = 1e-12;
/// Of the same: down to where the dampers that stand for friction are smoothed at last, and of
/// μ N: what needs less of its friction than the second is held (Newton's method decides).
inline constexpr double kDamperSmoothing = 1e-6;
inline constexpr double kHeldByDampers = 0.999;
/// Of what the share of its friction that a point needs lacks of 1: where it changes by less from
/// one solve with dampers to the next the point is held. And absolute: of one that slides it lacks
/// no more.
inline constexpr double kSteadyRatio = 0.02;
/// Of the speed that its friction takes from a body in a time step: a point that slides no faster
/// and slows down is stopped along its direction, which no longer changes; what that neglects is
/// this share of a time step long.
inline constexpr double kSlowSupport = 1e-6;
/// Of the same: a body that its support lets go moves in the direction of its acceleration up to
/// this speed, below which its friction would turn its direction much faster than a time step.
inline constexpr double kStartingSupport = 0.05;
/// Cosine: within this angle of its acceleration a slow body counts as starting.
inline constexpr double kStartingAlong = 0.999999;
/// Of the square of kStartingSupport: what is slower may be within the angle of such a speed.
inline constexpr double kLeastOfStart = 1e-5;
/// Of dt: the first motion of a body that its support lets go.
inline constexpr double kFirstOfSupport = 1e-3;
/// Of the acceleration that its friction gives a body, and of the speed that this gives it in dt:
/// one that is accelerated by less than the first, because what pushes it is as large as its
/// friction and along it, and slower than the second, creeps. Friction turns faster ones in more
/// than a thousandth of dt: motions resolve it.
inline constexpr double kCreeping = 0.1;
inline constexpr double kCreepingSpeed = 1e-3;
/// Of the time in which a body that creeps comes to rest, as far as its acceleration tells: how
/// long its horizon may be.
inline constexpr double kHorizonOfRest = 0.5;
/// Of the horizon of a body that creeps: the next one, where it would have stopped after it. And of
/// dt: the least, below which it is stopped along its direction, and the first.
inline constexpr double kShorterHorizon = 0.25;
inline constexpr double kMostHorizon = 0.125;
inline constexpr double kLeastHorizon = 1e-4;
/// A motion changes the velocity of a point on a support by no more than this share; the error of a
/// motion of fourth order is some 1e-8 of the way to rest.
inline constexpr double kSupportTurn = 1.0 / 16.0;
/// Times the rate at which friction turns a velocity into the direction of its point's motion: a
/// motion is no longer, by which one of fourth order is stable and its error as small as above.
inline constexpr double kSupportDecay = 0.5;
/// Of that rate: what joints and contacts may leave of it to count, at the start of a motion. A
/// body that a hinge drags along turns its velocity, and loses what held it across.
inline constexpr double kMostLeft = 1e-6;
/// Of the rate before: a body whose centre is stopped and that a joint keeps from turning about it
/// has a smaller one by rounding alone.
inline constexpr double kStoppedTurn = 1e-9;
/// Rad/s: slower is what rounding leaves of rounding; its square has no digits.
inline constexpr double kNoTurn = 1e-150;
/// Of the smallest body's radius: a way that the projection of twists takes from a body in a motion
/// does no harm where it is shorter.
inline constexpr double kThrownWay = 1e-6;
/// Of dt / 2^k: motions at supports end at multiples of it, up to the rounding of a time.
inline constexpr double kSupportGridSlack = 1e-3;
/// The norm of the difference of two unit vectors: the direction in which a point of a support
/// starts is found to it.
inline constexpr double kSupportDirection = 1e-13;
/// Of a place along a face, m, and of 1 m: nearer to a flush corner a contact is over it.
inline constexpr double kOverCorner = 1e-11;
/// Of 1 m, or rad: how far a body is moved to tell how a contact moves along a face.
inline constexpr double kAheadOnFace = 1e-6;
/// Of the lengths of two rows: with a product that falls short of them by less they are one.
inline constexpr double kCarried = 1e-3;
/// Of a motion: the instant at which supports that share a load let it go is located to it.
inline constexpr double kShareEnds = 1e-11;
/// Of the wrench that a support balances: its limit is located to it.
inline constexpr double kSupportLocated = 1e-13;

}  // namespace tangible
