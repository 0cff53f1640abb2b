// SPDX-License-Identifier: Apache-2.0
#pragma once
// Coupling of two joints' coordinates: g_a·q_a + g_b·q_b, q = (x, y, θ), stays as it is at time 0,
// or is the coordinate that limits bound. scene/coupling.h tells why it is linear in the poses, so
// that its rows are constant. Included by joint.cc alone.

#include "tangible/dynamics/elements/joint.h"

namespace tangible {

template <typename T>
void EvaluateCoupling(JointType type, const Pose<T>& pose_a, const Pose<T>& pose_b,
                      const T* numbers, JointRows<T>* out) {
  const RowPart<T> row_a = {numbers[0], numbers[1], numbers[2]};
  const RowPart<T> row_b = {numbers[3], numbers[4], numbers[5]};
  const auto along = [](const RowPart<T>& row, const Pose<T>& pose) {
    return T(row[0] * pose.position.x() + row[1] * pose.position.y() + row[2] * pose.angle);
  };
  const T value = along(row_a, pose_a) + along(row_b, pose_b) - numbers[6];
  if (type == JointType::kCoupling) {
    out->rows = 1;
    out->row_a[0] = row_a;
    out->row_b[0] = row_b;
    out->error[0] = value;
  } else {
    out->rows = 0;
    out->coordinate_a = row_a;
    out->coordinate_b = row_b;
    out->coordinate = value;
  }
}

}  // namespace tangible
