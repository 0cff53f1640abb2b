// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What integrating the random forces out adds to a fit: the slope of D(p) = Σ ln |det E_k|
// (process_noise.h, noise_sweep.h), with which its parameters are the mode of
//
//   −ln L(p) = least cost(p) + D(p)
//
// and no longer that of parameters and forces together. D depends on second derivatives of the
// motion; its slope is that of central differences, a tenth of a parameter's deviation at the
// others held to both sides, at each of which the forces are found anew. Fits and slopes alternate
// (variance_components.h): as D is nearly linear over a deviation, three or four fits suffice. The
// curvature of D is left out of the intervals.
//
// Reference: L. Tierney, J. B. Kadane, J. Amer. Statist. Assoc. 81 (1986) 82 (Laplace's
// approximation of an integral over nuisance parameters).

#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// Sets the slopes at the result of a fit. `largest` is raised to the largest change of one in
/// multiples of its parameter's deviation, that is, about the change of the estimate in deviations.
/// The names of parameters along which D is not smooth, as where an impact comes or goes within the
/// differences, go to `rough`: their slope is 0. False, with a message, where no run is possible.
bool UpdateSlopes(const FitOptions& options, const FitResult& result, RecordingsProblem* problem,
                  double* largest, std::vector<std::string>* rough, std::string* message);

/// Takes the constant of the rows of slopes from the costs of a fit.
void RemoveSlopeOffset(const RecordingsProblem& problem, FitResult* result);

}  // namespace tangible
