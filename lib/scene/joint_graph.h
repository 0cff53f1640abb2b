// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The graph of joints: which of them may be given an initial angle, displacement or rate.
//
// Nodes are the moving bodies and one node for everything fixed (the world, static and kinematic
// bodies); every joint is an edge. An initial angle turns all bodies on the joint's bodies[0] side.
// That is possible if the edge is a bridge and the fixed node is not on that side.

#include <vector>

#include "tangible/scene/scene.h"

namespace tangible {

enum class JointPlace {
  kTree,        ///< a bridge; the bodies on bodies[0]'s side are free to be turned or moved
  kFixedFirst,  ///< a bridge, but bodies[0]'s side holds the fixed node
  kLoop,        ///< not a bridge: part of a closed loop
};

/// The place of each joint, in order. Linear in bodies and joints.
template <typename T>
std::vector<JointPlace> ClassifyJoints(const BasicScene<T>& scene);

}  // namespace tangible
