// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definition of the template of joint.h; included by joint.cc, and by verification's file for
// another scalar.

#include "tangible/dynamics/elements/joint.h"
#include "tangible/dynamics/elements/joint_coupling_inl.h"
#include "tangible/dynamics/elements/joint_distance_inl.h"
#include "tangible/dynamics/elements/joint_fixed_angle_inl.h"
#include "tangible/dynamics/elements/joint_prismatic_inl.h"
#include "tangible/dynamics/elements/joint_revolute_inl.h"
#include "tangible/dynamics/elements/joint_weld_inl.h"

namespace tangible {

template <typename T>
void EvaluateJoint(JointType type, const Pose<T>& pose_a, const Pose<T>& pose_b, const T* numbers,
                   JointRows<T>* out) {
  switch (type) {
    case JointType::kRevolute:
      EvaluateRevolute(pose_a, pose_b, numbers, out);
      break;
    case JointType::kPrismatic:
      EvaluatePrismatic(pose_a, pose_b, numbers, out);
      break;
    case JointType::kWeld:
      EvaluateWeld(pose_a, pose_b, numbers, out);
      break;
    case JointType::kDistance:
      EvaluateDistance(pose_a, pose_b, numbers, out);
      break;
    case JointType::kRope:
      EvaluateRope(pose_a, pose_b, numbers, out);
      break;
    case JointType::kCoupling:
    case JointType::kLimitedCoupling:
      EvaluateCoupling(type, pose_a, pose_b, numbers, out);
      break;
    case JointType::kFixedAngle:
      EvaluateAngleRow(pose_a, pose_b, numbers[0], 0, out);
      out->rows = 1;
      break;
  }
}

}  // namespace tangible
