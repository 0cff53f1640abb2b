// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/joint_inl.h"
#include "tangible/math/dual.h"

namespace tangible {

#define TANGIBLE_INSTANTIATE(T)                                                       \
  template void EvaluateJoint<T>(JointType, const Pose<T>&, const Pose<T>&, const T*, \
                                 JointRows<T>*);
#define TANGIBLE_INSTANTIATE_OF_MODEL(T)                                                   \
  template void EvaluateJoint<T>(const Model<T>&, const State<T>&, const JointIndex&,      \
                                 JointRows<T>*);                                           \
  template void EvaluateShare<T>(const Model<T>&, const State<T>&, const JointIndex&, int, \
                                 JointRows<T>*);
#define TANGIBLE_INSTANTIATE_JET(N)     \
  TANGIBLE_INSTANTIATE(Jet<N>)          \
  TANGIBLE_INSTANTIATE_OF_MODEL(Jet<N>) \
  TANGIBLE_INSTANTIATE(Dual<Jet<N>>)
TANGIBLE_INSTANTIATE(double)
TANGIBLE_INSTANTIATE_OF_MODEL(double)
TANGIBLE_INSTANTIATE(Dual<double>)
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
