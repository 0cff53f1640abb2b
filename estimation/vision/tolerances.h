// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Tolerances of what is read from positions seen (window_state.h). The README's table lists them.

namespace tangible {

/// Pixels: second differences of positions below it count as uniform motion. Positions are seen to
/// 0.02 pixels, 0.05 beside walls, which makes second differences 0.05 and 0.12 in the mean.
inline constexpr double kUniformMotion = 0.15;
/// Pixels a frame: slower discs rest. Positions seen to 0.05 pixels in four frames give the slope
/// of a line to 0.02.
inline constexpr double kRests = 0.06;
/// Pixels: the engine's position after an impact is at most so far from the one seen. SimB's own
/// impacts are up to a substep late, 1.2 pixels of the way each.
inline constexpr double kImpactMissed = 2.5;
/// Pixels: the way of two discs since their impact from which its direction is seen, to 0.2
/// radians.
inline constexpr double kImpulseSeen = 0.15;
/// Pixels: a way by the engine that differs less from its velocity has met nothing. Rounding in
/// positions of 64 pixels is 1e-14.
inline constexpr double kStraight = 1e-9;

}  // namespace tangible
