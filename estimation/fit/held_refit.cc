// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/held_refit.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "tangible/estimation/fit/minimise.h"

namespace tangible {
namespace {

// Of one number; the fit begins at a minimum of the others.
constexpr int kRefitIterations = 20;
// The best numbers are fitted until so many are confirmed.
constexpr int kMostConfirmed = 3;
// Fits of more recordings, which would take several times as long, are told of to first order.
constexpr int kMostRefitBlocks = 30;

/// `estimate` with the value of the released parameter after the shared ones.
Eigen::VectorXd With(const Eigen::VectorXd& estimate, int at, double value) {
  Eigen::VectorXd all(estimate.size() + 1);
  all << estimate.head(at), value, estimate.tail(estimate.size() - at);
  return all;
}

/// Fits one number; false where it cannot be released or no run is possible.
bool Refit(const FitOptions& options, LeastSquaresProblem* problem, FitResult* result,
           HeldParameter* held) {
  const std::unique_ptr<LeastSquaresProblem> released = problem->Released(held->path);
  if (released == nullptr) {
    return false;
  }
  const int at = problem->num_shared();
  FitOptions few = options;
  few.max_iterations = kRefitIterations;
  const Minimum minimum = Minimise(
      few, With(result->estimate, at, held->value), [] { return 0.0; }, {}, released.get());
  result->rollouts += minimum.rollouts;
  if (minimum.status == FitStatus::kFailed) {
    return false;
  }
  held->refitted = true;
  held->refitted_value = minimum.parameters[at];
  held->refitted_share = 1.0 - minimum.cost / result->final_cost;
  held->releases.clear();
  const std::vector<ParameterEntry>& entries = problem->entries();
  for (Eigen::Index k = 0; k < result->estimate.size(); ++k) {
    const ParameterEntry& entry = entries[static_cast<size_t>(k)];
    if (IsAtBound(entry, result->estimate[k]) &&
        !IsAtBound(entry, minimum.parameters[k < at ? k : k + 1])) {
      held->releases.push_back(entry.name);
    }
  }
  return true;
}

}  // namespace

std::vector<HeldParameter> ConfirmHeld(const FitOptions& options, const HeldOptions& held,
                                       const std::vector<HeldParameter>& found,
                                       LeastSquaresProblem* problem, FitResult* result) {
  const double chance =
      held.least_deviations * held.least_deviations / static_cast<double>(result->residuals.size());
  if (problem->num_blocks() > kMostRefitBlocks) {
    return found;
  }
  std::vector<HeldParameter> confirmed;
  std::vector<HeldParameter> first_order;
  for (HeldParameter one : found) {
    if (static_cast<int>(confirmed.size()) == kMostConfirmed) {
      break;
    }
    if (!Refit(options, problem, result, &one)) {
      first_order.push_back(std::move(one));
    } else if (one.refitted_share > (one.releases.empty() ? held.least_share : chance)) {
      confirmed.push_back(std::move(one));
    }
  }
  std::stable_sort(
      confirmed.begin(), confirmed.end(), [](const HeldParameter& a, const HeldParameter& b) {
        return a.releases.empty() != b.releases.empty() ? b.releases.empty()
                                                        : a.refitted_share > b.refitted_share;
      });
  confirmed.insert(confirmed.end(), first_order.begin(), first_order.end());
  return confirmed;
}

}  // namespace tangible
