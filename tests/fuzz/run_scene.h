// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A few steps of a scene that some bytes made, whatever it is.

#include "tangible/scene/scene.h"

namespace tangible::testing {

/// Whether the scene is small enough to be run here: few bodies, and settings of the engine.
bool FitToRun(const Scene& scene);

/// Runs a few steps; aborts, as a crash that the fuzzer keeps, where a number that is not finite
/// comes out, or a status that is none.
void RunFewSteps(Scene scene, Stepping stepping);

}  // namespace tangible::testing
