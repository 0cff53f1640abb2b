// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The outputs of a rollout: the final poses and twists of the moving bodies, (x, y, angle, vx, vy,
// omega) a body.

#include "tangible/dynamics/model/model.h"

namespace tangible {

/// Calls visit(output, variable) in the order of the outputs, with the state's variable.
template <typename Visit>
void ForEachOutput(const ModelStructure& structure, const Visit& visit) {
  int output = 0;
  for (const int body : structure.moving) {
    for (int i = 0; i < 6; ++i) {
      visit(output++,
            i < 3 ? structure.PoseVariable(body, i) : structure.TwistVariable(body, i - 3));
    }
  }
}

}  // namespace tangible
