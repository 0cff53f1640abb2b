// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The simulation settings that are tried, and the parameters with respect to which runs are
// differentiated.

#include <string>
#include <vector>

#include "tangible/scene/parameter.h"
#include "tangible/scene/scene.h"

namespace tangible::tradeoff {

enum class SweepKind {
  /// Every stepping and integrator with every joint correction; the other tolerance with the
  /// scene's own correction alone.
  kStar,
  kFull,  ///< every combination
};

struct Sweep {
  std::vector<SimulationSettings> settings;  ///< their dt is not one of the sweep's
  std::vector<std::string> left_out;         ///< kinds of combinations not tried, a line each
};

/// The settings beside dt. Joint corrections are tried where there are joints; tolerances
/// where something may touch or a joint has limits.
Sweep MakeSweep(const Scene& scene, SweepKind kind);

/// Step lengths, descending: about the scene's dt times each factor, each so that a multiple of
/// `samples` steps fills the duration exactly.
std::vector<double> StepLengths(const SimulationSettings& settings, int samples,
                                const std::vector<double>& factors);

/// "event runge_kutta_4, projection", then what differs from the scene's settings.
std::string NameOf(const SimulationSettings& settings, const SimulationSettings& of_scene);

/// Those of these that the scene has: gravity/y, bodies/*/mass, bodies/*/friction,
/// bodies/*/restitution, and where the first moving body starts (its joint's angle, or its speed).
std::vector<ParameterPath> DefaultParameters(const Scene& scene);

}  // namespace tangible::tradeoff
