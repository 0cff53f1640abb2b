// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of control: of what each is a share, then why. lib/control/README.md has a table.

namespace tangible {

/// Of the terms of a free gradient: what rounding leaves of it at the minimum of a quadratic.
inline constexpr double kFreeGradient = 1e-13;
/// Of the decrease to first order: the least that a step of a line search must reach.
inline constexpr double kSufficientDecrease = 1e-4;
/// Of the cost: changes below it say nothing: of rounding, and of what projected joints are left
/// open by.
inline constexpr double kCostRounding = 1e-10;
/// Of the first cost: at a cost so small the target is met, and gradients are rounding.
inline constexpr double kNoCost = 1e-24;
/// Of the largest entry of V: the least shift of states that makes a backward pass convex.
inline constexpr double kLeastShift = 1e-9;
/// Of the same: beyond it a shift leaves no step that is worth trying.
inline constexpr double kLargestShift = 1e9;
/// Of the cost, to first order: what moving all controls by their ranges may change it by at the
/// end, unless the user says otherwise.
inline constexpr double kGradientTolerance = 1e-6;
/// Of what a step's force does to the heaviest body: a control that does less moves nothing.
inline constexpr double kMovesNothing = 1e-12;
/// Of the variable, at least 1: step of central differences of exact Jacobians: cube root of ε.
inline constexpr double kSecondDifference = 6e-6;

}  // namespace tangible
