// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/impact_times.h"

#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

std::vector<BodyImpact> FindImpacts(const Model<double>& model, const State<double>& initial) {
  std::vector<BodyImpact> impacts;
  const std::vector<BodyIndex>& bodies = model.structure->bodies;
  const auto add = [&](const IslandRecord& island, const Impulses& impact) {
    for (size_t i = 0; i < impact.contacts.size(); ++i) {
      if (!(impact.solution.normal_impulse[i] > 0.0)) continue;
      const ActiveContact contact = island.InWhole(impact.contacts[i]);
      for (const int body : {contact.a, contact.b}) {
        if (bodies[body].block >= 0) impacts.push_back({body, impact.time});
      }
    }
  };
  State<double> final;
  Rollout(
      model, initial,
      [&](long, double, const State<double>&, Stepper* stepper) {
        if (stepper == nullptr) return;
        const IslandRecords& records = stepper->parts();  // none by fixed steps
        for (int k = 0; k < records.num_islands; ++k) {
          const EventRecord& events = records.islands[k]->events;
          for (int p = 0; p < events.num_parts; ++p) {
            const EventPart& part = *events.parts[p];
            if (part.is_impulses && part.impulses.h == 0.0) add(*records.islands[k], part.impulses);
          }
        }
      },
      &final);
  return impacts;
}

}  // namespace tangible
