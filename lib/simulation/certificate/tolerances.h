// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of certificates. Each comment names the quantity of which the tolerance is a
// fraction, then the reason. lib/simulation/README.md has the table.

namespace tangible {

/// Of the size of the larger body: a contact that begins with a deeper penetration has not closed,
/// but has become the nearest of several. Gaps that close are located to 1e-10 of the body.
inline constexpr double kBegunDepth = 1e-7;
/// Of the fifth power of a turn in one motion: what the motion of a joint's bodies misses of its
/// place. A hinged body that a friction of constant moment brakes misses 0.022 of it.
inline constexpr double kMissedOfTurn = 0.05;
/// Of the size of a body, or rad: most that all motions together are said to miss.
inline constexpr double kMostMissed = 1e-6;
/// Of the way of a spring's ends past each other: where they come nearer, the spring has had no
/// length. Straight motions round to 1e-15 of it.
inline constexpr double kNoLength = 1e-9;
/// Of the margin's own scale: relative distances to a jump below it make the verdict
/// `discontinuous`.
inline constexpr double kNearJumpMargin = 1e-6;
/// Of a step: an event that is nearer to a change of the controls gets a margin for it.
inline constexpr double kBesideControls = 1e-3;
/// Of the largest impulse or force: a contact with less carries no load.
inline constexpr double kLoaded = 1e-9;
/// Of the terms of the rate: a direction that changes a gap or a speed by less counts as not
/// changing it.
inline constexpr double kUnmoved = 1e-12;

/// Of the size r, or rad: how far bodies are moved to find out whether a contact then has other
/// features.
inline constexpr double kFeatureMargin = 1e-7;
/// Of kFeatureMargin: contacts no farther apart than this continue one another when features
/// change.
inline constexpr double kContinues = 10.0;
/// Rad: contacts whose normals differ by less continue one another.
inline constexpr double kTurned = 1e-3;
/// Of the size r: contacts are searched up to this distance beyond the gaps of the closed ones.
inline constexpr double kReach = 1e-3;
/// Of the size r: the moves between which the equations of two choices are compared.
inline constexpr double kDifference = 1e-5;
/// Of the speed of the pair over its size: jumps of the derivative count above it; it exceeds the
/// remainders of rounding (1e-16 over kDifference) and, after extrapolation, of curvature
/// (kDifference²) by four orders of magnitude.
inline constexpr double kJump = 1e-6;
/// Of 1 / h: the same limit for rates.
inline constexpr double kJumpOfRate = 1e-8;

/// Of the largest change of any body: added to the size of an entry where tangent and adjoint are
/// compared.
inline constexpr double kStateRounding = 1e-4;
/// Of what is allowed of the entry: smaller entries that are not 0 get a column of their own,
/// because the residual of single loads is refined further.
inline constexpr double kRoundingEntry = 1e-10;

/// Of the motion: an integrator's error that exceeds rounding, so that an event that splits a step
/// changes the result.
inline constexpr double kSplitMatters = 1e-7;
/// Of the pose, and gravity's speed: added to the motion, because in a scene at rest the motion is
/// rounding.
inline constexpr double kAtRest = 1e-6;

/// Of the speed that forces give in a step: the speed U with which a start is probed.
inline constexpr double kOfStep = 1e-3;
/// Of the largest entry of the derivative: the error allowed in extrapolated quotients of a smooth
/// map: smaller kinks are not detected.
inline constexpr double kLeastKink = 1e-2;
/// Of the touching tolerance over the time, and rounding: the noise of poses that end within the
/// tolerance.
inline constexpr double kNoise = 3.0;
/// Of the largest speed: the rounding of speeds, part of the noise above.
inline constexpr double kSpeedRounding = 1e-13;
/// Of the speed of the fastest body: a direction that changes a contact's speed by a smaller
/// fraction of this does not open it.
inline constexpr double kOpeningSpeed = 1e-4;
/// Of the parameter, at least 1: the largest change of a parameter.
inline constexpr double kOfParameter = 1e-3;
/// Of a step: a shorter motion does not tell whether a servo stays on its bound.
inline constexpr double kStaysOnBound = 0.1;
/// Of the friction at rest: a smaller loss of friction by sliding is none.
inline constexpr double kNoDecay = 1e-9;
/// Of the slip as it was: a smaller slip counts as ended.
inline constexpr double kEndedSlip = 1e-6;
/// Of the largest entry of a direction's derivative: derivatives along and against it that differ
/// by less are the same.
inline constexpr double kSameSides = 1e-8;
/// Of the places and speeds of bodies at the start, over the parameter's size: smaller derivatives
/// count as 0 in that comparison.
inline constexpr double kNoMovement = 1e-10;

/// Of the parameter, or its scale: the change with which the rates of slacks are measured.
/// Slacks are smooth and have about 12 digits.
inline constexpr double kRadiusStep = 1e-6;
/// Of that change: the smaller one that is tried where the first has other choices.
inline constexpr double kSmallerStep = 1e-3;
/// Of the terms of a slack: a change of the slack that is rounding.
inline constexpr double kSlackRounding = 1e-12;
/// Of the terms of a slip: a smaller one is 0, as where sliding begins.
inline constexpr double kNoSlip = 1e-9;
/// Of the parameter, or its scale: a change to first order that is farther tells nothing.
inline constexpr double kFarthestRadius = 1e3;
/// Of a radius: one that ends so near the end of the parameter's range is that end, as where a load
/// vanishes with a mass.
inline constexpr double kRangeEnd = 1e-6;
/// Of the duration: how far behind its end a run by events goes on, to find events that a small
/// change of a parameter would move into it.
inline constexpr double kBehindEnd = 0.2;

}  // namespace tangible
