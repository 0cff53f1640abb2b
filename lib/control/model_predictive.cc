// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/model_predictive.h"

#include <chrono>
#include <utility>

namespace tangible {

PredictiveController::PredictiveController(ControlProblem problem, RowMatrixXd controls,
                                           PredictiveOptions options)
    : problem_(std::move(problem)), controls_(std::move(controls)), options_(std::move(options)) {}

VectorX<double> PredictiveController::Control(long k, const VectorX<double>& x) {
  const Eigen::Index steps = controls_.rows();
  if (started_ && steps > 1) {
    controls_.topRows(steps - 1) = controls_.bottomRows(steps - 1).eval();
  }
  started_ = true;
  problem_.initial = x;
  problem_.first_step = k;
  IlqrOptions options = options_.ilqr;
  if (options_.budget > 0.0) {
    const auto end = std::chrono::steady_clock::now() +
                     std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                         std::chrono::duration<double>(options_.budget));
    options.stop = [end] { return std::chrono::steady_clock::now() >= end; };
  }
  last_ = SolveIlqr(problem_, controls_, options);
  if (last_.status != IlqrStatus::kFailed) controls_ = last_.plan.controls;
  return controls_.row(0).transpose().cwiseMax(problem_.low).cwiseMin(problem_.high);
}

}  // namespace tangible
