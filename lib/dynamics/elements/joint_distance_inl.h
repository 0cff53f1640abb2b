// SPDX-License-Identifier: Apache-2.0
#pragma once
// Distance joint: |p_a − p_b| stays as drawn; of a rope it is the coordinate, which limits bound.
// Included by joint.cc alone.

#include <cmath>

#include "tangible/dynamics/elements/joint.h"

namespace tangible {

/// |p_a − p_b|, m, and its row.
template <typename T>
T EvaluateSeparation(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                     RowPart<T>* row_a, RowPart<T>* row_b) {
  using std::sqrt;
  const Vector2<T> arm_a = pose_a.rotation * Vector2<T>(numbers[0], numbers[1]);
  const Vector2<T> arm_b = pose_b.rotation * Vector2<T>(numbers[2], numbers[3]);
  const Vector2<T> offset = pose_a.position + arm_a - pose_b.position - arm_b;
  const T squared = offset.squaredNorm();
  // At coincident anchors the direction is undefined, and sqrt has no derivative.
  const bool apart = ValueOf(squared) > 0.0;
  const T length = apart ? T(sqrt(squared)) : T(0.0);
  const Vector2<T> direction = apart ? Vector2<T>(offset / length) : Vector2<T>(T(1.0), T(0.0));
  *row_a = PointRow(direction, arm_a);
  *row_b = Negative(PointRow(direction, arm_b));
  return length;
}

template <typename T>
void EvaluateDistance(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                      JointRows<T>* out) {
  out->error[0] =
      EvaluateSeparation(pose_a, pose_b, numbers, &out->row_a[0], &out->row_b[0]) - numbers[4];
  out->rows = 1;
}

template <typename T>
void EvaluateRope(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                  JointRows<T>* out) {
  out->coordinate =
      EvaluateSeparation(pose_a, pose_b, numbers, &out->coordinate_a, &out->coordinate_b);
  out->rows = 0;
}

}  // namespace tangible
