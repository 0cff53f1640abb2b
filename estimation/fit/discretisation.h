// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The bias of an estimate that is due to the step: the same fit at dt and at dt / 2.
//
//   p(dt) = p* + c dt^k + O(dt^(k+1))   ⇒   p(dt) − p(dt/2) = c dt^k (1 − 2^−k)
//   bias = p(dt) − p* ≈ F (p(dt) − p(dt/2)),   F = 2^k / (2^k − 1)
//
// with the order k of the step: 1 for semi-implicit Euler, 2 for trapezoidal, 4 for runge_kutta_4
// (F = 2, 4/3, 16/15).

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct DiscretisationCheck {
  double dt = 0.0;                        ///< of several recordings the largest
  int order = 1;                          ///< k, of the step
  FitStatus status = FitStatus::kFailed;  ///< of the fit at dt / 2
  std::string message;
  Eigen::VectorXd estimate_half_step;
  Eigen::VectorXd difference;    ///< p(dt) − p(dt/2)
  Eigen::VectorXd bias;          ///< F difference: of p(dt), to leading order
  Eigen::VectorXd extrapolated;  ///< p(dt) − bias
  long rollouts = 0;
  double seconds = 0.0;
};

int OrderOf(Integrator integrator);
/// "first", "second", "fourth".
const char* OrderName(int order);
/// 2^k / (2^k − 1).
double BiasFactor(int order);

/// Repeats the fit with half the step, from the estimate of `result`, with the spreads of
/// parameters that vary held at `spreads`; `log` is that of Fit. Scenes whose steps are of
/// different orders are refused.
DiscretisationCheck CheckDiscretisation(const FitInput& input, const std::vector<double>& spreads,
                                        const FitResult& result, FitLog* log = nullptr);

}  // namespace tangible
