// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Held parameters fitted for real.
//
// What held_parameters.h says of a number is of first order: far from a minimum of the released
// problem, or across a change of contacts, the cost may fall by far less. Each number is therefore
// released and minimised together with all parameters, from the estimate, before anything is said
// of it. The minimiser never ends above its start, so the share is at least 0.

#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// Those of `found` that a fit confirms, at most HeldOptions::most, with `refitted` set: first
/// those that move parameters out of their bounds, then by the share of the cost. Numbers that
/// cannot be released (they differ from recording to recording) stay as they are, after the others;
/// so do all in fits of more than 30 recordings.
/// `result` is the fit with the numbers held; its `rollouts` grow by those made here.
std::vector<HeldParameter> ConfirmHeld(const FitOptions& options, const HeldOptions& held,
                                       const std::vector<HeldParameter>& found,
                                       LeastSquaresProblem* problem, FitResult* result);

}  // namespace tangible
