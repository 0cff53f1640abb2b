// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/joint.h"

#include "tangible/dynamics/joint_distance_inl.h"
#include "tangible/dynamics/joint_fixed_angle_inl.h"
#include "tangible/dynamics/joint_prismatic_inl.h"
#include "tangible/dynamics/joint_revolute_inl.h"
#include "tangible/dynamics/joint_weld_inl.h"
#include "tangible/math/dual.h"

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
    case JointType::kFixedAngle:
      EvaluateAngleRow(pose_a, pose_b, numbers[0], 0, out);
      out->rows = 1;
      break;
  }
}

#define TANGIBLE_INSTANTIATE(T)                                                       \
  template void EvaluateJoint<T>(JointType, const Pose<T>&, const Pose<T>&, const T*, \
                                 JointRows<T>*);
#define TANGIBLE_INSTANTIATE_JET(N) \
  TANGIBLE_INSTANTIATE(Jet<N>)      \
  TANGIBLE_INSTANTIATE(Dual<Jet<N>>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_INSTANTIATE(Dual<double>)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
