// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A coupling of the coordinates of two joints,
//
//   coordinate(a) + ratio · coordinate(b)  =  its value at time 0, or within limits of it:
//
// the bodies that it connects, and which joints can be coupled. The coordinate of a hinge is the
// difference of its angles, of a slider the way along its axis, of a distance joint with limits the
// distance of its points. A distance joint without limits keeps that distance, so that there is
// nothing to couple.

#include <string>

#include "tangible/scene/scene.h"

namespace tangible {

struct CouplingEnds {
  int bodies[4] = {-1, -1, -1, -1};  ///< not static ones, in the order of the joints; −1: fewer
  /// Why the joints cannot be coupled, as a sentence that begins with "expected"; "" where they
  /// can.
  std::string fault;
};

/// The ends of `coupling`, whose `coupled` are places of joints of the scene.
template <typename T>
CouplingEnds EndsOf(const BasicScene<T>& scene, const BasicJoint<T>& coupling) {
  CouplingEnds ends;
  int found = 0;
  for (const int coupled : coupling.coupled) {
    const BasicJoint<T>& joint = scene.joints[coupled];
    const bool is_rope = joint.type == JointType::kDistance && joint.limits;
    if (joint.type != JointType::kPrismatic && joint.type != JointType::kRevolute && !is_rope) {
      ends.fault = joint.type == JointType::kDistance
                       ? "expected joints that move, got " + joint.name +
                             ", which keeps its distance ([0, null] as its limits leaves it free)"
                       : "expected revolute, prismatic or distance joints, got " + joint.name +
                             ", which is none of these";
      return ends;
    }
    for (const int body : joint.bodies) {
      if (body < 0 || scene.bodies[body].motion == Motion::kStatic) continue;
      int at = 0;
      while (at < found && ends.bodies[at] != body) ++at;
      ends.bodies[at] = body;
      found = at == found ? found + 1 : found;
    }
  }
  if (found > 2 && coupling.limits) {
    ends.fault =
        "expected joints of at most two moving bodies in all under a coupling with limits, got " +
        std::to_string(found);
  }
  return ends;
}

}  // namespace tangible
