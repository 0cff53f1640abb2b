// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Where a recording's initial state is sought from: a polynomial through the first observations.
//
//   value(t) ~ a + b t + ½ c t²   by weighted least squares over the first samples of a coordinate
//
// gives a position or angle a, a speed b, at the run's time 0. What is observed relative to another
// body, or through an instrument, is not used.

#include <optional>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// The value of a parameter that is one number of one body's initial pose or twist; nothing where
/// it is another one, or the body's coordinate was not observed often enough: once for a pose,
/// twice for a twist.
std::optional<double> InitialFromObservations(const FitProblem& problem,
                                              const FitParameter& parameter);

}  // namespace tangible
