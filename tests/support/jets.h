// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which widths of Jets are built.

#include "tangible/math/scalar.h"

namespace tangible::testing {

/// The widest; 0 in a build without Jets.
constexpr int WidestJet() {
  int widest = 0;
#define TANGIBLE_WIDER(N) widest = N > widest ? N : widest;
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_WIDER)
#undef TANGIBLE_WIDER
  return widest;
}

constexpr bool HaveJets() { return WidestJet() > 0; }

}  // namespace tangible::testing
