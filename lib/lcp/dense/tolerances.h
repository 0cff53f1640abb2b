// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The tolerances of lcp/dense. Each comment names the quantity of which the tolerance is a
// fraction, then the reason. lib/lcp/README.md has the table.

namespace tangible {

/// Of the scaled natural residual: default for a solution; one digit below the 1e-9 that users
/// need.
inline constexpr double kLcpTolerance = 1e-10;
/// Of the scale of the row, the impulse or the ratio: the rounding error of an exact zero in the
/// solution of a system of some ten rows.
inline constexpr double kLcpRounding = 1e-14;
/// Of the scale of the row: a z or s below it counts as 0; it lies above the error of the polish
/// (1e-15) and below the margins that a user may ask for (1e-9).
inline constexpr double kLcpZero = 1e-12;
/// Of the scaled residual: a point with exact zeros is preferred to one whose residual is lower
/// only by rounding.
inline constexpr double kPolishPreference = 1e-15;
/// Of the residual without the constants p, b, c: a point whose residual is not far below it would
/// meet the tolerance whatever the data are.
inline constexpr double kDependsOnData = 1e-8;
/// Of mean z s of the interior point: at this goal modes are distinguished down to scaled margins
/// of 1e-10.
inline constexpr double kComplementarityGoal = 1e-20;
/// Of mean z s of the interior point: the goal where no polish follows, which is the limit of
/// double arithmetic.
inline constexpr double kUnpolishedGoal = 1e-14;
/// Of the residual of the equations: goal of the interior point at its end.
inline constexpr double kEquationGoal = 1e-13;
/// Of the diagonal of the equilibrated Newton matrix: added because redundant joints make the
/// matrix singular.
inline constexpr double kNewtonShift = 1e-12;
/// Of the step to the boundary: shorter steps are rounding: the iteration has stopped.
inline constexpr double kLeastStep = 1e-12;
/// Of the reciprocal condition, equilibrated: exact redundancy gives 1e-17, a stack with mass
/// ratio 1e6 gives 1e-9.
inline constexpr double kSingularMatrix = 1e-14;
/// Of the largest pivot: rank decisions in orthogonal decompositions of equilibrated rows.
inline constexpr double kRankTolerance = 1e-12;
/// Of the largest pivot: rank decisions in the elimination of (v, y), which is refined once.
inline constexpr double kReducedRank = 1e-13;
/// Of the right-hand side: equations with a larger residual contradict each other.
inline constexpr double kConsistent = 1e-9;
/// Of the norm of the matrix times that of its target: a gradient below it counts as 0.
inline constexpr double kNnlsGradient = 1e-12;
/// Of a row of norm 1: a functional that is smaller on every direction counts as zero.
inline constexpr double kNoDirection = 1e-8;
/// Of the largest entry: rows below it are the rounding of other rows.
inline constexpr double kVanishingRow = 1e-11;
/// Of the terms of a held row's weight: a smaller weight κ means that the kink row is implied by
/// the rows that keep their modes.
inline constexpr double kNoWeight = 1e-10;
/// Of the margin: only rows with smaller margins are checked for being forced to keep their mode by
/// other rows.
inline constexpr double kSuspectMargin = 1e-3;
/// Of the largest entry of the column, at least 1: Lemke: smaller pivots would amplify rounding.
inline constexpr double kLeastPivot = 1e-11;
/// Of the two ratios: Lemke: ratios closer than this are equal up to rounding, and the
/// lexicographic rule decides.
inline constexpr double kRatioTie = 1e-13;
/// Of the diagonal: regularises redundant rows in Jets; three corrections reduce its error to
/// 1e-27.
inline constexpr double kJetShift = 1e-9;
/// Of the terms of the row: the error allowed in the equations of a proof of infeasibility.
inline constexpr double kFarkasCondition = 1e-10;
/// Of the terms of its right-hand side: a proof has to exceed rounding by far.
inline constexpr double kProofMargin = 1e-6;
/// Of the largest entry of a proof of the scaled equations: smaller entries are set to 0, with the
/// least fraction of these with which the proof holds; the solution of ill-conditioned rows has
/// rounding of the larger ones.
inline constexpr double kFarkasEntries[] = {1e-12, 1e-9, 1e-6};
/// Of the same: larger entries of a proof are never set to 0, however large the rounding.
inline constexpr double kMostFarkasEntry = 1e-3;
/// Of the diagonal of the equilibrated rows: the first shift of the proximal steps of Lemke's
/// method.
inline constexpr double kFirstShift = 1e-4;
/// Of the diagonal of the equilibrated rows: their last shifts: redundant rows need a large shift,
/// badly scaled problems a small one.
inline constexpr double kLeastShifts[] = {1e-6, 1e-9};
/// Of the scale of the impulse: smaller impulses are tried as 0, because in a friction cone without
/// larger terms they would count in full.
inline constexpr double kNegligibleImpulses[] = {1e-15, 1e-13, 1e-11, 1e-9, 1e-7};

}  // namespace tangible
