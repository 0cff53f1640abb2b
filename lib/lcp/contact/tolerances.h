// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of lcp/contact. Each comment names the quantity of which the tolerance is a
// fraction, then the reason. lib/lcp/README.md has the table.

namespace tangible {

/// Of the scale of the row: violations of a mode below it are rounding.
inline constexpr double kModeTolerance = 1e-12;
/// Of the scale of the row: inequalities that hold by less are raised to it at the start of a path,
/// where several would become tight at once.
inline constexpr double kLeastSlack = 1e-6;
/// Of the largest impulse: shifts impulses that symmetry makes equal, so that they do not reach
/// their limits at once on a path of pivots.
inline constexpr double kCentreShift = 1e-4;
/// Of the r M⁻¹ rᵀ of the row: δ of the first proximal step of pivoting.
inline constexpr double kFirstRegularisation = 1e-7;
/// Of the r M⁻¹ rᵀ of the row: δ of the later proximal steps of pivoting: at 1e-10 one path in 400
/// of a pile of 100 discs was lost to rounding.
inline constexpr double kLeastRegularisation = 1e-8;
/// Of the limit of friction: what is at it is pinned at this share of it, the first one where there
/// are few contacts.
inline constexpr double kPinnedFriction[] = {0.7, 0.99};
/// Of the limit of friction: friction that is nearer to it is at it.
inline constexpr double kAtLimit = 1e-3;
/// Of the largest normal impulse: a contact with less carries no load.
inline constexpr double kLeastShare = 1e-3;
/// Of the largest normal impulse: the load at which such a contact is pinned.
inline constexpr double kPinnedShare = 0.02;
/// Of an impulse's way to its limit: extrapolated impulses end this far beyond the limit, so that
/// the mode changes.
inline constexpr double kBeyondLimit = 1e-6;
/// Of the terms: smaller constants and entries of the one-sided LCP are rounding.
inline constexpr double kDirectionRounding = 1e-13;
/// Of the residual asked for: a contact at rest at the limit of friction has a sliding speed of
/// either sign, of the size of its rounding; below this limit it keeps its mode.
inline constexpr double kSlipOfTolerance = 0.3;
/// Of what drives them: larger rates of impulses are an effect of δ: the rows contradict each
/// other.
inline constexpr double kContradictingRate = 1e6;
/// Of mean z s / κ of the interior point: the goal where no polish follows (unrolled derivatives).
inline constexpr double kContactComplementarity = 1e-14;
/// Of mean z s / κ: an interior-point run that ends above it has not converged, and more iterations
/// do not help.
inline constexpr double kNotArrived = 1e-6;
/// Of mean z s / κ: below it an iteration that no longer halves the mean has converged to rounding.
inline constexpr double kArrived = 1e-12;
/// Of the terms of a row: the residual of the equations at which the interior point counts as
/// converged.
inline constexpr double kEquationsHold = 1e-9;
/// Of mean z s: the step is shortened, where that helps, to keep each product above it.
inline constexpr double kNeighbourhood = 1e-4;
/// Of the step to the boundary: several shorter steps in a row mean that rounding has stopped the
/// iteration.
inline constexpr double kShortInteriorStep = 1e-3;
/// Of the unit of z / s of the row: the proximal term of redundant rows in the interior point.
inline constexpr double kProximal = 1e-9;
/// Of the unit of z / s of the row: the proximal term for goals below 1e-15, for which its effect
/// on the equations has to be smaller.
inline constexpr double kLastProximal = 1e-10;
/// Of the speed of a body: a motion that the choice of impulses changes by less does not depend on
/// them.
inline constexpr double kSqueezeMatters = 1e-9;
/// A cosine: normals that are as near press on the same side of a body, and against each other
/// where they are opposite.
inline constexpr double kSameSide = 0.999;
/// Of mean z s / κ: the polish is tried after each goal; the last goal is repeated because rounding
/// may stop the iteration for one step only.
inline constexpr double kInteriorPointGoals[] = {1e-10, 1e-14, 1e-18, 1e-22,
                                                 1e-26, 1e-26, 1e-26, 1e-26};
/// Of the r M⁻¹ rᵀ of the row: used in turn where masses differ by a factor of 1e9: modes that
/// alternate with one value settle with another.
inline constexpr double kRegularisationAgainstCycling[] = {1e-9, 1e-10, kLeastRegularisation};

/// Of the r M⁻¹ rᵀ of the row: δ of the first subspace solves of a descent.
inline constexpr double kDescentRegularisation = 1e-2;
/// Of the r M⁻¹ rᵀ of the row: δ of the active-set steps that follow; with the last one rows that
/// contradict each other by rounding are decided.
inline constexpr double kSettlingRegularisation[] = {1e-4, 1e-7, 1e-10};
/// Of the r M⁻¹ rᵀ of the row: with a larger δ a solve has enough digits for modes without
/// refinement.
inline constexpr double kUnrefined = 5e-8;
/// Of the fastest body's speed, over δ: rounding of the speeds of a solve without refinement.
inline constexpr double kSolveRounding = 1e-15;

}  // namespace tangible
