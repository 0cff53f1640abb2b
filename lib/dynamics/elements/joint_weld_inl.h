// SPDX-License-Identifier: Apache-2.0
#pragma once
// Weld: anchors and angles stay together. Included by joint.cc alone.

#include "tangible/dynamics/elements/joint_fixed_angle_inl.h"
#include "tangible/dynamics/elements/joint_revolute_inl.h"

namespace tangible {

template <typename T>
void EvaluateWeld(const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                  JointRows<T>* out) {
  EvaluatePointRows(pose_a, pose_b, numbers, out);
  EvaluateAngleRow(pose_a, pose_b, numbers[4], 2, out);
  out->rows = 3;
}

}  // namespace tangible
