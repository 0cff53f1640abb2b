// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/held_parameters.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

/// The part of v that is orthogonal to the columns of `qr`.
template <typename Matrix>
Matrix Project(const Eigen::ColPivHouseholderQR<Eigen::MatrixXd>& qr, const Matrix& v) {
  if (qr.cols() == 0 || qr.rank() == 0) {
    return v;
  }
  Eigen::MatrixXd rotated = qr.householderQ().adjoint() * v;
  rotated.topRows(qr.rank()).setZero();
  return qr.householderQ() * rotated;
}

Eigen::ColPivHouseholderQR<Eigen::MatrixXd> Decompose(const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd unit = columns;
  for (Eigen::Index k = 0; k < unit.cols(); ++k) {
    const double length = unit.col(k).norm();
    unit.col(k) /= length > 0.0 ? length : 1.0;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
  if (unit.size() > 0) {
    qr.compute(unit);
  }
  return qr;
}

/// The rows of all blocks, from which the free own parameters are eliminated.
struct Rows {
  Eigen::VectorXd residuals;
  RowMatrixXd free;   // shared parameters that are not at a bound
  RowMatrixXd bound;  // all parameters that are
  RowMatrixXd held;
  std::vector<ParameterEntry> candidates;
};

/// Gathers the rows of a problem at its estimate.
class Gatherer {
 public:
  Gatherer(const Eigen::VectorXd& estimate, const HeldOptions& options,
           LeastSquaresProblem* problem)
      : estimate_(estimate), options_(options), problem_(problem), layout_(*problem) {
    const std::vector<ParameterEntry>& entries = problem->entries();
    for (int k = 0; k < layout_.num_parameters(); ++k) {
      if (IsAtBound(entries[k], estimate[k])) {
        bound_.push_back(k);
      } else if (k < layout_.num_shared()) {
        free_.push_back(k);
      }
    }
  }
  const std::vector<int>& bound() const { return bound_; }

  bool Gather(Rows* rows) {
    const Eigen::Index count = layout_.num_rows();
    rows->residuals = Eigen::VectorXd::Zero(count);
    rows->free = RowMatrixXd::Zero(count, static_cast<Eigen::Index>(free_.size()));
    rows->bound = RowMatrixXd::Zero(count, static_cast<Eigen::Index>(bound_.size()));
    // The candidates come first, because they determine the number of columns.
    std::vector<HeldColumns> held(layout_.num_blocks());
    for (int block = 0; block < layout_.num_blocks(); ++block) {
      held[block] = problem_->EvaluateHeld(block, layout_.Local(block, estimate_),
                                           options_.derivatives, options_.most_candidates);
      for (const ParameterEntry& entry : held[block].entries) {
        if (index_.emplace(entry.name, static_cast<int>(index_.size())).second) {
          rows->candidates.push_back(entry);
        }
      }
    }
    rows->held = RowMatrixXd::Zero(count, static_cast<Eigen::Index>(rows->candidates.size()));
    bool done = !rows->candidates.empty();
    for (int block = 0; block < layout_.num_blocks() && done; ++block) {
      done = AddBlock(block, held[block], rows);
    }
    return done;
  }

 private:
  bool AddBlock(int block, const HeldColumns& held, Rows* rows) {
    BlockEvaluation evaluation;
    if (!problem_->EvaluateBlock(block, layout_.Local(block, estimate_), options_.derivatives,
                                 BlockDerivatives::kCompute, &evaluation)) {
      return false;
    }
    const double root = std::sqrt(problem_->weight(block));
    std::vector<int> own;  // free ones
    for (int i = layout_.num_shared(); i < layout_.num_local(block); ++i) {
      const int k = layout_.ParameterOf(block, i);
      if (!IsAtBound(problem_->entries()[k], estimate_[k])) {
        own.push_back(i);
      }
    }
    const auto qr = Decompose(root * evaluation.jacobian(Eigen::all, own));
    const Eigen::Index first = layout_.row_offset(block);
    const Eigen::Index count = evaluation.residuals.size();
    rows->residuals.segment(first, count) =
        Project<Eigen::MatrixXd>(qr, root * evaluation.residuals);
    rows->free.middleRows(first, count) =
        Project<Eigen::MatrixXd>(qr, root * evaluation.jacobian(Eigen::all, free_));
    for (size_t i = 0; i < bound_.size(); ++i) {
      for (int local = 0; local < layout_.num_local(block); ++local) {
        if (layout_.ParameterOf(block, local) == bound_[i]) {
          rows->bound.col(static_cast<Eigen::Index>(i)).segment(first, count) =
              root * evaluation.jacobian.col(local);
        }
      }
    }
    if (held.entries.empty()) {
      return true;
    }
    RowMatrixXd columns = RowMatrixXd::Zero(count, held.columns.cols());
    columns.topRows(held.columns.rows()) = root * held.columns;
    const RowMatrixXd left = Project<Eigen::MatrixXd>(qr, columns);
    for (Eigen::Index k = 0; k < left.cols(); ++k) {
      rows->held.col(index_.at(held.entries[static_cast<size_t>(k)].name)).segment(first, count) =
          left.col(k);
    }
    return true;
  }

  const Eigen::VectorXd& estimate_;
  const HeldOptions& options_;
  LeastSquaresProblem* problem_;
  BlockLayout layout_;
  std::vector<int> free_, bound_;
  std::map<std::string, int> index_;
};

/// Returns false where the value cannot be distinguished from the free parameters, or may not
/// change in that direction.
bool TestOne(const ParameterEntry& entry, const Eigen::VectorXd& column, const Eigen::VectorXd& own,
             const Eigen::VectorXd& residuals, HeldParameter* held) {
  const double square = own.squaredNorm();
  if (!column.allFinite() || !(square > kSeparable * kSeparable * column.squaredNorm())) {
    return false;
  }
  const double score = own.dot(residuals);
  held->path = entry.name;
  held->value = entry.initial;
  held->change = -score / square;
  held->cost_share = score * score / (square * residuals.squaredNorm());
  const double largest = kLargestChange * std::max(std::abs(entry.initial), entry.scale);
  return std::abs(held->change) <= largest &&
         !(entry.initial <= entry.lower && held->change < 0.0) &&
         !(entry.initial >= entry.upper && held->change > 0.0);
}

/// Names of the parameters at bounds that would leave them with the residuals `after`.
std::vector<std::string> Released(const std::vector<ParameterEntry>& entries,
                                  const Eigen::VectorXd& estimate, const std::vector<int>& bound,
                                  const RowMatrixXd& columns, const Eigen::VectorXd& after) {
  std::vector<std::string> names;
  for (size_t i = 0; i < bound.size(); ++i) {
    const ParameterEntry& entry = entries[bound[i]];
    const double slope = columns.col(static_cast<Eigen::Index>(i)).dot(after);
    const bool lower = estimate[bound[i]] < 0.5 * (entry.lower + entry.upper);
    if (lower ? slope < 0.0 : slope > 0.0) {
      names.push_back(entry.name);
    }
  }
  return names;
}

}  // namespace

std::vector<HeldParameter> FindHeldParameters(const Eigen::VectorXd& estimate,
                                              const HeldOptions& options,
                                              LeastSquaresProblem* problem) {
  std::vector<HeldParameter> found;
  Gatherer gatherer(estimate, options, problem);
  Rows rows;
  if (!gatherer.Gather(&rows)) {
    return found;
  }
  const auto qr = Decompose(rows.free);
  const Eigen::VectorXd residuals = Project<Eigen::MatrixXd>(qr, rows.residuals);
  const RowMatrixXd own = Project<Eigen::MatrixXd>(qr, rows.held);
  const double chance =
      options.least_deviations * options.least_deviations / static_cast<double>(residuals.size());
  for (size_t i = 0; i < rows.candidates.size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    HeldParameter held;
    if (!TestOne(rows.candidates[i], rows.held.col(k), own.col(k), residuals, &held) ||
        !(held.cost_share > chance)) {
      continue;
    }
    held.releases = Released(problem->entries(), estimate, gatherer.bound(), rows.bound,
                             residuals + held.change * own.col(k));
    if (!held.releases.empty() || held.cost_share > options.least_share) {
      found.push_back(held);
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const HeldParameter& a, const HeldParameter& b) {
    return a.releases.empty() != b.releases.empty() ? b.releases.empty()
                                                    : a.cost_share > b.cost_share;
  });
  found.resize(std::min(found.size(), static_cast<size_t>(options.most)));
  return found;
}

std::string Describe(const HeldParameter& held) {
  std::string text = "the observations contradict '" + held.path + "', which is held at " +
                     CompactNumber(held.value, 3);
  if (held.refitted) {
    text += ": fitted with the others it becomes " + CompactNumber(held.refitted_value, 3) +
            " and the cost falls by " + CompactNumber(100.0 * held.refitted_share, 3) + " %";
  } else {
    text += ": released, it would change by " + CompactNumber(held.change, 3) +
            " to first order and the cost fall by " + CompactNumber(100.0 * held.cost_share, 3) +
            " %";
  }
  for (size_t i = 0; i < held.releases.size(); ++i) {
    text += (i == 0 ? ", and it drives '" : ", '") + held.releases[i] + "'";
  }
  return text + (held.releases.empty() ? "" : " into the bound");
}

}  // namespace tangible
