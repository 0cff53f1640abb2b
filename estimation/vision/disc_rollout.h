// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Discs as the engine rolls them out: a step a frame.

#include "tangible/estimation/vision/disc_world.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

/// The world's motion over `frames` ≥ 1 frames, recorded in each, the first included.
RolloutFunction RolloutOf(const DiscWorld& world, int frames);

/// Positions and velocities (n, 4) as the state of the scene's moving bodies, which do not turn.
VectorX<double> EngineState(const double* states, int discs);

}  // namespace tangible
