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
  if (settings.stepping != Stepping::kFixed) {
    *error = Unavailable("stepping", "fixed", NameOf(settings.stepping, kSteppingNames));
  } else if (settings.integrator != Integrator::kSemiImplicitEuler) {
    *error = Unavailable("integrator", "semi_implicit_euler",
                         NameOf(settings.integrator, kIntegratorNames));
  } else if (settings.impact_law != ImpactLaw::kNewton) {
    *error = Unavailable("impact_law", "newton", NameOf(settings.impact_law, kImpactLawNames));
  } else {
    return true;
  }
  return false;
}

}  // namespace tangible
