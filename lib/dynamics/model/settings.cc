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
  const auto decays_in = [](const auto& items) {
    return std::find_if(items.begin(), items.end(),
                        [](const auto& item) { return item.kinetic_friction.has_value(); });
  };
  const auto refuse = [&](const std::string& place, double got) {
    *error = place +
             "/kinetic_friction: expected none with fixed stepping (friction that decays with the "
             "speed needs \"stepping\": \"event\"), got " +
             TextOf(got);
  };
  const auto joint = decays_in(scene.joints);
  const auto body = decays_in(scene.bodies);
  const auto pair = decays_in(scene.pairs);
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
  } else if (fixed && joint != scene.joints.end()) {
    refuse("/joints/" + std::to_string(joint - scene.joints.begin()), *joint->kinetic_friction);
  } else if (fixed && body != scene.bodies.end()) {
    refuse("/bodies/" + std::to_string(body - scene.bodies.begin()), *body->kinetic_friction);
  } else if (fixed && pair != scene.pairs.end()) {
    refuse("/pairs/" + std::to_string(pair - scene.pairs.begin()), *pair->kinetic_friction);
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
