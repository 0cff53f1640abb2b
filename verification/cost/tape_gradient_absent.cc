// SPDX-License-Identifier: Apache-2.0
//
// Replaces tape_gradient.cc where ADOL-C is not installed.
#include "tangible/verification/cost/tape_gradient.h"

namespace tangible::cost {

bool TapeIsBuilt() { return false; }

GradientResult TapeLossGradient(const Scene&, const std::vector<ParameterPath>&,
                                const std::vector<LossTerm>&, int) {
  GradientResult result;
  result.message = "built without ADOL-C";
  return result;
}

}  // namespace tangible::cost
