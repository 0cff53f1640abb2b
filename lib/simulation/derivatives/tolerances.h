// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of derivatives of rollouts. Each comment names the quantity of which the tolerance
// is a fraction, then the reason. lib/simulation/README.md has the table.

namespace tangible {

/// Of speeds that the step changes: how far a step's linearised problem is moved along a direction,
/// to choose among impulses that are not unique.
inline constexpr double kLinearisedWay = 1e-6;
/// Of the speeds that a direction has driven in earlier steps of a rollout: what it drives now is
/// rounding, as once a contact that holds a body has absorbed a change of its speed.
inline constexpr double kAbsorbed = 1e-13;
/// Of the factor of the proximal terms of supports: what contradicts the rows of a support causes
/// impulses that are smaller by that factor, of which a part leaves room for usual ones.
inline constexpr double kOfSupportGive = 1e-2;
/// Of the scaled natural residual: impulses chosen in that way solve the step as well.
inline constexpr double kHoldsAsWell = 1e-9;

}  // namespace tangible
