// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The report of a fit: one self-contained HTML page for readers.

#include <string>

#include "tangible/estimation/results/fit_json.h"

namespace tangible {

/// Estimates with intervals, correlations and warnings; spreads; the error of predictions; cost and
/// parameters by iteration; observed against fitted and residuals of each measured coordinate;
/// outliers. Plots of many observations are thinned to the extremes, so that a page stays below 5
/// MB whatever their number. `title` names the fit. `result` must have an estimate.
std::string FitReport(const std::string& title, const RecordingsProblem& problem,
                      const FitResult& result, const FitFindings& findings = {});

}  // namespace tangible
