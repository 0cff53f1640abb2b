// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of lcp/contact: of what each is a share, then why; lib/lcp/README.md has a table.

namespace tangible {

/// Of the scale of the row: violations of a mode below it are rounding.
inline constexpr double kModeTolerance = 1e-12;
/// Of the scale of the row: inequalities that hold by less are raised to it at the start of a
/// path: its first ties.
inline constexpr double kLeastSlack = 1e-6;
/// Of the largest impulse: breaks the ties that symmetry makes on a path of pivots.
inline constexpr double kCentreShift = 1e-4;
/// Of the r M⁻¹ rᵀ of the row: δ of the first proximal step of pivoting.
inline constexpr double kFirstRegularisation = 1e-7;
/// Of the r M⁻¹ rᵀ of the row: and of the later ones: at 1e-10 one path in 400 of a pile of 100
/// discs was lost to rounding.
inline constexpr double kLeastRegularisation = 1e-8;
/// Of an impulse's way to its limit: extrapolated impulses end beyond it, so that the mode
/// changes.
inline constexpr double kBeyondLimit = 1e-6;
/// Of the terms: constants and entries of the one-sided LCP below it are rounding.
inline constexpr double kDirectionRounding = 1e-13;
/// Of the residual asked for: a contact that rests at the limit of friction slides at speeds of
/// either sign, of the size of its rounding: within this it keeps its mode.
inline constexpr double kSlipOfTolerance = 0.3;
/// Of what drives them: rates of impulses that exceed it are δ's answer to a contradiction.
inline constexpr double kContradictingRate = 1e6;
/// Of mean z s / κ of the interior point: goal where no polish follows (unrolled derivatives).
inline constexpr double kContactComplementarity = 1e-14;
/// Of mean z s / κ: an interior point that ends above it has not arrived, and going on does not
/// help.
inline constexpr double kNotArrived = 1e-6;
/// Of mean z s / κ: below it an iteration that no longer halves it has arrived: rounding.
inline constexpr double kArrived = 1e-12;
/// Of the terms of a row: the equations of an interior point that has converged.
inline constexpr double kEquationsHold = 1e-9;
/// Of mean z s: products stay above it where shortening the step can keep them there.
inline constexpr double kNeighbourhood = 1e-4;
/// Of the step to the boundary: so many shorter ones in a row mean that rounding has stopped the
/// iteration.
inline constexpr double kShortInteriorStep = 1e-3;
/// Of the unit of z / s of the row: proximal term of redundant rows in the interior point.
inline constexpr double kProximal = 1e-9;
/// Of the unit of z / s of the row: the same for goals below 1e-15, where what it leaves has to
/// go.
inline constexpr double kLastProximal = 1e-10;
/// Of mean z s / κ: after each the polish is tried; rounding may stop the iteration for one step.
inline constexpr double kInteriorPointGoals[] = {1e-10, 1e-14, 1e-18, 1e-22,
                                                 1e-26, 1e-26, 1e-26, 1e-26};
/// Of the r M⁻¹ rᵀ of the row: take turns where masses are 1e9 apart: modes that flicker with one
/// do not with another.
inline constexpr double kStubbornRegularisation[] = {1e-9, 1e-10, kLeastRegularisation};

}  // namespace tangible
