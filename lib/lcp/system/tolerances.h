// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of lcp/system: of what each is a share, then why. lib/lcp/README.md has the table.

namespace tangible {

/// Of the r M⁻¹ rᵀ of the row: the proximal term δ of redundant rows: it only chooses among
/// impulses that are not unique.
inline constexpr double kContactRegularisation = 1e-10;
/// Of the terms of a row: refinement of a solve ends at rounding level.
inline constexpr double kResidualGoal = 1e-15;
/// Of the terms of a row: derivatives of many steps add up what is left of each.
inline constexpr double kDerivativeGoal = 1e-18;
/// Of the terms of a row: rows that leave more after a proximal step contradict each other.
inline constexpr double kContradictory = 1e-14;
/// Of the terms of a row: a condensed system that leaves more is factorised as a whole.
inline constexpr double kStalled = 1e-12;
/// Of the residual at the start: of the conjugate residuals beside very different masses.
inline constexpr double kDirectionGoal = 1e-16;
/// Of the norm of a direction: what others span but for this is rounding.
inline constexpr double kSpanned = 1e-10;
/// Of the speed of the fastest body: a slower scale times 1e-10 would be the fastest one's
/// rounding.
inline constexpr double kSlowest = 1e-6;
/// Of the longest arm of a body's rows, m: the least lever of its rotation.
inline constexpr double kLeastLever = 1e-3;
/// Of the terms of the sliding speed: below it a contact without friction does not slide either
/// way.
inline constexpr double kSlipRounding = 1e-12;
/// Of the norm of a row: poses are known to about 1e-12 of their size.
inline constexpr double kRowRank = 1e-10;
/// Of the norm of a push: what tells pushes apart has to be more than that.
inline constexpr double kPushRank = 1e-7;

}  // namespace tangible
