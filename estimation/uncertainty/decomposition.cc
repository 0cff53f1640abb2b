// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/decomposition.h"

#include <Eigen/SVD>
#include <algorithm>
#include <limits>

#include "tangible/math/decompositions.h"

namespace tangible {
namespace {

/// R of a · diag(scale) = Q R: min(rows, columns) x columns.
Eigen::MatrixXd TriangularFactor(const RowMatrixXd& a, const Eigen::VectorXd& scale) {
  const Eigen::Index columns = a.cols();
  // Wide enough that the QR is that of matrices and not of single rows.
  const Eigen::Index chunk = std::max<Eigen::Index>(4 * columns, 64);
  Eigen::MatrixXd r(0, columns);
  for (Eigen::Index first = 0; first < a.rows(); first += chunk) {
    const Eigen::Index count = std::min(chunk, a.rows() - first);
    Eigen::MatrixXd stacked(r.rows() + count, columns);
    stacked.topRows(r.rows()) = r;
    stacked.bottomRows(count) = a.middleRows(first, count) * scale.asDiagonal();
    r = UnpivotedQr(stacked).UpperFactor();
  }
  return r;
}

}  // namespace

Decomposition::Decomposition(const RowMatrixXd& jacobian, const Eigen::VectorXd& lengths,
                             double tolerance)
    : length_(lengths) {
  for (double& length : length_) {
    length = length > 0.0 ? length : 1.0;
  }
  v_ = Eigen::MatrixXd::Identity(size(), size());
  if (jacobian.size() == 0) {
    return;
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(TriangularFactor(jacobian, length_.cwiseInverse()),
                                              Eigen::ComputeFullV);
  singular_values_ = svd.singularValues();
  v_ = svd.matrixV();
  while (rank_ < singular_values_.size() &&
         singular_values_[rank_] > tolerance * singular_values_[0]) {
    ++rank_;
  }
}

double Decomposition::condition() const {
  const Eigen::VectorXd& s = singular_values_;
  const bool full = s.size() == size() && s.size() > 0 && s[s.size() - 1] > 0.0;
  return full ? s[0] / s[s.size() - 1] : std::numeric_limits<double>::infinity();
}

Eigen::MatrixXd Decomposition::Covariance() const {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size(), size());
  for (Eigen::Index i = 0; i < rank_; ++i) {
    const Eigen::VectorXd v = Direction(i) / singular_values_[i];
    sum += v * v.transpose();
  }
  return sum;
}

Eigen::MatrixXd PseudoSolve(const RowMatrixXd& a, const RowMatrixXd& b, double tolerance) {
  if (a.size() == 0 || b.cols() == 0) {
    return Eigen::MatrixXd::Zero(a.cols(), b.cols());
  }
  Eigen::VectorXd length = a.colwise().norm();
  for (double& x : length) {
    x = x > 0.0 ? x : 1.0;
  }
  OrthogonalDecomposition qr;
  qr.SetThreshold(tolerance);
  qr.Compute(a * length.cwiseInverse().asDiagonal());
  return length.cwiseInverse().asDiagonal() * qr.Solve(Eigen::MatrixXd(b));
}

}  // namespace tangible
