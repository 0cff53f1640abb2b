// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The singular value decomposition of a Jacobian with columns of unit length,
//
//   J = U S Vᵀ L,   L = diag(lengths of the columns)
//
// of which only S and V are needed. They are those of the triangular factor R of J = Q R, which is
// computed from some rows at a time: time N P², memory P². Because J is not squared, condition
// numbers up to 1 / eps can be distinguished.

#include <Eigen/Core>

#include "tangible/math/scalar.h"

namespace tangible {

class Decomposition {
 public:
  /// Singular values above `tolerance` of the largest are directions that J determines.
  Decomposition(const RowMatrixXd& jacobian, double tolerance)
      : Decomposition(jacobian, jacobian.colwise().norm(), tolerance) {}
  /// The same with L given: the lengths that the columns had before an elimination, so that a
  /// column of which little remains is recognised. A length of 0 counts as 1.
  Decomposition(const RowMatrixXd& jacobian, const Eigen::VectorXd& lengths, double tolerance);

  Eigen::Index rank() const { return rank_; }
  Eigen::Index size() const { return length_.size(); }
  /// The condition of J with unit columns; infinite where a singular value is 0.
  double condition() const;
  const Eigen::VectorXd& singular_values() const { return singular_values_; }
  /// Right singular vector i in unscaled columns: L⁻¹ v_i.
  Eigen::VectorXd Direction(Eigen::Index i) const { return v_.col(i).cwiseQuotient(length_); }
  /// (JᵀJ)⁻¹, or its sum over the directions that are determined.
  Eigen::MatrixXd Covariance() const;

 private:
  Eigen::VectorXd length_;
  Eigen::VectorXd singular_values_;
  Eigen::MatrixXd v_;
  Eigen::Index rank_ = 0;
};

/// A⁺ B, with columns of A scaled to unit length and without directions below `tolerance`.
Eigen::MatrixXd PseudoSolve(const RowMatrixXd& a, const RowMatrixXd& b, double tolerance);

}  // namespace tangible
