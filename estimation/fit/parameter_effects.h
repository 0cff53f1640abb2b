// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// By how much each parameter changes the residuals where a fit begins.

#include <Eigen/Core>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/fit/linearisation.h"

namespace tangible {

/// ‖∂r/∂q‖ of each parameter.
Eigen::VectorXd EffectsOf(const BlockLayout& layout, const Linearisation& model);

/// The first parameter that changes no residual; −1 if every parameter changes one.
int FindNoEffect(const Eigen::VectorXd& effect);

/// Sets to 0 the effects at `p` that are rounding: those so small that the parameter cannot be told
/// from the observations, which are of the size of rounding beside those of others, or change where
/// the parameter is moved by a little.
void LeaveOutRounding(const Eigen::VectorXd& p, const std::vector<ParameterEntry>& entries,
                      Linearizer* linearizer, Eigen::VectorXd* effect);

/// Where the others are once they have followed the observations without a parameter that has no
/// effect where it is, such as the friction of what is not pushed far enough to slide: it may have
/// one there. By windows they follow what comes first: a ball that is too slow to reach a wall
/// before its data have turned back learns its speed from those before. Empty where the fit without
/// it fails. Counts its runs.
Eigen::VectorXd WithoutParameter(const FitOptions& options, int parameter, bool by_windows,
                                 const Eigen::VectorXd& p, LeastSquaresProblem* problem,
                                 long* rollouts);

}  // namespace tangible
