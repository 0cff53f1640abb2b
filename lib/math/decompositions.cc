// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/decompositions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

}  // namespace

OrthogonalDecomposition::OrthogonalDecomposition() = default;
OrthogonalDecomposition::OrthogonalDecomposition(const MatrixXd& matrix) : decomposition_(matrix) {}

void OrthogonalDecomposition::SetThreshold(double threshold) {
  decomposition_.setThreshold(threshold);
}

void OrthogonalDecomposition::Compute(const MatrixXd& matrix) { decomposition_.compute(matrix); }

Index OrthogonalDecomposition::rank() const { return decomposition_.rank(); }

VectorXd OrthogonalDecomposition::Solve(const VectorXd& rhs) const {
  return decomposition_.solve(rhs);
}

MatrixXd OrthogonalDecomposition::Solve(const MatrixXd& rhs) const {
  return decomposition_.solve(rhs);
}

VectorXd OrthogonalDecomposition::SolveTransposed(const VectorXd& rhs) const {
  return decomposition_.transpose().solve(rhs);
}

MatrixXd OrthogonalDecomposition::AdjointQTimes(const MatrixXd& x) const {
  return decomposition_.householderQ().adjoint() * x;
}

MatrixXd OrthogonalDecomposition::PseudoInverse() const { return decomposition_.pseudoInverse(); }

PivotedQr::PivotedQr() = default;
PivotedQr::PivotedQr(const MatrixXd& matrix) : qr_(matrix) {}

void PivotedQr::SetThreshold(double threshold) { qr_.setThreshold(threshold); }

void PivotedQr::Compute(const MatrixXd& matrix) { qr_.compute(matrix); }

Index PivotedQr::rank() const { return qr_.rank(); }

VectorXd PivotedQr::Solve(const VectorXd& rhs) const { return qr_.solve(rhs); }

MatrixXd PivotedQr::Q() const { return qr_.householderQ(); }

MatrixXd PivotedQr::QTimes(const MatrixXd& x) const { return qr_.householderQ() * x; }

MatrixXd PivotedQr::AdjointQTimes(const MatrixXd& x) const {
  return qr_.householderQ().adjoint() * x;
}

UnpivotedQr::UnpivotedQr(const MatrixXd& matrix) : qr_(matrix) {}

VectorXd UnpivotedQr::Solve(const VectorXd& rhs) const { return qr_.solve(rhs); }

MatrixXd UnpivotedQr::UpperFactor() const {
  return qr_.matrixQR().topRows(std::min(qr_.rows(), qr_.cols())).triangularView<Eigen::Upper>();
}

void MakeUpperTriangular(MatrixXd* matrix) {
  const Eigen::HouseholderQR<Eigen::Ref<MatrixXd>> qr(*matrix);
  for (Index j = 0; j < matrix->cols(); ++j) {
    matrix->col(j).tail(std::max<Index>(0, matrix->rows() - j - 1)).setZero();
  }
}

Cholesky::Cholesky() = default;
Cholesky::Cholesky(const MatrixXd& matrix) : factor_(matrix) {}

void Cholesky::Compute(const MatrixXd& matrix) { factor_.compute(matrix); }

bool Cholesky::succeeded() const { return factor_.info() == Eigen::Success; }

VectorXd Cholesky::Solve(const VectorXd& rhs) const { return factor_.solve(rhs); }

MatrixXd Cholesky::Solve(const MatrixXd& rhs) const { return factor_.solve(rhs); }

MatrixXd Cholesky::SolveUpper(const MatrixXd& x) const { return factor_.matrixU().solve(x); }

MatrixXd Cholesky::Lower() const { return factor_.matrixL(); }

PartialLu::PartialLu() = default;
PartialLu::PartialLu(const MatrixXd& matrix) : lu_(matrix) {}

void PartialLu::Compute(const MatrixXd& matrix) { lu_.compute(matrix); }

VectorXd PartialLu::Solve(const VectorXd& rhs) const { return lu_.solve(rhs); }

MatrixXd PartialLu::Solve(const MatrixXd& rhs) const { return lu_.solve(rhs); }

void PartialLu::SolveInPlace(RowMatrixXd* x) const {
  const MatrixXd rhs = *x;
  *x = lu_.solve(rhs);
}

VectorXd PartialLu::SolveTransposed(const VectorXd& rhs) const {
  return lu_.transpose().solve(rhs);
}

void PartialLu::SolveTransposedInPlace(RowMatrixXd* x) const {
  const MatrixXd rhs = *x;
  *x = lu_.transpose().solve(rhs);
}

double PartialLu::ReciprocalCondition() const { return lu_.rcond(); }

SymmetricEigen::SymmetricEigen(const MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(matrix);
  values_ = solver.eigenvalues();
  vectors_ = solver.eigenvectors();
}

}  // namespace tangible
