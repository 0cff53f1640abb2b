// SPDX-License-Identifier: Apache-2.0
#pragma once
// Selects the rows of derivatives that belong to a body. Included by event_derivative*.cc alone.

#include "tangible/dynamics/model/model.h"

namespace tangible {

// The rows of a body in a matrix of all variables, and of a moving body in a solution.
template <typename Matrix>
auto PoseRows(const ModelStructure& s, int body, Matrix& x) {
  return x.middleRows(s.PoseVariable(body, 0), 3);
}
template <typename Matrix>
auto TwistRows(const ModelStructure& s, int body, Matrix& x) {
  return x.middleRows(s.TwistVariable(body, 0), 3);
}
template <typename Matrix>
auto BlockRows(int block, Matrix& x) {
  return x.middleRows(3 * block, 3);
}

}  // namespace tangible
