// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tangible/math/random.h"
#include "tangible/math/scalar.h"

namespace tangible::testing {

/// Entries in (−1, 1), the same for the same seed whatever ran before.
inline RowMatrixXd RandomMatrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 random(seed);
  RowMatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < columns; ++j) matrix(i, j) = Uniform(-1.0, 1.0, &random);
  }
  return matrix;
}

}  // namespace tangible::testing
