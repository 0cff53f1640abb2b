// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Passes of Jets over the columns of a Jacobian.

#include <type_traits>

#include "tangible/math/scalar.h"

namespace tangible {

/// The smallest width built that takes all columns in one pass, else the largest; 0 where none is.
inline int JetWidthFor(Eigen::Index columns) {
  int best = 0;
  [[maybe_unused]] const auto consider = [&](int width) {
    const bool enough = width >= columns;
    const bool best_enough = best > 0 && best >= columns;
    if (best == 0 || (enough && (!best_enough || width < best)) ||
        (!enough && !best_enough && width > best)) {
      best = width;
    }
  };
#define TANGIBLE_CONSIDER_WIDTH(N) consider(N);
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_CONSIDER_WIDTH)
#undef TANGIBLE_CONSIDER_WIDTH
  return best;
}

/// Calls pass(std::integral_constant<int, N>(), first) for the columns [first, first + N), N =
/// `width`, until one returns false; once where there are no columns. Returns what the last one
/// did; false without a width.
template <typename Pass>
bool ForEachJetPass(int width, Eigen::Index columns, [[maybe_unused]] const Pass& pass) {
  bool done = width > 0;
  for (Eigen::Index first = 0; done && (first == 0 || first < columns); first += width) {
#define TANGIBLE_PASS_IF_WIDTH(N) \
  if (width == (N)) done = pass(std::integral_constant<int, N>(), first);
    TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_PASS_IF_WIDTH)
#undef TANGIBLE_PASS_IF_WIDTH
  }
  return done;
}

}  // namespace tangible
