// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A scene with other values of its parameters, for runs of one scene over many of them.

#include <string>
#include <vector>

#include "tangible/scene/parameter.h"

namespace tangible {

/// Whether each number of the scene belongs to at most one of the parameters; if not, `error` gets
/// one line.
bool CheckApart(const Scene& scene, const std::vector<ParameterPath>& parameters,
                std::string* error);

/// Sets all numbers of each parameter to its value, values[k] that of parameters[k]. Returns empty,
/// or one line "bodies/ball/mass: expected a number > 0, got -1", the scene then half set: where a
/// value is not allowed, or the scene with all of them (a polygon that crosses itself,
/// limits that cross).
std::string SetParameters(const std::vector<ParameterPath>& parameters, const double* values,
                          Scene* scene);

}  // namespace tangible
