// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of certificates: of what each is a share, then why. lib/simulation/README.md has a
// table.

namespace tangible {

/// Of the margin's own scale: relative distances to a jump below it make the verdict
/// `discontinuous`.
inline constexpr double kNearJumpMargin = 1e-6;
/// Of the square of the smallest margin: what smoothing changes a derivative by, relatively, is
/// about its complementarity over that square.
inline constexpr double kSmoothedDerivative = 1e-8;
/// Of a step: an event that is nearer than that to a change of the controls has a margin.
inline constexpr double kBesideControls = 1e-3;
/// Of the largest impulse or force: a contact with less carries no load.
inline constexpr double kLoaded = 1e-9;
/// Of the terms of the rate: a direction that changes a gap or a speed by less does not change it.
inline constexpr double kUnmoved = 1e-12;

/// Of the size r, or rad: how far bodies are moved to see whether a contact has other features
/// beside.
inline constexpr double kFeatureMargin = 1e-7;
/// Of kFeatureMargin: contacts so far apart are one contact's.
inline constexpr double kContinues = 10.0;
/// Rad: normals turned by less are one contact's.
inline constexpr double kTurned = 1e-3;
/// Of the size r: contacts are searched to it beyond the closed ones' gaps.
inline constexpr double kReach = 1e-3;
/// Of the size r: the moves between which the equations of two choices are compared.
inline constexpr double kDifference = 1e-5;
/// Of the speed of the pair over its size: jumps of the derivative count above it: what remains of
/// rounding (1e-16 over kDifference) and, after extrapolation, of curvature (kDifference²), with
/// two orders of room.
inline constexpr double kJump = 1e-6;
/// Of 1 / h: the same of rates.
inline constexpr double kJumpOfRate = 1e-8;

/// Of the largest change of any body: counts beside an entry, where tangent and adjoint are
/// compared.
inline constexpr double kStateRounding = 1e-4;
/// Of what is allowed of the entry: smaller entries that are not 0 have a column of their own:
/// single loads are refined to less.
inline constexpr double kRoundingEntry = 1e-10;

/// Of the motion: an integrator's error that is more than rounding: what an event that splits a
/// step changes.
inline constexpr double kSplitMatters = 1e-7;
/// Of the pose, and gravity's speed: added to the motion: of a scene at rest both are rounding.
inline constexpr double kAtRest = 1e-6;

/// Of the speed that forces give in a step: speed U of the probe of a start.
inline constexpr double kOfStep = 1e-3;
/// Of the largest entry of the derivative: what extrapolated quotients of a smooth map may miss: a
/// kink below it is not seen.
inline constexpr double kApart = 1e-2;
/// Of the touching tolerance over the time, and rounding: noise of poses that end within the
/// tolerance.
inline constexpr double kNoise = 3.0;
/// Of the largest speed: rounding of speeds, in the noise above.
inline constexpr double kSpeedRounding = 1e-13;
/// Of the speed of the fastest body: a direction that moves bodies so much faster than the contact
/// does not throw it.
inline constexpr double kThrows = 1e-4;
/// Of the parameter, at least 1: parameters are changed by no more.
inline constexpr double kOfParameter = 1e-3;
/// Of the slip as it was: a slip that has ended.
inline constexpr double kStops = 1e-6;

}  // namespace tangible
