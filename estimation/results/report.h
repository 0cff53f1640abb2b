// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The report of a fit: one self-contained HTML page for readers.

#include <string>

#include "tangible/estimation/results/fit_json.h"

namespace tangible {

/// A sentence that says what was found and whether to believe it; the fitted and the observed
/// motion in a player; estimates with intervals, profiles, correlations and warnings; what would
/// explain the residuals; spreads; the error of predictions; residuals against what moves, observed
/// against fitted. Tables of residuals and what concerns the minimisation are folded. Plots of many
/// observations are thinned to the extremes, so that a page stays below 5 MB whatever their number.
/// `title` names the fit. `result` must have an estimate.
std::string FitReport(const std::string& title, const RecordingsProblem& problem,
                      const FitResult& result, const FitFindings& findings = {});

}  // namespace tangible
