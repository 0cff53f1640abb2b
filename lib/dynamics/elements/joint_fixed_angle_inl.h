// SPDX-License-Identifier: Apache-2.0
#pragma once
// Fixed angle: θ_a − θ_b stays as drawn. Included by joint.cc alone.

#include "tangible/dynamics/elements/joint.h"

namespace tangible {

/// Writes row r; shared with the weld and the prismatic joint.
template <typename T>
void EvaluateAngleRow(const Pose<T>& pose_a, const Pose<T>& pose_b, const T& reference, int r,
                      JointRows<T>* out) {
  out->row_a[r] = {T(0.0), T(0.0), T(1.0)};
  out->row_b[r] = {T(0.0), T(0.0), T(-1.0)};
  out->error[r] = pose_a.angle - pose_b.angle - reference;
}

}  // namespace tangible
