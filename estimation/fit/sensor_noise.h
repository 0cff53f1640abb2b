// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The standard deviation of sensors' noise, estimated beside the parameters.
//
// The observations of sensor s have σ_i = f_s σ_i⁰ with one unknown factor. At the estimate for
// given factors the sum of the squares of its residuals r_i (in multiples of σ_i) is about its
// redundancy, the number n_s of its observations less their share in the parameters of the fit:
//
//   f_s² ← f_s² Σ_{i in s} r_i² / ρ_s,   ρ_s = n_s − tr(C J_sᵀ J_s)                      (1)
//
// with C the covariance and J_s the rows of s, in all recordings. Fits and (1) alternate until no
// factor changes by more than 1e-3 of its deviation, f_s / sqrt(2 ρ_s) (variance_components.h). For
// one sensor this is the division by N − P; for several it converges to the estimate of restricted
// maximum likelihood. With Huber's loss the sum is n_s (1.4826 median |r_i|)², which outliers
// hardly change.
//
// Source: W. Förstner, Ein Verfahren zur Schätzung von Varianz- und Kovarianzkomponenten, AVN 86
// (1979) 446; K.-R. Koch, Parameter Estimation and Hypothesis Testing in Linear Models, 3.6.

#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/problem/recordings.h"

namespace tangible {

struct SensorNoise {
  std::string name;
  double factor = 1.0;      ///< f_s, of the sigma that the observations had
  double deviation = 0.0;   ///< standard deviation of the factor
  long count = 0;           ///< n_s
  double redundancy = 0.0;  ///< ρ_s
};

/// The sensors whose sigma is to be estimated; sensors of the same name in several recordings are
/// one.
std::vector<SensorNoise> SensorsToEstimate(const RecordingsProblem& problem);

/// The name of a sensor whose sigma is to be estimated and that no observation has; empty if there
/// is none.
std::string SensorWithoutObservations(const FitInput& input);

/// Multiplies the sigma of the observations of each sensor that asks for it by its factor.
void ScaleSigma(const std::vector<SensorNoise>& noise, const Instruments& instruments,
                const std::vector<Channel>& channels, std::vector<Observation>* observations);

/// Applies equation (1) at the result of a fit with leverages, and sets the sigma of the
/// observations of `problem`. Returns false, with a message, where that is not possible. `largest`
/// is raised to the largest change of a factor in multiples of its deviation.
bool UpdateNoise(const FitOptions& options, const FitResult& result, RecordingsProblem* problem,
                 std::vector<SensorNoise>* noise, double* largest, std::string* message);

}  // namespace tangible
