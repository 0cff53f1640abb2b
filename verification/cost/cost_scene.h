// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The scene of the costs: a chain of ten links of 0.3 m that hangs on pins, and a ball that hits
// it; and any number of its parameters.

#include <string>
#include <vector>

#include "tangible/scene/parameter.h"

namespace tangible::cost {

/// Steps of 0.002 s; by events with runge_kutta_4.
Scene ChainAndBall(long steps, Stepping stepping = Stepping::kFixed);

/// How many numbers of the scene can be parameters, each separately.
int NumNumbers(const Scene& scene);

/// The first `count` of: the ball's speed, masses, coefficients of friction and restitution,
/// initial velocities and positions, all other numbers, then patterns that set several of them
/// (`bodies/*/mass`), then these again from the start.
std::vector<ParameterPath> CostParameters(const Scene& scene, int count);

}  // namespace tangible::cost
