// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/mode_system.h"

#include <cmath>

#include "tangible/lcp/dense/tolerances.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

void StoreError(const VectorXd& residual, const VectorXd& rhs, double* relative_error) {
  if (relative_error == nullptr) return;
  const double size = rhs.size() > 0 ? rhs.cwiseAbs().maxCoeff() : 0.0;
  *relative_error = size > 0.0 ? residual.cwiseAbs().maxCoeff() / size : 0.0;
}

}  // namespace

ModeSystem::ModeSystem(const MixedLcp<double>& problem, const std::vector<RowMode>& modes,
                       const VectorXd& kink_weight)
    : nv_(problem.num_v()), ny_(problem.num_y()), nz_(problem.num_z()) {
  for (Index i = 0; i < nz_; ++i) {
    if (modes[i] != RowMode::kInactive) rows_.push_back(i);
  }
  const Index num_rows = static_cast<Index>(rows_.size());
  const Index n = nv_ + ny_ + num_rows;
  const MatrixXd G = problem.G(rows_, Eigen::all);
  MatrixXd K = MatrixXd::Zero(n, n);
  K.topLeftCorner(nv_, nv_) = problem.M;
  K.block(0, nv_, nv_, ny_) = -problem.A.transpose();
  K.topRightCorner(nv_, num_rows) = -G.transpose();
  K.block(nv_, 0, ny_, nv_) = problem.A;
  K.bottomLeftCorner(num_rows, nv_) = G;
  K.bottomRightCorner(num_rows, num_rows) = problem.F(rows_, rows_);
  for (Index k = 0; k < num_rows; ++k) {
    if (modes[rows_[k]] == RowMode::kKink) K(nv_ + ny_ + k, nv_ + ny_ + k) += kink_weight[rows_[k]];
  }
  scaling_ = Equilibrate(K);
  K_ = scaling_.row.asDiagonal() * K * scaling_.col.asDiagonal();
  if (n == 0) return;
  lu_.Compute(K_);
  // The estimate of the condition is meaningless where a pivot is zero or nearly zero.
  const auto pivots = lu_.factors().diagonal().cwiseAbs();
  const bool vanishing = !(pivots.minCoeff() > kSingularMatrix * pivots.maxCoeff());
  const double reciprocal = vanishing ? 0.0 : lu_.ReciprocalCondition();
  singular_ = !(reciprocal > kSingularMatrix);
  condition_ = 1.0 / reciprocal;
  if (!singular_) return;
  orthogonal_.SetThreshold(kRankTolerance);
  orthogonal_.Compute(K_);
  const Index rank = orthogonal_.rank();
  rank_deficiency_ = static_cast<int>(n - rank);
  const auto& triangle = orthogonal_.triangle();
  condition_ = rank > 0 ? std::abs(triangle(0, 0) / triangle(rank - 1, rank - 1)) : 1.0;
}

VectorXd ModeSystem::Gather(const LcpVector& x) const {
  VectorXd gathered(nv_ + ny_ + static_cast<Index>(rows_.size()));
  gathered << x.v, x.y, x.z(rows_);
  return gathered;
}

LcpVector ModeSystem::Scatter(const VectorXd& x) const {
  LcpVector scattered{x.head(nv_), x.segment(nv_, ny_), VectorXd::Zero(nz_)};
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    scattered.z[rows_[k]] = x[nv_ + ny_ + static_cast<Index>(k)];
  }
  return scattered;
}

LcpVector ModeSystem::Solve(const LcpVector& r, double* relative_error) const {
  const VectorXd rhs = scaling_.row.cwiseProduct(Gather(r));
  VectorXd x = VectorXd::Zero(rhs.size());
  VectorXd residual = rhs;
  for (int k = 0; k < 3 && rhs.size() > 0; ++k) {
    x += singular_ ? orthogonal_.Solve(residual) : lu_.Solve(residual);
    residual = rhs - K_ * x;
  }
  StoreError(residual, rhs, relative_error);
  return Scatter(scaling_.col.cwiseProduct(x));
}

LcpVector ModeSystem::SolveTransposed(const LcpVector& g, double* relative_error) const {
  const VectorXd rhs = scaling_.col.cwiseProduct(Gather(g));
  VectorXd x = VectorXd::Zero(rhs.size());
  VectorXd residual = rhs;
  for (int k = 0; k < 3 && rhs.size() > 0; ++k) {
    x += singular_ ? orthogonal_.SolveTransposed(residual) : lu_.SolveTransposed(residual);
    residual = rhs - K_.transpose() * x;
  }
  StoreError(residual, rhs, relative_error);
  return Scatter(scaling_.row.cwiseProduct(x));
}

}  // namespace tangible
