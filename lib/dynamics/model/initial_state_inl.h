// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The state at time 0: the poses of the scene, turned or moved by the joints' initial angles,
// displacements and rates. Each of these acts on all bodies that are connected to the joint on the
// side of bodies[0]. They are relative coordinates and commute, so their order does not matter.

#include <vector>

#include "tangible/dynamics/model/state.h"
#include "tangible/math/planar.h"
#include "tangible/scene/joint_graph.h"
#include "tangible/scene/scene.h"

namespace tangible {

/// Whether an initial angle or rate can act: a tree, and a joint type that has a coordinate.
template <typename T>
bool HasInitialCoordinate(const BasicJoint<T>& joint, JointPlace place) {
  return place == JointPlace::kTree &&
         (joint.type == JointType::kRevolute || joint.type == JointType::kPrismatic);
}

/// A world point or direction at time 0 that moves with a body as the initial angles are applied.
template <typename T>
struct CarriedFrame {
  Vector2<T> anchor;
  Vector2<T> axis;
};

template <typename T>
void ApplyInitialJoints(const BasicScene<T>& scene, State<T>* state) {
  const std::vector<JointPlace> places = ClassifyJoints(scene);
  std::vector<CarriedFrame<T>> frames;
  for (const BasicJoint<T>& joint : scene.joints) {
    frames.push_back({joint.anchors[0], joint.axis});
  }
  std::vector<std::vector<bool>> subtrees(scene.joints.size());
  for (size_t k = 0; k < scene.joints.size(); ++k) {
    const BasicJoint<T>& joint = scene.joints[k];
    if (!HasInitialCoordinate(joint, places[k])) {
      continue;
    }
    subtrees[k] = SubtreeOfJoint(scene, static_cast<int>(k));
    const Rotation<T> turn(joint.type == JointType::kRevolute ? joint.angle : T(0.0));
    const Vector2<T> pivot = frames[k].anchor;
    Vector2<T> shift(T(0.0), T(0.0));
    if (joint.type == JointType::kPrismatic) {
      using std::sqrt;
      const T length = sqrt(frames[k].axis.squaredNorm());
      shift = Vector2<T>(frames[k].axis * (joint.angle / length));
    }
    const auto move = [&](const Vector2<T>& point) -> Vector2<T> {
      return pivot + turn * Vector2<T>(point - pivot) + shift;
    };
    for (size_t i = 0; i < scene.bodies.size(); ++i) {
      if (!subtrees[k][i]) {
        continue;
      }
      const Vector2<T> moved = move(Vector2<T>(state->pose[3 * i], state->pose[3 * i + 1]));
      state->pose[3 * i] = moved.x();
      state->pose[3 * i + 1] = moved.y();
      if (joint.type == JointType::kRevolute) {
        state->pose[3 * i + 2] += joint.angle;
      }
    }
    // The anchors and axes of joints whose bodies[1] has moved, move along (an axis is fixed in
    // bodies[1]).
    for (size_t m = 0; m < scene.joints.size(); ++m) {
      const int b = scene.joints[m].bodies[1];
      if (m != k && b >= 0 && subtrees[k][b]) {
        frames[m].anchor = move(frames[m].anchor);
        frames[m].axis = turn * frames[m].axis;
      }
    }
  }
  for (size_t k = 0; k < scene.joints.size(); ++k) {
    const BasicJoint<T>& joint = scene.joints[k];
    if (subtrees[k].empty()) {
      continue;
    }
    for (size_t i = 0; i < scene.bodies.size(); ++i) {
      if (!subtrees[k][i]) {
        continue;
      }
      Vector2<T> velocity;
      if (joint.type == JointType::kRevolute) {
        const Vector2<T> arm(state->pose[3 * i] - frames[k].anchor.x(),
                             state->pose[3 * i + 1] - frames[k].anchor.y());
        velocity = Perp(arm) * joint.rate;
        state->twist[3 * i + 2] += joint.rate;
      } else {
        using std::sqrt;
        velocity = frames[k].axis * (joint.rate / sqrt(frames[k].axis.squaredNorm()));
      }
      state->twist[3 * i] += velocity.x();
      state->twist[3 * i + 1] += velocity.y();
    }
  }
}

}  // namespace tangible
