// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A step by events in Jets, island by island.

#include "tangible/simulation/events/event_jets.h"
#include "tangible/simulation/islands/island_record.h"

namespace tangible {

/// As EventStepInJets, for the islands of a step that was done in double.
template <typename T>
void IslandStepInJets(const Model<T>& model, const Model<double>& values, JetRoute route,
                      IslandRecords* records, State<T>* state);

}  // namespace tangible
