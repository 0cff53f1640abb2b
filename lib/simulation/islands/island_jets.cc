// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_jets.h"

namespace tangible {

template <typename T>
void IslandStepInJets(const Model<T>& model, const Model<double>& values, JetRoute route,
                      IslandRecords* records, State<T>* state) {
  if (records->IsWhole()) {
    EventStepInJets(model, values, route, &records->islands[0]->events, state);
    return;
  }
  Model<T> own_model;
  Model<double> own_values;
  State<T> own;
  for (int k = 0; k < records->num_islands; ++k) {
    IslandRecord& island = *records->islands[k];
    island.part->GatherState(*state, &own);
    EventStepInJets(island.ModelOf(model, &own_model), island.ModelOf(values, &own_values), route,
                    &island.events, &own);
    island.part->ScatterState(own, state);
  }
  AdvanceKinematic(model, *records, state);
}

#define TANGIBLE_INSTANTIATE_JET(N)                                                            \
  template void IslandStepInJets<Jet<N>>(const Model<Jet<N>>&, const Model<double>&, JetRoute, \
                                         IslandRecords*, State<Jet<N>>*);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
