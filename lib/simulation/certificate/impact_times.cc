// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/impact_times.h"

#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

std::vector<BodyImpact> FindImpacts(const Model<double>& model, const State<double>& initial) {
  std::vector<BodyImpact> impacts;
  const std::vector<BodyIndex>& bodies = model.structure->bodies;
  const auto add = [&](const IslandRecord& island, const EventPart& part) {
    if (!part.is_impulses || part.impulses.h > 0.0) return;
    for (size_t i = 0; i < part.impulses.contacts.size(); ++i) {
      if (!(part.impulses.solution.normal_impulse[i] > 0.0)) continue;
      const ActiveContact contact = island.InWhole(part.impulses.contacts[i]);
      for (const int body : {contact.a, contact.b}) {
        if (bodies[body].block >= 0) impacts.push_back({body, part.impulses.time});
      }
    }
  };
  State<double> final;
  Rollout(
      model, initial,
      [&](long, double, const State<double>&, Stepper* stepper) {
        if (stepper != nullptr) stepper->parts().ForEachPart(add);
      },
      &final);
  return impacts;
}

}  // namespace tangible
