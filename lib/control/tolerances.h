// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of control. Each comment names the quantity of which the tolerance is a fraction,
// then the reason. lib/control/README.md has the table.

namespace tangible {

/// Of the terms of a free gradient: its rounding error at the minimum of a quadratic.
inline constexpr double kFreeGradient = 1e-13;
/// Of the decrease to first order: the least decrease that a step of a line search must reach.
inline constexpr double kSufficientDecrease = 1e-4;
/// Of the cost: smaller changes are not significant, because of rounding and of the errors that
/// remain in projected joints.
inline constexpr double kCostRounding = 1e-10;
/// Of the first cost: at a smaller cost the target is met, and gradients are rounding.
inline constexpr double kNoCost = 1e-24;
/// Of the largest entry of V: the least shift of states that makes a backward pass convex.
inline constexpr double kLeastShift = 1e-9;
/// Of the same: with a larger shift no step is large enough to be worth trying.
inline constexpr double kLargestShift = 1e9;
/// Of the cost, to first order: the default for the change of the cost, at convergence, if all
/// controls moved by their ranges.
inline constexpr double kGradientTolerance = 1e-6;
/// Of the effect of a step's force on the heaviest body: a control with a smaller effect counts as
/// idle.
inline constexpr double kMovesNothing = 1e-12;
/// Of the variable, at least 1: step of central differences of exact Jacobians: cube root of ε.
inline constexpr double kSecondDifference = 6e-6;

}  // namespace tangible
