// SPDX-License-Identifier: Apache-2.0
#pragma once
// Distance joint: |p_a − p_b| stays as drawn. Included by joint.cc alone.

#include <cmath>

#include "tangible/dynamics/elements/joint.h"

namespace tangible {

template <typename T>
void EvaluateDistance(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                      JointRows<T>* out) {
  using std::sqrt;
  const Vector2<T> arm_a = pose_a.rotation * Vector2<T>(numbers[0], numbers[1]);
  const Vector2<T> arm_b = pose_b.rotation * Vector2<T>(numbers[2], numbers[3]);
  const Vector2<T> offset = pose_a.position + arm_a - pose_b.position - arm_b;
  const T squared = offset.squaredNorm();
  // At coincident anchors the direction is undefined, and sqrt has no derivative.
  const bool apart = ValueOf(squared) > 0.0;
  const T length = apart ? T(sqrt(squared)) : T(0.0);
  const Vector2<T> direction = apart ? Vector2<T>(offset / length) : Vector2<T>(T(1.0), T(0.0));
  out->row_a[0] = PointRow(direction, arm_a);
  out->row_b[0] = Negative(PointRow(direction, arm_b));
  out->error[0] = length - numbers[4];
  out->rows = 1;
}

}  // namespace tangible
