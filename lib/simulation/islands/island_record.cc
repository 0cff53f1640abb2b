// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_record.h"

namespace tangible {

ActiveContact IslandRecord::InWhole(ActiveContact contact) const {
  if (part) {
    contact.a = contact.a < 0 ? -1 : part->bodies[contact.a];
    contact.b = contact.b < 0 ? -1 : part->bodies[contact.b];
    contact.joint = contact.joint < 0 ? -1 : part->joints[contact.joint];
  }
  return contact;
}

ActiveContact IslandRecord::InIsland(ActiveContact contact) const {
  if (part) {
    contact.a = part->LocalBody(contact.a);
    contact.b = part->LocalBody(contact.b);
    contact.joint = contact.joint < 0 ? -1 : part->LocalJoint(contact.joint);
  }
  return contact;
}

IslandRecord* IslandRecords::Add() {
  if (num_islands == static_cast<int>(islands.size())) {
    islands.push_back(std::make_unique<IslandRecord>());
  }
  IslandRecord* island = islands[num_islands++].get();
  island->part = nullptr;
  island->events.Clear();
  return island;
}

size_t IslandRecords::bytes() const {
  size_t sum = islands.capacity() * sizeof(islands[0]);
  for (const std::unique_ptr<IslandRecord>& island : islands) {
    sum += sizeof(IslandRecord) + island->events.bytes();
  }
  return sum;
}

}  // namespace tangible
