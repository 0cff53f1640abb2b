// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which method an LCP is given to: one of them alone, or each after the other.

namespace tangible {

enum class SolverChoice { kAuto, kInteriorPoint, kLemke };

}  // namespace tangible
