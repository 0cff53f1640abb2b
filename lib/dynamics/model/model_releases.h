// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Joints that end at a time T: from then on they have no rows, limits, friction, motor, effort,
// damping, spring or servo. A coupling ends with the first of its joints.
//
// By events T is an edge at which a motion ends (events/event_edges.h). A fixed step has the joint
// until its end if it begins before T: the joint ends at the first step that begins at T or later,
// so that what follows depends on T by whole steps alone, and the derivative by T is 0.

#include "tangible/dynamics/model/model.h"
#include "tangible/dynamics/model/tolerances.h"

namespace tangible {

/// Sets which joints have ended at a time.
template <typename T>
void SetReleased(const Model<double>& model, double time, State<T>* state) {
  const ModelStructure& s = *model.structure;
  if (!s.has_releases) return;
  state->released.resize(s.joints.size());
  for (size_t j = 0; j < s.joints.size(); ++j) {
    const int until = s.joints[j].until;
    state->released[j] = until >= 0 && model.parameters[until] <= time ? 1 : 0;
  }
  for (size_t j = 0; j < s.joints.size(); ++j) {
    for (const int coupled : s.joints[j].coupled) {
      if (coupled >= 0 && state->released[coupled] != 0) state->released[j] = 1;
    }
  }
}

/// The time until which a fixed step that begins at t takes joints as ended: ends of steps are
/// rounded.
inline double ReleasedAtStep(const ModelStructure& structure, double t) {
  return t + kSameTime * structure.settings.dt;
}

template <typename T>
bool IsReleased(const State<T>& state, int joint) {
  return !state.released.empty() && state.released[static_cast<size_t>(joint)] != 0;
}

/// The same of one of the structure's joints.
template <typename T>
bool IsReleased(const ModelStructure& structure, const State<T>& state, const JointIndex& joint) {
  return !state.released.empty() &&
         IsReleased(state, static_cast<int>(&joint - structure.joints.data()));
}

}  // namespace tangible
