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

/// The bodies on the bodies[0] side of a joint of a tree.
template <typename T>
std::vector<bool> SubtreeOfJoint(const BasicScene<T>& scene, int joint) {
  std::vector<bool> inside(scene.bodies.size(), false);
  inside[scene.joints[joint].bodies[0]] = true;
  // The set spreads over the other joints until nothing changes. This takes quadratic time, which
  // is affordable because a scene is built once.
  for (bool changed = true; changed;) {
    changed = false;
    for (size_t k = 0; k < scene.joints.size(); ++k) {
      const int a = scene.joints[k].bodies[0];
      const int b = scene.joints[k].bodies[1];
      const auto moves = [&](int body) {
        return body >= 0 && scene.bodies[body].motion == Motion::kMoving;
      };
      if (static_cast<int>(k) == joint || !moves(a) || !moves(b) || inside[a] == inside[b]) {
        continue;
      }
      inside[a] = inside[b] = true;
      changed = true;
    }
  }
  return inside;
}

}  // namespace tangible
