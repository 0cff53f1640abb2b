// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Non-negative least squares: min ‖E x − f‖₂ over x with xⱼ ≥ 0 for j ≥ num_free.
//
// It decides whether a system of linear inequalities has a solution, and proves either answer. With
// r = f − E x at the minimum, Eᵀ r = 0 on the free columns and ≤ 0 on the others: if r ≠ 0,
// rᵀ f = ‖r‖² > 0 proves that E x = f has no such x (Farkas).
//
// C. L. Lawson, R. J. Hanson, Solving Least Squares Problems (1974), chapter 23.

#include "tangible/math/scalar.h"

namespace tangible {

struct NnlsResult {
  VectorX<double> x;
  VectorX<double> residual;  ///< f − E x
  bool converged = false;
};

/// E is m x n. Columns should have similar norms. Cost: one rank-revealing QR for each exchange, at
/// most 3 n + 20 exchanges. It has converged when no column's gradient Eᵀ r exceeds 1e-12 ‖E‖ ‖f‖.
NnlsResult SolveNnls(const MatrixX<double>& E, const VectorX<double>& f, Eigen::Index num_free = 0);

}  // namespace tangible
