// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The size of tests that take minutes: a part by default, all of it in the entries of ctest whose
// names end in _thorough, which have the label slow.

#include <cstdlib>

namespace tangible::testing {

inline bool Thorough() { return std::getenv("TANGIBLE_THOROUGH") != nullptr; }

}  // namespace tangible::testing
