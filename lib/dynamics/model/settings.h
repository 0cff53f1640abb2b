// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which of a scene's simulation settings the engine can run.

#include <string>

#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/scene/scene.h"

namespace tangible {

/// Whether the engine has what the settings ask for; if not, `error` gets one line without the
/// file's name:
/// "/simulation/stepping: expected \"fixed\", got \"event\"".
bool CheckSettings(const SimulationSettings& settings, std::string* error);

/// The contact solver's options by a scene's settings.
ContactSolverOptions SolverOptionsOf(const SimulationSettings& settings);

}  // namespace tangible
