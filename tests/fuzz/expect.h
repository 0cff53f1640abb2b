// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What a fuzz target asserts: the process aborts where it does not hold.

#include <cstdio>
#include <cstdlib>
#include <string>

namespace tangible::testing {

inline void Expect(bool holds, const char* what, const std::string& message) {
  if (holds) return;
  std::fprintf(stderr, "expected %s: %s\n", what, message.c_str());
  std::abort();
}

/// A message of an error.
inline void ExpectOneLine(const std::string& message) {
  Expect(!message.empty() && message.find('\n') == std::string::npos, "one line", message);
}

}  // namespace tangible::testing
