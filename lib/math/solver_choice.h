// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which solver a step's LCP is given to: shared by scene (what the user wrote) and lcp (what it
// means), which do not know each other.

namespace tangible {

enum class SolverChoice { kAuto, kInteriorPoint, kLemke };

}  // namespace tangible
