// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A run of a scene, sampled at equal intervals, with the Jacobian of its final state; and the
// differences between two such runs, as dimensionless errors.
//
//   trajectory error   max over samples k and moving bodies i of
//                      |(Δx, Δy, r_i Δangle)_ik| / L
//   gradient error     ‖W (J − J*) S‖ / ‖W J* S‖  (Frobenius),   J = d final state / d parameters
//
// r_i: the body's radius of gyration, m. L: the diagonal of the box around all centres at all
// samples of the reference, or the largest r_i if that is longer, m. S: the parameters' scales. W
// makes rows comparable: 1/L of x and y, r/L of angles, T/L of vx and vy, r T/L of omega, T being
// the duration. The reference is marked by a star.

#include <string>
#include <vector>

#include "tangible/simulation/gradient/gradient.h"

namespace tangible::tradeoff {

struct SampledRun {
  std::string message;               ///< empty, or one line: why it failed
  std::vector<double> poses;         ///< x, y, angle of each moving body, of each sample
  RowMatrixXd jacobian;              ///< of the final state, a column for each parameter
  std::vector<double> run_seconds;   ///< CPU time of each repeat of a plain rollout
  std::vector<double> both_seconds;  ///< and of one with the Jacobian
  long steps = 0;

  bool done() const { return message.empty(); }
};

struct SampleOptions {
  int samples = 20;             ///< besides time 0; the number of steps is a multiple of it
  double repeat_seconds = 0.0;  ///< CPU time that repeats may take, about; 0: one run
  int most_repeats = 9;
};

/// Runs the scene with the settings of `scene.simulation`; failures that CheckSettings finds are in
/// the message too.
SampledRun RunSampled(const Scene& scene, const std::vector<ParameterPath>& parameters,
                      GradientMethod method, const SampleOptions& options);

/// The scales of errors.
struct ErrorScale {
  double length = 1.0;             ///< L, m
  double duration = 1.0;           ///< T, s
  std::vector<double> gyration;    ///< m, of each moving body
  std::vector<double> parameters;  ///< scale of each
};

ErrorScale ScaleOf(const Scene& scene, const std::vector<ParameterPath>& parameters,
                   const SampledRun& reference);

double TrajectoryError(const ErrorScale& scale, const SampledRun& run, const SampledRun& reference);

/// NaN where the reference's Jacobian is 0: nothing depends on the parameters.
double GradientError(const ErrorScale& scale, const SampledRun& run, const SampledRun& reference);

}  // namespace tangible::tradeoff
