// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What the step does to an estimate: the same fit at dt and at dt / 2.
//
//   p(dt) = p* + c dt + O(dt²)   ⇒   p(dt) − p(dt/2) = c dt / 2
//   bias = p(dt) − p* ≈ 2 (p(dt) − p(dt/2))
//
// for a first-order step, as semi-implicit Euler with impacts at step boundaries is.

#include <Eigen/Core>
#include <string>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct DiscretisationCheck {
  double dt = 0.0;
  FitStatus status = FitStatus::kFailed;  ///< of the fit at dt / 2
  std::string message;
  Eigen::VectorXd estimate_half_step;
  Eigen::VectorXd difference;    ///< p(dt) − p(dt/2)
  Eigen::VectorXd bias;          ///< 2 difference: of p(dt), to first order
  Eigen::VectorXd extrapolated;  ///< p(dt) − bias
  long rollouts = 0;
  double seconds = 0.0;
};

/// Fits the problem once more with half the step, from the estimate of `result`; `log` as in Fit.
DiscretisationCheck CheckDiscretisation(const FitProblem& problem, const FitResult& result,
                                        FitLog* log = nullptr);

}  // namespace tangible
