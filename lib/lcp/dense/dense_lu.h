// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Dense LU with partial pivoting for every scalar, P K = L U, n x n; solves K x = r and Kᵀ x = r.
//
// Eigen's LU is not used because its vector solves skip entries of the right-hand side whose
// *value* is zero and thereby lose their derivatives (a body at rest). Here no entry is ever
// skipped. Pivots are chosen by value; a derivative does not depend on the order of elimination.

#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

template <typename T>
class DenseLu {
 public:
  /// Factorises. Cost n³/3. Returns false if a pivot's value is zero or not finite; then the
  /// factorisation must not be used.
  bool Compute(const MatrixX<T>& matrix);

  /// K⁻¹ r. Cost n².
  VectorX<T> Solve(const VectorX<T>& r) const;
  /// K⁻ᵀ r. Cost n².
  VectorX<T> SolveTransposed(const VectorX<T>& r) const;

  /// The smallest pivot over the largest, by value: a cheap indicator of near singularity.
  double pivot_ratio() const { return pivot_ratio_; }

 private:
  MatrixX<T> lu_;
  std::vector<Eigen::Index> order_;  // row i of P K is row order_[i] of K
  double pivot_ratio_ = 0.0;
};

}  // namespace tangible
