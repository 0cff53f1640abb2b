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
      break;  // its shares are evaluated apart
    case JointType::kFixedAngle:
      EvaluateAngleRow(pose_a, pose_b, numbers[0], 0, out);
      out->rows = 1;
      break;
  }
}

template <typename T>
void EvaluateShare(const Model<T>& model, const State<T>& state, const JointIndex& coupling, int k,
                   JointRows<T>* out) {
  const JointIndex& of = model.structure->joints[coupling.coupled[k]];
  EvaluateJoint(of.type, state.PoseOf(of.a), state.PoseOf(of.b), &model.parameters[of.geometry],
                out);
  ScaleToShare(coupling.type, k, &model.parameters[coupling.geometry], out);
}

template <typename T>
void EvaluateJoint(const Model<T>& model, const State<T>& state, const JointIndex& joint,
                   JointRows<T>* out) {
  if (!joint.IsCoupling()) {
    EvaluateJoint(joint.type, state.PoseOf(joint.a), state.PoseOf(joint.b),
                  &model.parameters[joint.geometry], out);
  }
  for (int k = 0; k < 2 && joint.IsCoupling(); ++k) {
    JointRows<T> share;
    EvaluateShare(model, state, joint, k, &share);
    AddShare(joint, model.structure->joints[joint.coupled[k]], k, share, out);
  }
  if (IsReleased(*model.structure, state, joint)) out->rows = 0;
}

}  // namespace tangible
