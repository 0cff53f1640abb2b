// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The report of a fit: one self-contained HTML page for readers.

#include <string>

#include "tangible/estimation/fit/discretisation.h"
#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/results/prediction.h"
#include "tangible/estimation/results/recordings_json.h"

namespace tangible {

/// Estimates with intervals, correlations and warnings; the error of predictions; cost and
/// parameters by iteration; observed against fitted and residuals of each measured coordinate;
/// outliers. Plots of many observations are thinned to the extremes, so that a page stays below 5
/// MB whatever their number. `title` names the fit; `check` and `prediction` may be null. `result`
/// must have an estimate.
std::string FitReport(const std::string& title, const RolloutResiduals& residuals,
                      const FitResult& result, const DiscretisationCheck* check,
                      const PredictionScore* prediction = nullptr);

/// The same for a fit to several recordings, without plots of their observations.
std::string RecordingsReport(const std::string& title, const RecordingsProblem& problem,
                             const FitResult& result, const PredictionScore* prediction = nullptr);

}  // namespace tangible
