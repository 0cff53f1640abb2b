// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The report of a fit: one self-contained HTML page for people.

#include <string>

#include "tangible/estimation/fit/discretisation.h"
#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// Estimates with intervals, correlations and warnings; cost and parameters by iteration; observed
/// against fitted and residuals of each measured coordinate. `title` names the fit; `check` may be
/// null. `result` must have an estimate.
std::string FitReport(const std::string& title, const RolloutResiduals& residuals,
                      const FitResult& result, const DiscretisationCheck* check);

}  // namespace tangible
