// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/derivative_method.h"

#include "tangible/math/scalar.h"

namespace tangible {

const char* NameOf(GradientMethod method) {
  return kGradientMethodNames[static_cast<int>(method)].first;
}

bool IsAvailable(GradientMethod method) {
  int num_widths = 0;
#define TANGIBLE_COUNT_WIDTH(N) ++num_widths;
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_COUNT_WIDTH)
#undef TANGIBLE_COUNT_WIDTH
  return (method != GradientMethod::kJet && method != GradientMethod::kJetImplicit) ||
         num_widths > 0;
}

}  // namespace tangible
