// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Checks whether the engine can run a scene's simulation settings.

#include <string>

#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/scene/scene.h"

namespace tangible {

/// Whether the engine can run a scene with its settings; if not, `error` gets one line without the
/// file's name: "/simulation/stepping: expected \"fixed\", got \"event\"".
bool CheckSettings(const Scene& scene, std::string* error);

/// The contact solver's options that follow from a scene's settings.
ContactSolverOptions SolverOptionsOf(const SimulationSettings& settings);

}  // namespace tangible
