// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/score_rows.h"

#include <cmath>
#include <utility>

namespace tangible {
namespace {

/// The part of v that is orthogonal to the columns of `qr`.
Eigen::MatrixXd Project(const PivotedQr& qr, const Eigen::MatrixXd& v) {
  if (qr.cols() == 0 || qr.rank() == 0) {
    return v;
  }
  Eigen::MatrixXd rotated = qr.AdjointQTimes(v);
  rotated.topRows(qr.rank()).setZero();
  return qr.QTimes(rotated);
}

PivotedQr Decompose(const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd unit = columns;
  for (Eigen::Index k = 0; k < unit.cols(); ++k) {
    const double length = unit.col(k).norm();
    unit.col(k) /= length > 0.0 ? length : 1.0;
  }
  PivotedQr qr;
  if (unit.size() > 0) {
    qr.Compute(unit);
  }
  return qr;
}

}  // namespace

ScoreRows::ScoreRows(const Eigen::VectorXd& estimate, GradientMethod derivatives,
                     LeastSquaresProblem* problem, std::function<double(double)> root_weight)
    : estimate_(estimate),
      derivatives_(derivatives),
      problem_(problem),
      root_weight_(std::move(root_weight)),
      layout_(*problem) {
  const std::vector<ParameterEntry>& entries = problem->entries();
  for (int k = 0; k < layout_.num_parameters(); ++k) {
    if (IsAtBound(entries[k], estimate[k])) {
      bound_.push_back(k);
    } else if (k < layout_.num_shared()) {
      free_.push_back(k);
    }
  }
}

bool ScoreRows::Evaluate() {
  const Eigen::Index count = layout_.num_rows();
  residuals_ = Eigen::VectorXd::Zero(count);
  free_columns_ = RowMatrixXd::Zero(count, static_cast<Eigen::Index>(free_.size()));
  bound_columns_ = RowMatrixXd::Zero(count, static_cast<Eigen::Index>(bound_.size()));
  square_ = 0.0;
  own_.clear();
  weights_.clear();
  for (int block = 0; block < layout_.num_blocks(); ++block) {
    if (!AddBlock(block)) return false;
  }
  shared_ = Decompose(free_columns_);
  residuals_ = Project(shared_, residuals_);
  free_columns_.resize(0, 0);
  return true;
}

bool ScoreRows::AddBlock(int block) {
  BlockEvaluation evaluation;
  if (!problem_->EvaluateBlock(block, layout_.Local(block, estimate_), derivatives_,
                               BlockDerivatives::kCompute, &evaluation)) {
    return false;
  }
  rollouts_ += evaluation.rollouts;
  const Eigen::Index first = layout_.row_offset(block);
  const Eigen::Index count = evaluation.residuals.size();
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(count, std::sqrt(problem_->weight(block)));
  for (Eigen::Index i = 0; root_weight_ && i < problem_->num_observation_rows(block); ++i) {
    weights[i] *= root_weight_(evaluation.residuals[i]);
  }
  const auto scaled = [&weights](const auto& columns) -> Eigen::MatrixXd {
    return weights.asDiagonal() * columns;
  };
  std::vector<int> own;  // free ones
  for (int i = layout_.num_shared(); i < layout_.num_local(block); ++i) {
    const int k = layout_.ParameterOf(block, i);
    if (!IsAtBound(problem_->entries()[k], estimate_[k])) {
      own.push_back(i);
    }
  }
  const auto& qr = own_.emplace_back(Decompose(scaled(evaluation.jacobian(Eigen::all, own))));
  const Eigen::MatrixXd residuals = scaled(evaluation.residuals);
  square_ += residuals.squaredNorm();
  residuals_.segment(first, count) = Project(qr, residuals);
  free_columns_.middleRows(first, count) =
      Project(qr, scaled(evaluation.jacobian(Eigen::all, free_)));
  for (size_t i = 0; i < bound_.size(); ++i) {
    for (int local = 0; local < layout_.num_local(block); ++local) {
      if (layout_.ParameterOf(block, local) == bound_[i]) {
        bound_columns_.col(static_cast<Eigen::Index>(i)).segment(first, count) =
            scaled(evaluation.jacobian.col(local));
      }
    }
  }
  weights_.push_back(std::move(weights));
  return true;
}

RowMatrixXd ScoreRows::WithoutOwn(int block, const RowMatrixXd& columns) const {
  const Eigen::VectorXd& weights = weights_[static_cast<size_t>(block)];
  RowMatrixXd all = RowMatrixXd::Zero(weights.size(), columns.cols());
  all.topRows(columns.rows()) = weights.head(columns.rows()).asDiagonal() * columns;
  return Project(own_[static_cast<size_t>(block)], all);
}

RowMatrixXd ScoreRows::WithoutShared(const RowMatrixXd& columns) const {
  return Project(shared_, columns);
}

}  // namespace tangible
