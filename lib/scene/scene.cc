// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/scene.h"

#include <cstddef>

namespace tangible {

namespace {

// Greedy matching that only returns to the last `*`: an earlier one cannot do better. At most
// |pattern| · |name| comparisons. A `*` does not match the separator, so that the parts between
// separators match one by one; with the separator '\0', which no name contains, it matches
// anything.
bool Matches(const std::string& pattern, const std::string& name, char separator) {
  std::size_t p = 0;
  std::size_t n = 0;
  std::size_t star = std::string::npos;  // place of the last `*`
  std::size_t resume = 0;                // first character that it does not take
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      resume = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p;
      ++n;
    } else if (star != std::string::npos && name[resume] != separator) {
      p = star + 1;
      n = ++resume;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

}  // namespace

bool MatchesPattern(const std::string& pattern, const std::string& name) {
  return Matches(pattern, name, '\0');
}

bool MatchesPath(const std::string& pattern, const std::string& path) {
  return Matches(pattern, path, '/');
}

}  // namespace tangible
