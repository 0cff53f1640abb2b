// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of lcp/system. Each comment names the quantity of which the tolerance is a
// fraction, then the reason. lib/lcp/README.md has the table.

namespace tangible {

/// Of the r M⁻¹ rᵀ of the row: the proximal term δ of redundant rows, which only selects one of
/// several possible impulses.
inline constexpr double kContactRegularisation = 1e-10;
/// The same of a system that is factorised as a whole, because its rows nearly depend on each
/// other.
inline constexpr double kWholeRegularisation = 1e-14;
/// Of the terms of a row: refinement of a solve ends at rounding level.
inline constexpr double kResidualGoal = 1e-15;
/// Of the terms of a row: lower for derivatives, because those of many steps add up the residuals
/// of each.
inline constexpr double kDerivativeGoal = 1e-18;
/// Of the terms of a row: rows with a larger residual after a proximal step contradict each other.
inline constexpr double kContradictory = 1e-14;
/// Of the terms of a row: a condensed system with a larger residual is factorised as a whole.
inline constexpr double kStalled = 1e-12;
/// Of the residual at the start: goal of the conjugate residuals, which are used where masses are
/// very different.
inline constexpr double kDirectionGoal = 1e-16;
/// Of the norm of a direction: a direction whose remainder outside the span of the others is
/// smaller is discarded as rounding.
inline constexpr double kSpanned = 1e-10;
/// Of the speed of the fastest body: the least scale of a speed: a smaller one times 1e-10 would be
/// the rounding of the fastest body.
inline constexpr double kSlowest = 1e-6;
/// Of a body's momentum at that speed: the least scale of its momentum, of which 1e-10 is some
/// roundings of the impulses on its neighbours.
inline constexpr double kLeastMomentum = 1e-5;
/// Of the longest arm of a body's rows, m: the least lever of its rotation.
inline constexpr double kLeastLever = 1e-3;
/// Of the terms of the sliding speed: below it a contact without friction does not slide in either
/// direction.
inline constexpr double kSlipRounding = 1e-12;
/// Of the norm of a row: poses are known to about 1e-12 of their size.
inline constexpr double kRowRank = 1e-10;
/// Of the norm of a push: the difference between independent directions of impulses has to exceed
/// the error of poses.
inline constexpr double kPushRank = 1e-7;

/// Of the largest normal impulse: a guess of which many impulses exceed their limits by more is
/// given up before its solve is refined.
inline constexpr double kPlainlyBeyond = 1e-3;
/// Absolute: a scale next to the smallest numbers, min / ε, of which no digits are left that could
/// be compared.
inline constexpr double kLeastScale = 1e-292;

}  // namespace tangible
