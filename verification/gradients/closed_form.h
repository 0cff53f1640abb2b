// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Derivatives that are known in closed form, as a further check of the computed ones.
//
// A program that has closed forms registers a function; tangible-verify calls each in turn and
// compares with the first one that knows the scene. Without any the column is left out.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tangible/scene/parameter.h"

namespace tangible {

/// The Jacobian of a scene's final state in closed form.
struct ClosedFormJacobian {
  /// Outputs (simulation/gradient.h) x parameters, SI units; NaN where it is not known.
  MatrixX<double> jacobian;
  /// The allowed relative error of the computed derivative: 1e-9 for the derivative of the discrete
  /// map, more for that of the motion in continuous time.
  double tolerance = 1e-9;
  /// The same for growing and for shrinking parameters, where they are known; `jacobian` is then
  /// known where they agree.
  MatrixX<double> plus{}, minus{};
  VectorX<double> values{};  ///< of the outputs, where they are known
};

/// Returns nothing for a scene that it does not know.
using ClosedForm = std::function<std::optional<ClosedFormJacobian>(
    const Scene& scene, const std::vector<ParameterPath>& parameters)>;

/// Adds a closed form under a name, or replaces the one of that name. It must not be called while
/// scenes are checked.
void RegisterClosedForm(const std::string& name, ClosedForm form);
/// Removes it; does nothing if there is none.
void RemoveClosedForm(const std::string& name);

/// The result of the first registered function that knows the scene, in the order of registration.
std::optional<ClosedFormJacobian> FindClosedForm(const Scene& scene,
                                                 const std::vector<ParameterPath>& parameters);

}  // namespace tangible
