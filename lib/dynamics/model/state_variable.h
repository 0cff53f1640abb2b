// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Numbers of a state by the index of their variable: poses of all bodies, then twists
// (ModelStructure::PoseVariable, TwistVariable).

#include "tangible/dynamics/model/state.h"

namespace tangible {

template <typename T>
const T& StateNumber(const State<T>& state, int variable) {
  const int poses = static_cast<int>(state.pose.size());
  return variable < poses ? state.pose[variable] : state.twist[variable - poses];
}

template <typename T>
T& StateNumber(State<T>* state, int variable) {
  return const_cast<T&>(StateNumber(*state, variable));
}

}  // namespace tangible
