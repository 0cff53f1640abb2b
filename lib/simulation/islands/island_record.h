// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The record of a step by events: that of each island, with the part of the model that it is.

#include <memory>
#include <vector>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/model_part.h"
#include "tangible/simulation/events/event_record.h"

namespace tangible {

/// The step of one island. Bodies, joints and numbers in `events` are those of the part.
struct IslandRecord {
  std::shared_ptr<const ModelPart> part;  ///< null: the island is the whole model
  EventRecord events;

  /// A contact of `events` with the bodies and the joint of the whole model.
  ActiveContact InWhole(ActiveContact contact) const;
  /// The same the other way; its bodies are −1 where they are not in the island.
  ActiveContact InIsland(ActiveContact contact) const;
  /// The place of a joint or number of the island in the whole model.
  int JointInWhole(int joint) const { return part ? part->joints[joint] : joint; }
  int NumberInWhole(int number) const {
    return part && number >= 0 ? part->numbers[number] : number;
  }
  /// The island's model out of the whole one, for which `memory` is used if they differ.
  template <typename T>
  const Model<T>& ModelOf(const Model<T>& whole, Model<T>* memory) const {
    if (!part) return whole;
    part->GatherModel(whole, memory);
    return *memory;
  }
};

/// The islands of a step; kept from step to step for their memory.
struct IslandRecords {
  double time = 0.0;  ///< s, the start of the step
  double h = 0.0;     ///< s, its length
  std::vector<std::unique_ptr<IslandRecord>> islands;
  int num_islands = 0;

  void Clear() { num_islands = 0; }
  double end() const { return time + h; }
  /// A time on the last pieces of paths within the step.
  double before_end(const ModelStructure& structure) const {
    return BesideInstant(structure, end(), PathSide::kBefore);
  }
  IslandRecord* Add();
  /// Calls visit(island, part) for the parts of all islands.
  template <typename Visit>
  void ForEachPart(const Visit& visit) const {
    for (int k = 0; k < num_islands; ++k) {
      for (int p = 0; p < islands[k]->events.num_parts; ++p) {
        visit(*islands[k], *islands[k]->events.parts[p]);
      }
    }
  }
  /// Whether the whole model is one island.
  bool IsWhole() const { return num_islands == 1 && islands[0]->part == nullptr; }
  /// Memory, bytes, without the structures of the parts, which many steps share.
  size_t bytes() const;
};

/// Moves what moves by itself, the kinematic bodies, of which an island has but a copy: q += h v,
/// or along their paths.
template <typename T>
void AdvanceKinematic(const Model<T>& model, const IslandRecords& records, State<T>* state) {
  const ModelStructure& structure = *model.structure;
  const double h = records.h;
  for (int body = 0; body < structure.num_bodies(); ++body) {
    for (int i = 0; i < 3 && structure.bodies[body].motion == Motion::kKinematic; ++i) {
      state->pose[3 * body + i] += h * state->twist[3 * body + i];
    }
  }
  FollowPaths(model, T(records.end()), records.before_end(structure), state);
}

}  // namespace tangible
