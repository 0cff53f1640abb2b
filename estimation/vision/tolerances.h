// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of vision: of what is read from positions seen (window_state.h), and of training.
// The README's table lists them.

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

/// Of one sequence: a share of sequences that gives a whole number of them and less than this gives
/// that number, because the rest is rounding.
inline constexpr double kLabelRounding = 1e-9;
/// Of the largest weight of a pixel, about 1: added to every weight, so that a picture without any
/// has a centre.
inline constexpr double kLeastWeight = 1e-9;
/// Pixels²: added to squared distances, because the slope of their root at 0 is infinite.
inline constexpr double kSmoothDistance = 1e-6;
/// Of a mass of 1 kg, or a direction of states: the step of central differences by which the layer
/// is checked.
inline constexpr double kGradientStep = 1e-6;
/// Of the sizes of both derivatives: the difference that this check allows.
inline constexpr double kGradientAgrees = 1e-6;

}  // namespace tangible
