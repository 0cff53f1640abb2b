// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The fitted motion with what was observed of it, for the player of the report.

#include <optional>

#include "tangible/estimation/fit/fit.h"
#include "tangible/render/view.h"

namespace tangible {

/// The recording that the fit explains worst.
int WorstRecording(const RecordingsProblem& problem, const FitResult& result);

/// The run of a recording at the estimate, in which each frame has the latest observation of each
/// place: of a body or point whose x or y is measured the place itself, and of a body of which only
/// the angle is measured an end of it. Through a camera a place is where its picture is to first
/// order in the residual. Nothing with random forces, or where the run fails.
std::optional<ViewData> ObservedMotion(const RecordingsProblem& problem, const FitResult& result,
                                       int recording);

}  // namespace tangible
