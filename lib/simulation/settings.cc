// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/settings.h"

#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

std::string Unavailable(const std::string& key, const std::string& have, const std::string& got) {
  return "/simulation/" + key + ": expected \"" + have + "\" (the only one available), got \"" +
         got + "\"";
}

}  // namespace

bool CheckSettings(const SimulationSettings& settings, std::string* error) {
  if (settings.stepping == Stepping::kFixed &&
      settings.integrator != Integrator::kSemiImplicitEuler) {
    *error =
        "/simulation/integrator: expected \"semi_implicit_euler\" with fixed stepping (the "
        "others need \"stepping\": \"event\"), got \"" +
        std::string(NameOf(settings.integrator, kIntegratorNames)) + "\"";
  } else if (settings.impact_law != ImpactLaw::kNewton) {
    *error = Unavailable("impact_law", "newton", NameOf(settings.impact_law, kImpactLawNames));
  } else {
    return true;
  }
  return false;
}

}  // namespace tangible
