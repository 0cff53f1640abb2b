// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Rollouts of discs by the engine, with one step for each frame.

#include "tangible/estimation/vision/disc_world.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

/// The motion of the world over `frames` ≥ 1 frames, recorded in each frame including the first.
RolloutFunction RolloutOf(const DiscWorld& world, int frames);

/// The state of the scene's moving bodies, which do not turn, for positions and velocities (n, 4).
VectorX<double> EngineState(const double* states, int discs);

}  // namespace tangible
