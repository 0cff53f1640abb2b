// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/coupled_bodies.h"

#include <algorithm>

namespace tangible {

int CoupledBodies::Root(int body) {
  while (parent_[body] != body) {
    parent_[body] = parent_[parent_[body]];
    body = parent_[body];
  }
  return body;
}

void CoupledBodies::Join(int a, int b) {
  if (parent_[a] < 0 || parent_[b] < 0) {
    return;
  }
  a = Root(a);
  b = Root(b);
  parent_[std::max(a, b)] = std::min(a, b);
}

void CoupledBodies::Connect(const ModelStructure& structure,
                            const std::vector<ActiveContact>& contacts) {
  parent_.assign(structure.bodies.size(), -1);
  for (const int body : structure.moving) {
    parent_[body] = body;
  }
  for (const JointIndex& joint : structure.joints) {
    Join(joint.a, joint.b);
  }
  for (const ActiveContact& contact : contacts) {
    Join(contact.a, contact.b);
  }
}

}  // namespace tangible
