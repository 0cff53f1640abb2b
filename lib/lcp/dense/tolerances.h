// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of lcp/dense: of what each is a share, then why. lib/lcp/README.md has the table.

namespace tangible {

/// Of the scaled natural residual: default for a solution; what users of 1e-9 need, with a digit
/// in hand.
inline constexpr double kLcpTolerance = 1e-10;
/// Of the scale of the row, the impulse or the ratio: what rounding leaves of a zero in a solved
/// system of some ten rows.
inline constexpr double kLcpRounding = 1e-14;
/// Of the scale of the row: a z or s below it is 0: above what the polish leaves (1e-15), below
/// the margins that a user may ask for (1e-9).
inline constexpr double kLcpZero = 1e-12;
/// Of the scaled residual: a point with exact zeros wins over one that is better by rounding
/// alone.
inline constexpr double kPolishPreference = 1e-15;
/// Of the residual without the constants p, b, c: a solution whose residual is not far below that
/// meets the tolerance whatever the data are.
inline constexpr double kDependsOnData = 1e-8;
/// Of mean z s of the interior point: tells modes apart down to scaled margins of 1e-10.
inline constexpr double kComplementarityGoal = 1e-20;
/// Of mean z s of the interior point: where no polish follows: what double arithmetic can reach.
inline constexpr double kUnpolishedGoal = 1e-14;
/// Of the residual of the equations: of the interior point, at its end.
inline constexpr double kEquationGoal = 1e-13;
/// Of the diagonal of the equilibrated Newton matrix: redundant joints leave it singular.
inline constexpr double kNewtonShift = 1e-12;
/// Of the step to the boundary: shorter ones are rounding: the iteration has stopped.
inline constexpr double kLeastStep = 1e-12;
/// Of the reciprocal condition, equilibrated: exact redundancy gives 1e-17, a stack with mass
/// ratio 1e6 gives 1e-9.
inline constexpr double kSingularMatrix = 1e-14;
/// Of the largest pivot: of orthogonal decompositions of equilibrated rows.
inline constexpr double kRankTolerance = 1e-12;
/// Of the largest pivot: the same of (v, y), refined once.
inline constexpr double kReducedRank = 1e-13;
/// Of the scale of the row: margins below it are reported as near a kink.
inline constexpr double kNearKinkMargin = 1e-6;
/// Of the largest entry: derivatives that differ by more between tangent and adjoint are not
/// trustworthy: an entry may be off by ten times what the whole shows, and is to be right to 1e-9.
inline constexpr double kLinearResidualLimit = 1e-10;
/// Of the right-hand side: equations that leave more of it contradict each other.
inline constexpr double kConsistent = 1e-9;
/// Of the norm of the matrix times that of its target: where a gradient counts as 0.
inline constexpr double kNnlsGradient = 1e-12;
/// Of a row of norm 1: what no direction moves vanishes on all of them.
inline constexpr double kNoDirection = 1e-8;
/// Of the largest entry: rows below it are rounding of others.
inline constexpr double kVanishingRow = 1e-11;
/// Of the terms of a held row's weight: a kink row that the held rows imply.
inline constexpr double kNoWeight = 1e-10;
/// Of the margin: wider margins cannot hide a row that is bound to its side.
inline constexpr double kSuspectMargin = 1e-3;
/// Of the largest entry of the column, at least 1: Lemke: smaller pivots would blow rounding up.
inline constexpr double kLeastPivot = 1e-11;
/// Of the two ratios: Lemke: equal but for rounding, so that the lexicographic rule decides.
inline constexpr double kRatioTie = 1e-13;
/// Of the diagonal: redundant rows in Jets; three corrections take its error to 1e-27.
inline constexpr double kJetShift = 1e-9;
/// Of the terms of the row: what a proof of infeasibility may leave of 0.
inline constexpr double kFarkasCondition = 1e-10;
/// Of the terms of its right-hand side: a proof has to be far from rounding.
inline constexpr double kProofMargin = 1e-6;
/// Of the largest entry: smaller ones of the proof are 0 ....
inline constexpr double kLeastFarkasEntry = 1e-12;
/// Of the largest entry: ... and larger ones are not, however large the rounding.
inline constexpr double kMostFarkasEntry = 1e-3;
/// Of the diagonal of the equilibrated rows: proximal steps of Lemke's method start with it.
inline constexpr double kFirstShift = 1e-4;
/// Of the diagonal of the equilibrated rows: and fall to these: what is redundant asks for a
/// large shift, what is badly scaled for a small one.
inline constexpr double kLeastShifts[] = {1e-6, 1e-9};
/// Of the scale of the impulse: impulses that are tried as 0: in a cone of nothing else they
/// would count in full.
inline constexpr double kCrumbs[] = {1e-15, 1e-13, 1e-11, 1e-9, 1e-7};

}  // namespace tangible
