// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The rows of a problem at its estimate, and what is left of a column u = ∂r/∂θ of a number that is
// not estimated once all is taken from it that the free parameters can do:
//
//   ũ = u − J J⁺ u
//
// Own parameters of a block are eliminated from its rows first, then the shared ones from all.
// Parameters at a bound are not free.

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "tangible/estimation/problem/least_squares.h"
#include "tangible/math/decompositions.h"

namespace tangible {

class ScoreRows {
 public:
  /// `root_weight` of a residual multiplies its row; empty: plain squares. The problem must outlive
  /// this object.
  ScoreRows(const Eigen::VectorXd& estimate, GradientMethod derivatives,
            LeastSquaresProblem* problem, std::function<double(double)> root_weight = {});

  /// Evaluates the blocks; false where a run fails.
  bool Evaluate();

  const BlockLayout& layout() const { return layout_; }
  /// The parameters at a bound.
  const std::vector<int>& bound() const { return bound_; }
  /// Their columns.
  const RowMatrixXd& bound_columns() const { return bound_columns_; }
  /// Σ of the weighted squares of the residuals.
  double square() const { return square_; }
  /// The residuals without what all free parameters can do.
  const Eigen::VectorXd& residuals() const { return residuals_; }
  /// Runs that Evaluate has made.
  long rollouts() const { return rollouts_; }

  /// Columns of the first rows of a block, without what its own parameters can do; all its rows.
  RowMatrixXd WithoutOwn(int block, const RowMatrixXd& columns) const;
  /// Columns of the rows of all blocks, without what the shared parameters can do.
  RowMatrixXd WithoutShared(const RowMatrixXd& columns) const;

 private:
  bool AddBlock(int block);

  Eigen::VectorXd estimate_;
  GradientMethod derivatives_;
  LeastSquaresProblem* problem_;
  std::function<double(double)> root_weight_;
  BlockLayout layout_;
  std::vector<int> free_, bound_;         ///< free_: of the shared ones
  std::vector<PivotedQr> own_;            ///< of each block
  std::vector<Eigen::VectorXd> weights_;  ///< of the rows of each block
  PivotedQr shared_;
  Eigen::VectorXd residuals_;
  RowMatrixXd free_columns_, bound_columns_;
  double square_ = 0.0;
  long rollouts_ = 0;
};

}  // namespace tangible
