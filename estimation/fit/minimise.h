// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// One start of a fit: Levenberg-Marquardt by Ceres, then Gauss-Newton steps to the last digits.

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <functional>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// Minimises from `start`. `elapsed` gives the seconds since the fit began.
Minimum Minimise(const FitOptions& options, const Eigen::VectorXd& start,
                 const std::function<double()>& elapsed,
                 const std::function<void(int iteration, const FitIteration&)>& progress,
                 RolloutResiduals* residuals);

/// The parameters' bounds as those of the first entries of the problem's only block x, which is
/// moved within them.
void SetInternalBounds(const ParameterizedScene& scene, ceres::Problem* problem,
                       Eigen::VectorXd* x);

/// 1/2 Σ ρ(r²).
double RobustCost(const Eigen::VectorXd& residuals, double huber);

/// Its derivative Jᵀ ρ'(r²) r.
Eigen::VectorXd RobustGradient(const Eigen::VectorXd& residuals, const RowMatrixXd& jacobian,
                               double huber);

}  // namespace tangible
