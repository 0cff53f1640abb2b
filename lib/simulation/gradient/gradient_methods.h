// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Types and functions that the methods of gradient.h share; not for other users.

#include <functional>
#include <memory>

#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible::internal {

/// The parts of a gradient problem that do not depend on the method.
struct GradientProblem {
  const Scene& scene;
  const std::vector<ParameterPath>& parameters;
  std::vector<ParameterDirection> directions;
  std::shared_ptr<const ModelStructure> structure;
  Model<double> model;
  State<double> initial;
  std::vector<int> output_variables;  ///< pose and twist variables, in the order of the outputs
  RolloutFunction function;
  RolloutInput input;  ///< the scene's own

  VectorX<double> Outputs(const State<double>& state) const;
};

/// The message of a rollout that failed, empty if it did not.
std::string FailureOf(const GradientProblem& problem, const RolloutReport& report);

/// Fills values and jacobian; false with a message where a rollout fails.
bool JacobianByDifferences(const GradientProblem& problem, double step, GradientResult* result);
/// Uses tangents at parameters beside those of the scene: for event stepping, at a kink. Reads the
/// certificate.
bool JacobianBySides(const GradientProblem& problem, DerivativeSide side, GradientResult* result);
/// Of fixed steps, whose directional derivatives do not resolve them: replaces the columns of
/// parameters that are an end of a force's window on a step's end by those from tangents beside.
bool EdgesBySides(const GradientProblem& problem, DerivativeSide side, GradientResult* result);

}  // namespace tangible::internal
