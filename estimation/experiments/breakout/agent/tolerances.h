// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of the player of Breakout. Each comment names the quantity of which the tolerance
// is a fraction or multiple, then the reason. The README of estimation/experiments/breakout has the
// table.

namespace tangible {

/// Of a frame: the rounding of the time at which the ball meets something.
inline constexpr double kSameFrame = 1e-6;
/// Of a frame: a step of a flight ends this long after the walls are reached.
inline constexpr double kPassedWall = 0.01;
/// Of a pixel: a brick that is beside the way of the ball by less counts as on it.
inline constexpr double kBesideWay = 1.0;
/// Of a pixel: returns from places of the paddle that differ by less are alike.
inline constexpr double kSameOffset = 1.6;
/// Of a pixel: a ball that is seen within it is where it was predicted: a speed of 1.5 is seen as 1
/// and 2 in turn.
inline constexpr double kAsPredicted = 1.01;
/// Of a pixel: a paddle that is nearer to its place than any press brings it has arrived.
inline constexpr double kAtPlace = 4.0;
/// Of one pixel a frame: a slower paddle is at rest.
inline constexpr double kPaddleRests = 1.0;

}  // namespace tangible
