// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A scene in other units, and elsewhere: masses stay as they are.

#include "tangible/scene/scene.h"

namespace tangible::test_scenes {

/// What a run in the new units has for 1 m and 1 s of the old ones, and where its origin lies, m.
struct Units {
  double length = 1.0;
  double time = 1.0;
  Vector2<double> origin{0.0, 0.0};
};

/// The same motion in other units. Normals of half-planes are of length 1.
inline Scene Rescaled(Scene scene, const Units& units) {
  const double l = units.length;
  const double t = units.time;
  const double speed = l / t;
  const double force = l / (t * t);
  const auto place = [&](Vector2<double>* x) { *x = units.origin + l * *x; };
  scene.gravity *= force;
  for (BasicBody<double>& body : scene.bodies) {
    place(&body.position);
    body.velocity *= speed;
    body.angular_velocity /= t;
    body.linear_damping /= t;
    body.angular_damping *= l * speed;
    if (body.inertia) *body.inertia *= l * l;
    std::vector<double>& numbers = body.shape.numbers;
    if (body.shape.type == ShapeType::kHalfPlane) {
      numbers[2] = l * numbers[2];
    } else {
      for (double& number : numbers) number *= l;
    }
  }
  for (BasicJoint<double>& joint : scene.joints) {
    for (Vector2<double>& anchor : joint.anchors) place(&anchor);
    const double unit = joint.type == JointType::kPrismatic ? l : 1.0;
    const double moment = joint.type == JointType::kPrismatic ? 1.0 : l;
    joint.angle *= unit;
    joint.rate *= unit / t;
    if (joint.limits) {
      joint.limits->first *= unit;
      joint.limits->second *= unit;
    }
    joint.damping *= moment * moment / t;
    joint.effort *= moment * force;
  }
  for (BasicSpring<double>& spring : scene.springs) {
    for (Vector2<double>& anchor : spring.anchors) place(&anchor);
    spring.stiffness /= t * t;
    spring.damping /= t;
    spring.rest_length *= l;
  }
  for (BasicForce<double>& push : scene.forces) {
    push.force *= force;
    push.torque *= l * force;
    push.at *= l;
    if (push.start) *push.start *= t;
    if (push.end) *push.end *= t;
  }
  SimulationSettings& settings = scene.simulation;
  settings.dt *= t;
  settings.duration *= t;
  settings.joint_tolerance *= l;
  settings.restitution_threshold *= speed;
  settings.recovery_speed *= speed;
  settings.contact_margin *= l;
  return scene;
}

}  // namespace tangible::test_scenes
