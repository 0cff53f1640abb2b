// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/coupled_bodies.h"

namespace tangible {

void CoupledBodies::Connect(const ModelStructure& structure,
                            const std::vector<ActiveContact>& contacts) {
  moving_.Clear(structure.bodies.size());
  for (const int body : structure.moving) {
    moving_.Add(body);
  }
  const auto join = [&](int a, int b) {
    if (moving_.Has(a) && moving_.Has(b)) moving_.Join(a, b);
  };
  for (const JointIndex& joint : structure.joints) {
    join(joint.a, joint.b);
    if (joint.c < 0) continue;
    join(joint.a, joint.c);
    join(joint.a, joint.d);
  }
  for (const ActiveContact& contact : contacts) {
    join(contact.a, contact.b);
  }
}

}  // namespace tangible
