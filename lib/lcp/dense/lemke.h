// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Lemke's complementary pivoting with the lexicographic ratio test, for the plain LCP
//
//   w = W z + q + d z₀,   w ≥ 0, z ≥ 0, wᵀ z = 0,   d > 0 the covering vector.
//
// z₀ starts large enough that z = 0 is feasible; each pivot moves along an edge of almost
// complementary points; z₀ = 0 ends at a solution, an unbounded edge (a ray) ends without one. For
// monotone, P and copositive-plus W a ray means that there is none; for others it means nothing.
// The lexicographic rule makes every pivot decide ties in one way, so that no basis comes twice.
//
// R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem (1992), section 4.4.

#include <optional>

#include "tangible/lcp/dense/problem.h"

namespace tangible {

struct LemkeOptions {
  /// Bound on pivots; 0: from the size, 1e8 / n² + 50 n, at most 200000. The path can have 2ⁿ.
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

/// The path from a start whose basis, the z > 0, is nearly that of a solution: the problem is
/// pivoted to it by a factorisation (principal pivotal transform, section 2.3 there), which regains
/// what the many pivots of a long path have lost to rounding, and leaves a short path to go.
/// kPivotLimit where that basis is singular.
LemkeResult SolveLemkeFrom(const VectorX<double>& start, const MatrixX<double>& W,
                           const VectorX<double>& q, const LemkeOptions& options = {});

/// The plain LCP that is left when (1) and (2) are solved for v and y:
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
