// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Eigen's decompositions of dense matrices of doubles, compiled once.
//
// As templates they are instantiated in each source that uses them, and each one takes 4 to 11 s
// of compilation with -O3 and 8 to 24 s under the sanitizers (g++ 12). The functions of these
// classes stand in decompositions.cc. They do what Eigen's do, to the same bits:
//
//   - arguments are plain vectors and matrices, to which Eigen would evaluate expressions too;
//   - a vector is solved as a vector and not as a matrix with one column, for which Eigen adds in
//     another order. An expression must therefore be made one or the other by the caller: the
//     overloads of Solve are ambiguous for it.
//
// Requirements and results for rank-deficient matrices are those of Eigen's documentation.
// Matrices of fixed size and of other scalars, and decompositions that one source alone uses,
// remain Eigen's.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/QR>

#include "tangible/math/scalar.h"

namespace tangible {

/// A P = Q [T 0; 0 0] Z with T upper triangular, rank x rank; solves for the least-squares solution
/// of least norm (Eigen::CompleteOrthogonalDecomposition).
class OrthogonalDecomposition {
 public:
  OrthogonalDecomposition();
  explicit OrthogonalDecomposition(const MatrixX<double>& matrix);

  /// Pivots up to `threshold` of the largest count as zero. To be set before Compute.
  void SetThreshold(double threshold);
  void Compute(const MatrixX<double>& matrix);

  Eigen::Index rank() const;
  VectorX<double> Solve(const VectorX<double>& rhs) const;
  MatrixX<double> Solve(const MatrixX<double>& rhs) const;
  /// Of the transposed matrix.
  VectorX<double> SolveTransposed(const VectorX<double>& rhs) const;
  /// Qᵀ x.
  MatrixX<double> AdjointQTimes(const MatrixX<double>& x) const;
  MatrixX<double> PseudoInverse() const;
  /// T, in the upper triangle of the first `rank` rows and columns; the rest is not to be read.
  const MatrixX<double>& triangle() const { return decomposition_.matrixT(); }

 private:
  Eigen::CompleteOrthogonalDecomposition<MatrixX<double>> decomposition_;
};

/// A P = Q R with pivoting of columns (Eigen::ColPivHouseholderQR).
class PivotedQr {
 public:
  /// Of no rows and no columns.
  PivotedQr();
  explicit PivotedQr(const MatrixX<double>& matrix);

  /// Pivots up to `threshold` of the largest count as zero.
  void SetThreshold(double threshold);
  void Compute(const MatrixX<double>& matrix);

  Eigen::Index cols() const { return qr_.cols(); }
  Eigen::Index rank() const;
  /// A least-squares solution.
  VectorX<double> Solve(const VectorX<double>& rhs) const;
  /// The whole of Q, square. The columns after the first `rank` are orthogonal to those of A.
  MatrixX<double> Q() const;
  /// Q x.
  MatrixX<double> QTimes(const MatrixX<double>& x) const;
  /// Qᵀ x.
  MatrixX<double> AdjointQTimes(const MatrixX<double>& x) const;

 private:
  Eigen::ColPivHouseholderQR<MatrixX<double>> qr_;
};

/// A = Q R without pivoting (Eigen::HouseholderQR).
class UnpivotedQr {
 public:
  explicit UnpivotedQr(const MatrixX<double>& matrix);

  /// The least-squares solution; the columns must be linearly independent.
  VectorX<double> Solve(const VectorX<double>& rhs) const;
  /// The rows of R that are not zero: min(rows, columns) x columns.
  MatrixX<double> UpperFactor() const;

 private:
  Eigen::HouseholderQR<MatrixX<double>> qr_;
};

/// Replaces A by R of A = Q R, of the same size, in place.
void MakeUpperTriangular(MatrixX<double>* matrix);

/// A = L Lᵀ (Eigen::LLT).
class Cholesky {
 public:
  Cholesky();
  explicit Cholesky(const MatrixX<double>& matrix);

  void Compute(const MatrixX<double>& matrix);

  /// Whether it is positive definite; the functions below may be called only then.
  bool succeeded() const;
  VectorX<double> Solve(const VectorX<double>& rhs) const;
  MatrixX<double> Solve(const MatrixX<double>& rhs) const;
  /// L⁻ᵀ x.
  MatrixX<double> SolveUpper(const MatrixX<double>& x) const;
  /// L, with zeros above its diagonal.
  MatrixX<double> Lower() const;

 private:
  Eigen::LLT<MatrixX<double>> factor_;
};

/// P A = L U of a square matrix (Eigen::PartialPivLU).
class PartialLu {
 public:
  PartialLu();
  explicit PartialLu(const MatrixX<double>& matrix);

  void Compute(const MatrixX<double>& matrix);

  VectorX<double> Solve(const VectorX<double>& rhs) const;
  MatrixX<double> Solve(const MatrixX<double>& rhs) const;
  /// x ← A⁻¹ x. Eigen adds in another order where a matrix is stored by rows.
  void SolveInPlace(RowMatrixXd* x) const;
  /// Of the transposed matrix.
  VectorX<double> SolveTransposed(const VectorX<double>& rhs) const;
  void SolveTransposedInPlace(RowMatrixXd* x) const;
  /// Estimate of the reciprocal of the condition number.
  double ReciprocalCondition() const;
  /// U in the upper triangle with the diagonal, L below.
  const MatrixX<double>& factors() const { return lu_.matrixLU(); }

 private:
  Eigen::PartialPivLU<MatrixX<double>> lu_;
};

/// Eigenvalues, ascending, and orthonormal eigenvectors of a symmetric matrix, of which the lower
/// triangle is read (Eigen::SelfAdjointEigenSolver).
class SymmetricEigen {
 public:
  explicit SymmetricEigen(const MatrixX<double>& matrix);

  const VectorX<double>& values() const { return values_; }
  /// One a column.
  const MatrixX<double>& vectors() const { return vectors_; }

 private:
  VectorX<double> values_;
  MatrixX<double> vectors_;
};

}  // namespace tangible
