// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// By how much each parameter changes the residuals where a fit begins.

#include <Eigen/Core>
#include <vector>

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

}  // namespace tangible
