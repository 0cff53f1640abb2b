// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of event stepping and its certificates, as shares of the lengths, speeds and times
// of a run (dynamics/model/lengths.h); the README of lib/simulation has them in a table.

#include <limits>

namespace tangible {

/// Of the touching tolerance: what lies deeper is in penetration. Bounces that do not leave the
/// tolerance sink by it, each time.
inline constexpr double kDeepTouches = 1000.0;
/// Of the touching tolerance: a limit broken by more is one that recovery should move.
inline constexpr double kBrokenTouches = 1e4;
/// Of the touching tolerance: a gap of more, at the start of a run, is meant.
inline constexpr double kMeantTouches = 10.0;

/// Of a body's size, or rad: an error that the correction of poses may leave where it does not
/// shrink any more, beside rounding.
inline constexpr double kCorrected = 1e-9;
/// Of the coordinate and the size: an error of this is rounding, which another correction would
/// only exchange for other rounding.
inline constexpr double kSettled = 4.0 * std::numeric_limits<double>::epsilon();
/// Of ρ: a closed contact's gap below this is left as it is where it is above kLeastLeft. Two
/// supports whose heights round apart would turn a face that rests on both, now to and now fro.
inline constexpr double kLeftAlone = 0.5;
/// Of a body's size: rounding below this turns no face, and gaps are corrected to it.
inline constexpr double kLeastLeft = 1e-12;

/// To which gaps are located: of the size, and of the coordinate.
inline constexpr double kLocatedOfSize = 8.0 * std::numeric_limits<double>::epsilon();
inline constexpr double kLocatedOfCoordinate = std::numeric_limits<double>::epsilon();
/// Of the smallest body: what boxes are wider by than motions reach, beside rounding.
inline constexpr double kWiderBoxes = 1e-9;

/// Of the fastest speed of a point: what touches neither approaches nor leaves nor slides below it,
/// but for what turned faces add.
inline constexpr double kSlowShare = 1e-11;

/// ρ / r: by how much a face may be turned whose ends touch, from −2 ρ to ρ, with room.
inline constexpr double kTurnedFace = 4.0;

/// Of a segment's length: to which the instant is found at which a feature gives way to the next.
inline constexpr double kHandOverTime = 1e-14;
/// Of dt: instants closer to each other are the same, beside rounding.
inline constexpr double kSameInstant = 1e-7;

}  // namespace tangible
