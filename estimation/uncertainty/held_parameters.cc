// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/held_parameters.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tangible/estimation/uncertainty/score_rows.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

/// The numbers that are held, and their columns without what free own parameters can do.
struct HeldRows {
  RowMatrixXd columns;
  std::vector<ParameterEntry> candidates;
};

/// False where there is no number or a run fails.
bool GatherHeld(const Eigen::VectorXd& estimate, const HeldOptions& options,
                LeastSquaresProblem* problem, ScoreRows* score, HeldRows* rows) {
  const BlockLayout& layout = score->layout();
  std::map<std::string, int> index;
  // The candidates come first, because they determine the number of columns.
  std::vector<HeldColumns> held(static_cast<size_t>(layout.num_blocks()));
  for (int block = 0; block < layout.num_blocks(); ++block) {
    held[block] = problem->EvaluateHeld(block, layout.Local(block, estimate), options.derivatives,
                                        options.most_candidates);
    for (const ParameterEntry& entry : held[block].entries) {
      if (index.emplace(entry.name, static_cast<int>(index.size())).second) {
        rows->candidates.push_back(entry);
      }
    }
  }
  if (rows->candidates.empty() || !score->Evaluate()) return false;
  rows->columns =
      RowMatrixXd::Zero(layout.num_rows(), static_cast<Eigen::Index>(rows->candidates.size()));
  for (int block = 0; block < layout.num_blocks(); ++block) {
    if (held[block].entries.empty()) continue;
    const RowMatrixXd left = score->WithoutOwn(block, held[block].columns);
    for (Eigen::Index k = 0; k < left.cols(); ++k) {
      rows->columns.col(index.at(held[block].entries[static_cast<size_t>(k)].name))
          .segment(layout.row_offset(block), left.rows()) = left.col(k);
    }
  }
  return true;
}

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
  ScoreRows score(estimate, options.derivatives, problem);
  HeldRows rows;
  if (!GatherHeld(estimate, options, problem, &score, &rows)) {
    return found;
  }
  const Eigen::VectorXd& residuals = score.residuals();
  const RowMatrixXd own = score.WithoutShared(rows.columns);
  const double chance =
      options.least_deviations * options.least_deviations / static_cast<double>(residuals.size());
  for (size_t i = 0; i < rows.candidates.size(); ++i) {
    const Eigen::Index k = static_cast<Eigen::Index>(i);
    HeldParameter held;
    if (!TestOne(rows.candidates[i], rows.columns.col(k), own.col(k), residuals, &held) ||
        !(held.cost_share > chance)) {
      continue;
    }
    held.releases = Released(problem->entries(), estimate, score.bound(), score.bound_columns(),
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
