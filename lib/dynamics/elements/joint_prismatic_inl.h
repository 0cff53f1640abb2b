// SPDX-License-Identifier: Apache-2.0
#pragma once
// Prismatic joint: a's anchor stays on the line through b's anchor along u, an axis fixed in b; the
// angle stays as drawn. With d = p_a − p_b and w a direction fixed in b (w = u or u⊥),
//   d/dt (w·d) = w·(v_a + ω_a × r_a) − w·(v_b + ω_b × (p_a − x_b)):
// the axis turns with b, so b's arm reaches to a's anchor. Included by joint.cc alone.

#include "tangible/dynamics/elements/joint_fixed_angle_inl.h"

namespace tangible {

template <typename T>
void EvaluatePrismatic(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                       JointRows<T>* out) {
  const Vector2<T> arm_a = pose_a.rotation * Vector2<T>(numbers[0], numbers[1]);
  const Vector2<T> arm_b = pose_b.rotation * Vector2<T>(numbers[2], numbers[3]);
  const Vector2<T> axis = pose_b.rotation * Vector2<T>(numbers[4], numbers[5]);
  const Vector2<T> across = Perp(axis);
  const Vector2<T> reach = pose_a.position + arm_a - pose_b.position;
  const Vector2<T> offset = reach - arm_b;
  out->row_a[0] = PointRow(across, arm_a);
  out->row_b[0] = Negative(PointRow(across, reach));
  out->error[0] = across.x() * offset.x() + across.y() * offset.y();
  EvaluateAngleRow(pose_a, pose_b, numbers[6], 1, out);
  out->rows = 2;
  out->coordinate_a = PointRow(axis, arm_a);
  out->coordinate_b = Negative(PointRow(axis, reach));
  out->coordinate = axis.x() * offset.x() + axis.y() * offset.y();
}

}  // namespace tangible
