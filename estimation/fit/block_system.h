// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Linear least squares in blocks that share some of their unknowns,
//
//   minimise over x_0, x_1, ..., y    1/2 Σ_b ‖A_b x_b + B_b y + c_b‖²              (1)
//
// by the Schur complement, in its orthogonal form, which does not square the condition: with P_b
// the projection onto the range of A_b,
//
//   minimise over y   1/2 Σ_b ‖(1 − P_b)(B_b y + c_b)‖²                             (2)
//   x_b = −A_b⁺ (B_b y + c_b)                                                       (3)
//
// Columns are scaled to unit length. Directions with a singular value below kJacobianRank of the
// largest are left out of the step, and so are unknowns that are held.
//
// For Newton's method the gradient g is not Σ [A B]ᵀ c,
//
//   minimise    1/2 Σ_b ‖A_b x_b + B_b y‖² + Σ_b g_bᵀ x_b + g_sᵀ y                  (4)
//
// With a_b = (A_bᵀ)⁺ g_b in the place of c_b it is (1) with the gradient g_s − Σ B_bᵀ a_b of y.

#include <Eigen/Core>
#include <vector>

#include "tangible/estimation/problem/least_squares.h"
#include "tangible/math/decompositions.h"

namespace tangible {

class BlockSystem {
 public:
  /// `blocks` are [A_b B_b]; `held` says for each unknown, in the order of `layout` (shared ones,
  /// then those of each block), whether it is held.
  BlockSystem(const BlockLayout& layout, const std::vector<RowMatrixXd>& blocks,
              const std::vector<bool>& held);

  /// The solution of (1), in the order of the layout.
  Eigen::VectorXd LeastSquares(const std::vector<Eigen::VectorXd>& c) const;
  /// The solution of (4), with the gradient in the order of the layout.
  Eigen::VectorXd Newton(const Eigen::VectorXd& gradient) const;

  /// ‖[A B]_k‖ of each unknown; 0 of one that is held.
  const Eigen::VectorXd& lengths() const { return lengths_; }

 private:
  struct Block {
    Eigen::MatrixXd own, shared;  ///< A and B in scaled columns
    OrthogonalDecomposition qr;   ///< of A
    Eigen::Index rank = 0;
  };
  /// The rows of (1 − P) x, in an orthonormal basis.
  static Eigen::MatrixXd Complement(const Block& block, const Eigen::MatrixXd& x);
  Eigen::VectorXd Unscaled(const Eigen::VectorXd& scaled) const;
  void SolveOwn(const Eigen::VectorXd& y, const std::vector<Eigen::VectorXd>& c,
                Eigen::VectorXd* scaled) const;

  const BlockLayout& layout_;
  Eigen::VectorXd lengths_;
  Eigen::VectorXd scale_;  ///< of columns: 1 / length, 0 of those that have no part
  std::vector<Block> blocks_;
};

}  // namespace tangible
