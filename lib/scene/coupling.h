// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A coupling as a linear form of the poses of the two bodies that its joints hold:
//
//   coordinate(a) + ratio · coordinate(b)  =  g_0 · q_0 + g_1 · q_1 + constant,    q = (x, y, θ)
//
// The coordinate of a hinge is the difference of its two angles, that of a slider against a body at
// rest the way of the other body's centre of mass along the axis: the slider keeps the angle, so
// every point of the body goes the same way. Both are linear in the poses; the length of a distance
// joint and the coordinate of a slider against a body that moves are not.

#include <cmath>
#include <string>
#include <type_traits>

#include "tangible/scene/scene.h"

namespace tangible {

template <typename T>
struct CouplingForm {
  int bodies[2] = {-1, -1};
  T row[2][3] = {{T(0.0), T(0.0), T(0.0)}, {T(0.0), T(0.0), T(0.0)}};  ///< g
  /// Why there is no such form, as a sentence that begins with "expected"; "" where there is one.
  std::string fault;
};

/// The form of `coupling`, whose `coupled` are places of joints of the scene.
template <typename T>
CouplingForm<T> FormOf(const BasicScene<T>& scene, const BasicJoint<T>& coupling) {
  using std::sqrt;
  CouplingForm<T> form;
  int found = 0;
  const auto moves = [&scene](int body) {
    return body >= 0 && scene.bodies[body].motion != Motion::kStatic;
  };
  for (int k = 0; k < 2; ++k) {
    const BasicJoint<T>& joint = scene.joints[coupling.coupled[k]];
    const bool slides = joint.type == JointType::kPrismatic;
    if (!slides && joint.type != JointType::kRevolute) {
      form.fault =
          "expected revolute or prismatic joints, got " + joint.name + ", which is neither";
      return form;
    }
    if (slides && moves(joint.bodies[0]) && moves(joint.bodies[1])) {
      form.fault = "expected sliders against the world or a static body, got " + joint.name +
                   " between two bodies that move";
      return form;
    }
    for (int side = 0; side < 2; ++side) {
      const int body = joint.bodies[side];
      if (!moves(body)) continue;
      int at = 0;
      while (at < found && form.bodies[at] != body) ++at;
      if (at == 2) {
        form.fault = "expected joints that hold two moving bodies in all, got three or four";
        return form;
      }
      form.bodies[at] = body;
      found = at == found ? found + 1 : found;
      const T share = (k == 0 ? T(1.0) : coupling.ratio) * (side == 0 ? 1.0 : -1.0);
      if (slides) {
        const T length = sqrt(joint.axis.squaredNorm());
        form.row[at][0] += share * joint.axis.x() / length;
        form.row[at][1] += share * joint.axis.y() / length;
      } else {
        form.row[at][2] += share;
      }
    }
  }
  if (found < 2) form.fault = "expected joints that hold two moving bodies in all, got one";
  return form;
}

}  // namespace tangible
