// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// One start of a fit: Levenberg-Marquardt by Ceres on the blocks' factors (linearisation.h), then
// Gauss-Newton steps to the last digits (block_system.h).
//
// Ceres gets one residual block a block of the problem and one parameter block for the shared
// parameters and for each block's own, which are eliminated first. A parameter that is held at its
// bound is constant (ceres::SubsetManifold).
//
// A minimum is `converged` if two tests hold at its end, over the parameters that are not held at a
// bound beyond which the cost falls. With the gradient g of the cost in q, the Gauss-Newton step d
// (Newton's with Huber's loss) and s = sqrt(2 cost / (N − P)), the residuals' own deviation,
//
//   sqrt(−gᵀ d) ≤ ε s sqrt(P)                       (1)
//   |g_k| / ‖J_k‖ ≤ ε s sqrt(P)    for each k       (2)
//
// (1) bounds the remaining step in standard deviations, and (2) the step of one parameter alone;
// with ε = kRelativeOffset = 1e-3. Residuals that are rounding count as converged. (1) is the
// relative offset of Bates and Watts, independent of the parameters' scales and of the number of
// residuals. (1) implies (2) unless a direction that is left out of the step has a gradient. If a
// test fails, the status is `not_converged`, and the message says which. Where both hold at the
// limit of iterations the minimum counts as converged too.
//
// At a kink, where an impact falls on an observation or something just sticks, neither test need
// hold at a minimum. There the costs around it decide (AcceptKink), and the message says so.
//
// With large residuals Gauss-Newton converges by a constant factor. Where the gains of iterations
// show that, Ceres ends and the final steps go on with Anderson's acceleration.
//
// Reference: D. M. Bates and D. G. Watts, A relative offset orthogonality convergence criterion for
// nonlinear least squares, Technometrics 23 (1981) 179; D. G. Anderson, J. ACM 12 (1965) 547.

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "tangible/estimation/fit/evaluation_log.h"
#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// When a minimisation gives up: not converged, where after this many accepted iterations more than
/// this part of the first cost is left. 0: never.
struct Patience {
  int iterations = 0;
  double part = 1.0;
};

/// Minimises from `start`. `elapsed` gives the seconds since the fit began; `progress` may be
/// empty; evaluations go through `log` unless it is null.
Minimum Minimise(const FitOptions& options, const Eigen::VectorXd& start,
                 const std::function<double()>& elapsed,
                 const std::function<void(int iteration, const FitIteration&)>& progress,
                 LeastSquaresProblem* problem, EvaluationLog* log = nullptr,
                 const Patience& patience = {});

/// Sets the bounds of entries first ... first + size − 1 as those of the parameter block `x`, which
/// is moved into them.
void SetInternalBounds(const std::vector<ParameterEntry>& entries, int first, int size,
                       ceres::Problem* problem, double* x);

}  // namespace tangible
