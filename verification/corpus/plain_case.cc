// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/plain_case.h"

#include <algorithm>
#include <random>

namespace tangible::corpus {

PlainCase MakeSmallIntegers(std::uint64_t seed, int index) {
  PlainCase one;
  one.name = std::string(kSmallIntegers) + " " + std::to_string(index);
  std::mt19937_64 random(seed * 1000003 + static_cast<std::uint64_t>(index));
  constexpr double kEntries[] = {0, 0, 0, 1, -1, 2, -2};
  // z where > 0, s where < 0: every third row is degenerate.
  constexpr double kPairs[] = {0, 0, 1, 1, 2, -1};
  const Eigen::Index n = 2 + static_cast<Eigen::Index>(random() % 5);
  MatrixX<double>& F = one.problem.F;
  F.resize(n, n);
  for (double& entry : F.reshaped()) {
    entry = kEntries[random() % 7];
  }
  VectorX<double> z(n), s(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double draw = kPairs[random() % 6];
    z[i] = std::max(draw, 0.0);
    s[i] = std::max(-draw, 0.0);
  }
  one.problem.c = s - F * z;
  ConformEmptyBlocks(one.problem);
  one.z.assign(z.begin(), z.end());
  return one;
}

}  // namespace tangible::corpus
