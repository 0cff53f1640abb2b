// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/settings.h"

#include <algorithm>
#include <sstream>

#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

// Settings of fixed stepping that exclude each other.
std::string NeedsEvents(const std::string& key, const std::string& have, const std::string& others,
                        const std::string& got) {
  return "/simulation/" + key + ": expected \"" + have + "\" with fixed stepping (the " + others +
         " \"stepping\": \"event\"), got \"" + got + "\"";
}

std::string TextOf(double number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

}  // namespace

bool CheckSettings(const Scene& scene, std::string* error) {
  const SimulationSettings& settings = scene.simulation;
  const bool fixed = settings.stepping == Stepping::kFixed;
  const auto decays = std::find_if(scene.joints.begin(), scene.joints.end(), [](const auto& joint) {
    return joint.kinetic_friction.has_value();
  });
  if (fixed && IntegratorOf(settings) != Integrator::kSemiImplicitEuler) {
    *error = NeedsEvents("integrator", "semi_implicit_euler", "others need",
                         NameOf(IntegratorOf(settings), kIntegratorNames));
  } else if (!fixed && IntegratorOf(settings) == Integrator::kSemiImplicitEuler) {
    *error =
        "/simulation/integrator: expected \"runge_kutta_4\" or \"trapezoidal\" with event stepping "
        "(semi_implicit_euler gains energy without bound there), got \"semi_implicit_euler\"";
  } else if (fixed && settings.impact_law != ImpactLaw::kNewton) {
    *error = NeedsEvents("impact_law", "newton", "other needs",
                         NameOf(settings.impact_law, kImpactLawNames));
  } else if (fixed && decays != scene.joints.end()) {
    *error = "/joints/" + std::to_string(decays - scene.joints.begin()) +
             "/kinetic_friction: expected none with fixed stepping (friction that decays with the "
             "speed needs \"stepping\": \"event\"), got " +
             TextOf(*decays->kinetic_friction);
  } else {
    return true;
  }
  return false;
}

ContactSolverOptions SolverOptionsOf(const SimulationSettings& settings) {
  ContactSolverOptions options;
  options.tolerance = settings.lcp_tolerance;
  options.max_iterations = settings.lcp_max_iterations;
  return options;
}

}  // namespace tangible
