// SPDX-License-Identifier: Apache-2.0
#pragma once
// Revolute joint: the anchors coincide. Included by joint.cc alone.

#include "tangible/dynamics/elements/joint.h"

namespace tangible {

/// Two rows, x and y of p_a − p_b; shared with the weld.
template <typename T>
void EvaluatePointRows(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                       JointRows<T>* out) {
  const Vector2<T> arm_a = pose_a.rotation * Vector2<T>(numbers[0], numbers[1]);
  const Vector2<T> arm_b = pose_b.rotation * Vector2<T>(numbers[2], numbers[3]);
  const T one(1.0);
  const T zero(0.0);
  out->row_a[0] = {one, zero, -arm_a.y()};
  out->row_b[0] = {-one, zero, arm_b.y()};
  out->row_a[1] = {zero, one, arm_a.x()};
  out->row_b[1] = {zero, -one, -arm_b.x()};
  out->error[0] = pose_a.position.x() + arm_a.x() - pose_b.position.x() - arm_b.x();
  out->error[1] = pose_a.position.y() + arm_a.y() - pose_b.position.y() - arm_b.y();
}

template <typename T>
void EvaluateRevolute(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                      JointRows<T>* out) {
  EvaluatePointRows(pose_a, pose_b, numbers, out);
  out->rows = 2;
  out->coordinate_a = {T(0.0), T(0.0), T(1.0)};
  out->coordinate_b = {T(0.0), T(0.0), T(-1.0)};
  out->coordinate = pose_a.angle - pose_b.angle - numbers[4];
}

}  // namespace tangible
