// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Lemke's complementary pivoting with the lexicographic ratio test, for the plain LCP
//
//   w = W z + q + d z₀,   w ≥ 0, z ≥ 0, wᵀ z = 0,   d > 0 the covering vector.
//
// z₀ starts large enough that z = 0 is feasible; each pivot moves along an edge of almost
// complementary points; the path ends at a solution when z₀ = 0, or without one on an unbounded
// edge (a ray). For monotone, P and copositive-plus W a ray proves that no solution exists; for
// others it proves nothing. The lexicographic rule decides between equal ratios always in the same
// way, so that no basis occurs twice.
//
// R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem (1992), section 4.4.

#include <optional>

#include "tangible/lcp/dense/problem.h"

namespace tangible {

struct LemkeOptions {
  /// Bound on pivots; 0: from the size, 1e8 / n² + 50 n, at most 200000. A path can need 2ⁿ pivots.
  int max_pivots = 0;
  VectorX<double> covering{};  ///< d > 0, in equilibrated rows; empty: ones
};

enum class LemkeStatus { kSolved, kRay, kPivotLimit };

struct LemkeResult {
  LemkeStatus status = LemkeStatus::kPivotLimit;
  VectorX<double> z;  ///< nz; the basic solution where it ended (z₀ > 0 unless kSolved)
  int pivots = 0;
};

/// A pivot costs 2 n².
LemkeResult SolveLemke(const MatrixX<double>& W, const VectorX<double>& q,
                       const LemkeOptions& options = {});

/// Follows the path from a start whose basis, the z > 0, is nearly that of a solution: the problem
/// is pivoted to that basis by one factorisation (principal pivotal transform, section 2.3 of the
/// same book), which restores the digits that the many pivots of a long path have lost to rounding,
/// and leaves only a short path. kPivotLimit where that basis is singular.
LemkeResult SolveLemkeFrom(const VectorX<double>& start, const MatrixX<double>& W,
                           const VectorX<double>& q, const LemkeOptions& options = {});

/// The plain LCP that remains when (1) and (2) are solved for v and y:
///   v = v0 + v_z z,  y = y0 + y_z z,  W = F + G v_z,  q = c + G v0.
struct ReducedLcp {
  MatrixX<double> W;
  VectorX<double> q;
  VectorX<double> v0;
  MatrixX<double> v_z;
  VectorX<double> y0;
  MatrixX<double> y_z;
};

/// By complete orthogonal decomposition, so that A may have redundant rows (y of least norm). Empty
/// if (1), (2) cannot be solved for every z (A v = b contradictory, or M singular).
std::optional<ReducedLcp> ReduceToPlain(const MixedLcp<double>& problem);

}  // namespace tangible
