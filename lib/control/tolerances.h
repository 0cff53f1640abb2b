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
/// Of the cost with every residual as large as its target, and at least 1: at a smaller cost the
/// target is met: residuals are below 1e-10, to which joints are projected, and gradients are
/// rounding.
inline constexpr double kNoCost = 1e-20;
/// Of the slope 1 of an angle's residual at its target: where the residual of an angle that wraps
/// has a smaller slope, within 0.1 degrees of half a turn, a cost without gradient is at a maximum.
inline constexpr double kAtMaximum = 1e-3;
/// Of the range of a control: by so much initial controls at a maximum of the cost are offset. The
/// gradient there is in proportion to the offset, and far above its tolerance.
inline constexpr double kStartOffset = 1e-3;
/// Of the largest entry of V: the least shift of states that makes a backward pass convex.
inline constexpr double kLeastShift = 1e-9;
/// Of the same: with a larger shift no step is large enough to be worth trying.
inline constexpr double kLargestShift = 1e9;
/// Of the cost, to first order: the default for the change of the cost, at convergence, if all
/// controls moved by their ranges.
inline constexpr double kGradientTolerance = 1e-6;
/// Of the effect of a step's force on the heaviest body, and in a step of the control's largest
/// effect in the horizon: a control with a smaller effect moves nothing.
inline constexpr double kMovesNothing = 1e-12;
/// Of the diagonal of Q_uu: added where controls do the same, so that one of many least costs is
/// taken; a step then falls short of it by this share.
inline constexpr double kRedundantShare = 1e-9;
/// Of the variable, at least 1: step of central differences of exact Jacobians: cube root of ε.
inline constexpr double kSecondDifference = 6e-6;
/// Of a whole step: after a step that is larger the plan is in the reach of one quadratic, and
/// secants along its steps tell about its curvature.
inline constexpr double kSecantShare = 0.3;
/// Of the lengths of a change and of what a secant lacks along it: with a smaller product of the
/// two the change of rank one is not determined (the skipping rule of Nocedal and Wright).
inline constexpr double kSecantAngle = 1e-8;
/// Of the planned cost: a plan whose motion costs more than this above it does not hold. The
/// integration errors of fixed steps that do hold are below it.
inline constexpr double kMotionShare = 0.05;
/// Of the cost of doing nothing: a smaller excess does not matter, whatever it is a share of. A
/// plan that meets its target has a cost of rounding.
inline constexpr double kNothingShare = 1e-6;
/// Of the cost with every residual as large as its target, and at least 1: a motion that costs less
/// meets its targets to 1e-5, and what it costs beside a plan of no cost is the integrator's error.
inline constexpr double kMovesToTarget = 1e-10;
/// Of the cost: a plan whose best step would decrease it by less, by the quadratic without a shift,
/// is at its least cost; what is left of a gradient is rounding.
inline constexpr double kNoDecrease = 1e-13;
/// Of a target, at least 1: a target is met within it. Plans weigh targets against efforts, and
/// joints and contacts hold what they hold to less.
inline constexpr double kMetTarget = 1e-6;
/// Of the largest effect of the controls on a number of the state: a smaller one is rounding, as of
/// a rail on what is across it.
inline constexpr double kWithoutEffect = 1e-11;
/// Of 1 m or 1 rad: with smaller errors of joints a state is on them. Steps that project keep them
/// to 1e-10, and lengths that are not the same differ by more.
inline constexpr double kOffJoints = 1e-8;
/// Of an inertia: its weight where a state is projected onto joints. Of a pole 20 % longer than the
/// model's it leaves the rate to 0.1 %; the inertia itself would change it by 15 %.
inline constexpr double kTurnWeight = 1000.0;

}  // namespace tangible
