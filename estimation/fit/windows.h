// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Growing windows: a start for the fit where a run is too long or too chaotic to be fitted from its
// beginning.
//
//   p_0 = start,    p_j = argmin  cost of the observations in [0, t_j] + 1/2 ‖D (q − q_(j−1))‖²
//
// from p_(j−1), with q the minimiser's coordinates. Over a short time predictions are nearly linear
// in the parameters. A window is at most twice as long as the last one, and shorter where the last
// minimum does not predict that far. The second term keeps parameters that a window does not
// determine yet near their last values; it is negligible beside the observations, because D is a
// third per unit of ln p, or of a parameter's scale. All recordings are cut at the same fraction of
// their time.

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// The minimum of the last window, from which the whole run is minimised; `start` where no window
/// is shorter than the whole. Evaluations go through `log` unless it is null.
FitApproachResult GrowWindows(const FitOptions& options, const Eigen::VectorXd& start,
                              LeastSquaresProblem* problem, EvaluationLog* log);

}  // namespace tangible
