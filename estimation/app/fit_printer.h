// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What tangible-fit shows of a fit on the terminal.

#include <string>
#include <vector>

#include "tangible/estimation/fit/discretisation.h"
#include "tangible/estimation/fit/variance_components.h"
#include "tangible/estimation/results/prediction.h"
#include "tangible/estimation/results/residual_summary.h"

namespace tangible {

/// A number with so many significant digits.
std::string Cell(double value, int digits = 6);

void PrintEstimates(const std::vector<ParameterEntry>& entries, const FitResult& result);
void PrintComponents(const VarianceComponents& components);
void PrintOutliers(const ResidualSummary& summary);
void PrintCheck(const std::vector<ParameterEntry>& entries, const DiscretisationCheck& check);
void PrintScore(const PredictionScore& score);

}  // namespace tangible
