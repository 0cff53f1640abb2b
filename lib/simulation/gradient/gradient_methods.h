// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Types and functions that the methods of gradient.h share; not for other users.

#include <string>

#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible::internal {

/// The final state as a function of the parameters, and the scene's own values of these.
struct GradientProblem {
  RolloutFunction function;
  RolloutInput input;

  const Scene& scene() const { return function.scene(); }
  const SimulationSettings& settings() const { return function.structure().settings; }
  const ParameterPath& parameter(int k) const {
    return function.parameters()[static_cast<size_t>(k)];
  }
  int num_parameters() const { return function.num_parameters(); }
};

/// The message about a run, with the scene's file if it failed; empty if it did not.
std::string FailureOf(const GradientProblem& problem, const RolloutOutput& output);

/// Takes the message, values, notes and fallbacks of a run at the scene's own values; false where
/// it failed.
bool Take(const GradientProblem& problem, const RolloutOutput& output, GradientResult* result);

/// Fills values and jacobian; false with a message where a rollout fails or no side has a limit.
/// Uses tangents at parameters beside those of the scene: for event stepping, at a kink, and for
/// fixed steps at what their directional derivatives do not resolve. Reads the certificate.
bool JacobianBySides(const GradientProblem& problem, DerivativeSide side, RolloutWorker* worker,
                     GradientResult* result);
/// Of fixed steps, whose directional derivatives do not resolve them: replaces the columns of
/// parameters that are an end of a force's window on a step's end by those from tangents beside.
bool EdgesBySides(const GradientProblem& problem, DerivativeSide side, RolloutWorker* worker,
                  GradientResult* result);

}  // namespace tangible::internal
