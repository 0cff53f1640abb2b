// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/block_system.h"

#include <utility>

#include "tangible/estimation/uncertainty/decomposition.h"
#include "tangible/estimation/uncertainty/tolerances.h"

namespace tangible {
namespace {

Eigen::MatrixXd Stack(const std::vector<Eigen::MatrixXd>& parts, Eigen::Index columns) {
  Eigen::Index num_rows = 0;
  for (const Eigen::MatrixXd& part : parts) {
    num_rows += part.rows();
  }
  Eigen::MatrixXd stacked(num_rows, columns);
  Eigen::Index first = 0;
  for (const Eigen::MatrixXd& part : parts) {
    stacked.middleRows(first, part.rows()) = part;
    first += part.rows();
  }
  return stacked;
}

}  // namespace

BlockSystem::BlockSystem(const BlockLayout& layout, const std::vector<RowMatrixXd>& blocks,
                         const std::vector<bool>& held)
    : layout_(layout) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(layout.num_parameters());
  for (int b = 0; b < layout.num_blocks(); ++b) {
    const int num_own = layout.num_own(b);
    const Eigen::VectorXd local = blocks[b].colwise().squaredNorm();
    squares.head(layout.num_shared()) += local.tail(layout.num_shared());
    squares.segment(layout.own_offset(b), num_own) += local.head(num_own);
  }
  for (Eigen::Index k = 0; k < squares.size(); ++k) {
    squares[k] = held[k] ? 0.0 : squares[k];
  }
  lengths_ = squares.cwiseSqrt();
  scale_ = (lengths_.array() > 0.0).select(lengths_.cwiseInverse(), 0.0);
  for (int b = 0; b < layout.num_blocks(); ++b) {
    const int num_own = layout.num_own(b);
    Block& block = blocks_.emplace_back();
    block.own =
        blocks[b].leftCols(num_own) * scale_.segment(layout.own_offset(b), num_own).asDiagonal();
    block.shared =
        blocks[b].rightCols(layout.num_shared()) * scale_.head(layout.num_shared()).asDiagonal();
    if (block.own.size() > 0) {
      block.qr.SetThreshold(kJacobianRank);
      block.qr.Compute(block.own);
      block.rank = block.qr.rank();
    }
  }
}

Eigen::MatrixXd BlockSystem::Complement(const Block& block, const Eigen::MatrixXd& x) {
  if (block.rank == 0) {
    return x;
  }
  const Eigen::MatrixXd turned = block.qr.AdjointQTimes(x);
  return turned.bottomRows(x.rows() - block.rank);
}

Eigen::VectorXd BlockSystem::Unscaled(const Eigen::VectorXd& scaled) const {
  return scaled.cwiseProduct(scale_);
}

void BlockSystem::SolveOwn(const Eigen::VectorXd& y, const std::vector<Eigen::VectorXd>& c,
                           Eigen::VectorXd* scaled) const {
  for (int b = 0; b < layout_.num_blocks(); ++b) {
    const Block& block = blocks_[b];
    if (block.rank > 0) {
      const Eigen::VectorXd right = block.shared * y + c[b];
      scaled->segment(layout_.own_offset(b), layout_.num_own(b)) = -block.qr.Solve(right);
    }
  }
}

Eigen::VectorXd BlockSystem::LeastSquares(const std::vector<Eigen::VectorXd>& c) const {
  const int num_shared = layout_.num_shared();
  std::vector<Eigen::MatrixXd> parts;
  for (int b = 0; b < layout_.num_blocks(); ++b) {
    Eigen::MatrixXd right(blocks_[b].shared.rows(), num_shared + 1);
    right << blocks_[b].shared, c[b];
    parts.push_back(Complement(blocks_[b], right));
  }
  Eigen::VectorXd scaled = Eigen::VectorXd::Zero(layout_.num_parameters());
  const Eigen::MatrixXd stacked = Stack(parts, num_shared + 1);
  if (num_shared > 0 && stacked.rows() > 0) {
    OrthogonalDecomposition qr;
    qr.SetThreshold(kJacobianRank);
    qr.Compute(stacked.leftCols(num_shared));
    scaled.head(num_shared) = -qr.Solve(Eigen::VectorXd(stacked.col(num_shared)));
  }
  SolveOwn(scaled.head(num_shared), c, &scaled);
  return Unscaled(scaled);
}

Eigen::VectorXd BlockSystem::Newton(const Eigen::VectorXd& gradient) const {
  const int num_shared = layout_.num_shared();
  const Eigen::VectorXd g = gradient.cwiseProduct(scale_);
  std::vector<Eigen::VectorXd> a;
  std::vector<Eigen::MatrixXd> parts;
  Eigen::VectorXd shared_gradient = g.head(num_shared);
  for (int b = 0; b < layout_.num_blocks(); ++b) {
    const Block& block = blocks_[b];
    a.emplace_back(Eigen::VectorXd::Zero(block.shared.rows()));
    if (block.rank > 0) {
      const Eigen::VectorXd own = g.segment(layout_.own_offset(b), layout_.num_own(b));
      a.back() = block.qr.PseudoInverse().transpose() * own;
    }
    shared_gradient -= block.shared.transpose() * a.back();
    parts.push_back(Complement(block, block.shared));
  }
  Eigen::VectorXd scaled = Eigen::VectorXd::Zero(layout_.num_parameters());
  const Eigen::MatrixXd stacked = Stack(parts, num_shared);
  if (num_shared > 0 && stacked.rows() > 0) {
    const Decomposition hessian(stacked, Eigen::VectorXd::Ones(num_shared), kJacobianRank);
    scaled.head(num_shared) = -hessian.Covariance() * shared_gradient;
  }
  SolveOwn(scaled.head(num_shared), a, &scaled);
  return Unscaled(scaled);
}

}  // namespace tangible
