// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The initial guess of a recording's initial state: a polynomial through the first observations.
//
//   value(t) ~ a + b t + ½ c t²   by weighted least squares over the first samples of a coordinate
//
// gives a position or angle a, a speed b, at the run's time 0. Coordinates relative to another
// body, or recorded through an instrument, are not used.

#include <optional>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// The value of a parameter that is one number of one body's initial pose or twist; nothing for
/// other parameters, or where the body's coordinate was not observed often enough: once for a pose,
/// twice for a twist.
std::optional<double> InitialFromObservations(const FitProblem& problem,
                                              const FitParameter& parameter);

}  // namespace tangible
