// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The bodies that an impulse reaches at an instant: those that joints and touching contacts connect
// to the body on which it acts. Springs and forces do not connect bodies, because they need time to
// act.
//
// Events of bodies that are not connected have separate times even where they happen at the same
// instant: after a change of parameters either may become the earlier one, with the same result.

#include <vector>

#include "tangible/math/disjoint_sets.h"
#include "tangible/simulation/events/event_record.h"

namespace tangible {

class CoupledBodies {
 public:
  /// Connects the moving bodies of the structure's joints and of these contacts; O(bodies + joints
  /// + contacts).
  void Connect(const ModelStructure& structure, const std::vector<ActiveContact>& contacts);

  /// The same number for all bodies that are connected; −1 for those that no impulse moves.
  int GroupOf(int body) { return moving_.Has(body) ? moving_.Root(body) : -1; }
  /// The group of the contact's bodies, of which at least one moves.
  int GroupOf(const ActiveContact& contact) {
    return GroupOf(moving_.Has(contact.a) ? contact.a : contact.b);
  }

 private:
  DisjointSets moving_;
};

}  // namespace tangible
