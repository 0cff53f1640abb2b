// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How far the derivatives of the residuals at an estimate, by fixed steps, are from those of the
// motion (lib/simulation/certificate): the same scenes by events, beside it.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

struct MotionCheck {
  std::string message;  ///< empty, or why the motion has no derivative
  /// Of each parameter ‖map − motion‖ / max(‖map‖, ‖motion‖) over the residuals, from 0 to 2.
  Eigen::VectorXd difference;
  std::string verdict;  ///< of the motion's derivatives
};

/// Whether a scene of the input has fixed steps.
bool HasFixedSteps(const FitInput& input);

/// `problem` is that of the input and `estimate` has all its parameters.
MotionCheck CheckMotion(const FitInput& input, const Eigen::VectorXd& estimate,
                        RecordingsProblem* problem);

}  // namespace tangible
