// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Small plain problems s = F z + c with a solution that is known by construction: entries of F are
// small integers, most of them 0, so that many principal minors vanish and paths of pivots or of an
// interior point end without a solution. z and s are drawn first, c = s - F z.

#include <cstdint>
#include <string>
#include <vector>

#include "tangible/lcp/dense/problem.h"

namespace tangible::corpus {

inline constexpr const char* kSmallIntegers = "small integers";

struct PlainCase {
  std::string name;  ///< "small integers 17": with the seed it makes the problem again
  MixedLcp<double> problem;
  std::vector<double> z;  ///< a solution
};

/// Number `index`, of 2 to 6 rows.
PlainCase MakeSmallIntegers(std::uint64_t seed, int index);

}  // namespace tangible::corpus
