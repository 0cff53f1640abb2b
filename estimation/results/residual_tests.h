// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Residuals against what moves: time, the angle of the body, its angle relative to the bodies that
// joints hold it to, its speed, and how far from the axis of the camera it is seen. Each is plotted
// and tested (binned_test.h).

#include <string>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// Of the report, in HTML, a folded part; empty where no run is possible.
std::string ResidualTestsPart(const RecordingsProblem& problem, const FitResult& result);

}  // namespace tangible
