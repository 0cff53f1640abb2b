// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Definitions of the templates of parameter.h; included by parameter.cc alone.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tangible/scene/joint_graph.h"
#include "tangible/scene/parameter.h"

namespace tangible {
namespace internal {

template <typename T>
class NumberList {
 public:
  explicit NumberList(BasicScene<T>* scene) : scene_(scene), places_(ClassifyJoints(*scene)) {}

  std::vector<SceneNumber<T>> Collect() {
    prefix_ = "gravity/";
    AddVector("", Dimension::kAcceleration, &scene_->gravity);
    for (BasicBody<T>& body : scene_->bodies) AddBody(&body);
    for (std::size_t i = 0; i < scene_->joints.size(); ++i) {
      AddJoint(places_[i] == JointPlace::kTree, &scene_->joints[i]);
    }
    for (BasicSpring<T>& spring : scene_->springs) AddSpring(&spring);
    for (BasicForce<T>& force : scene_->forces) AddForce(&force);
    for (BasicPair<T>& pair : scene_->pairs) AddPair(&pair);
    return numbers_;
  }

 private:
  static constexpr NumberKind kFree = NumberKind::kFree;
  static constexpr NumberKind kPositive = NumberKind::kPositive;
  static constexpr NumberKind kNonNegative = NumberKind::kNonNegative;

  void Add(const std::string& name, NumberKind kind, Dimension dimension, T* value) {
    numbers_.push_back({prefix_ + name, value, kind, dimension});
  }

  void AddVector(const std::string& name, Dimension dimension, Vector2<T>* value) {
    Add(name + "x", kFree, dimension, &value->x());
    Add(name + "y", kFree, dimension, &value->y());
  }

  void AddBody(BasicBody<T>* body) {
    prefix_ = "bodies/" + body->name + "/";
    const bool moving = body->motion == Motion::kMoving;
    if (moving) Add("mass", kPositive, Dimension::kMass, &body->mass);
    if (moving && body->inertia) Add("inertia", kPositive, Dimension::kInertia, &*body->inertia);
    AddVector("position/", Dimension::kLength, &body->position);
    Add("angle", kFree, Dimension::kAngle, &body->angle);
    if (body->motion != Motion::kStatic) {
      AddVector("velocity/", Dimension::kVelocity, &body->velocity);
      Add("angular_velocity", kFree, Dimension::kAngularVelocity, &body->angular_velocity);
    }
    Add("friction", kNonNegative, Dimension::kNone, &body->friction);
    Add("restitution", NumberKind::kFraction, Dimension::kNone, &body->restitution);
    if (moving) {
      Add("linear_damping", kNonNegative, Dimension::kLinearDamping, &body->linear_damping);
      Add("angular_damping", kNonNegative, Dimension::kAngularDamping, &body->angular_damping);
      if (body->quadratic_drag) {
        Add("quadratic_drag", kNonNegative, Dimension::kQuadraticDrag, &*body->quadratic_drag);
      }
    }
    AddShape(&body->shape);
    for (std::size_t i = 0; i < body->contact_points.size(); ++i) {
      AddVector("contact_points/" + std::to_string(i) + "/", Dimension::kLength,
                &body->contact_points[i]);
    }
  }

  void AddShape(BasicShape<T>* shape) {
    std::vector<T>& numbers = shape->numbers;
    switch (shape->type) {
      case ShapeType::kNone:
        break;
      case ShapeType::kCircle:
        Add("shape/radius", kPositive, Dimension::kLength, &numbers[0]);
        break;
      case ShapeType::kEllipse:
        Add("shape/radii/x", kPositive, Dimension::kLength, &numbers[0]);
        Add("shape/radii/y", kPositive, Dimension::kLength, &numbers[1]);
        break;
      case ShapeType::kBox:
        Add("shape/size/x", kPositive, Dimension::kLength, &numbers[0]);
        Add("shape/size/y", kPositive, Dimension::kLength, &numbers[1]);
        break;
      case ShapeType::kCapsule:
        Add("shape/length", kPositive, Dimension::kLength, &numbers[0]);
        Add("shape/radius", kPositive, Dimension::kLength, &numbers[1]);
        break;
      case ShapeType::kPolygon:
        for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
          const std::string vertex = "shape/vertices/" + std::to_string(i / 2);
          Add(vertex + "/x", kFree, Dimension::kLength, &numbers[i]);
          Add(vertex + "/y", kFree, Dimension::kLength, &numbers[i + 1]);
        }
        break;
      case ShapeType::kHalfPlane:
        Add("shape/normal/x", kFree, Dimension::kNone, &numbers[0]);
        Add("shape/normal/y", kFree, Dimension::kNone, &numbers[1]);
        Add("shape/offset", kFree, Dimension::kLength, &numbers[2]);
        break;
    }
  }

  void AddAnchors(Vector2<T> (&anchors)[2]) {
    AddVector("anchors/0/", Dimension::kLength, &anchors[0]);
    AddVector("anchors/1/", Dimension::kLength, &anchors[1]);
  }

  void AddJoint(bool movable, BasicJoint<T>* joint) {
    prefix_ = "joints/" + joint->name + "/";
    const bool prismatic = joint->type == JointType::kPrismatic;
    if (joint->type == JointType::kDistance) {
      AddAnchors(joint->anchors);
    } else if (joint->type != JointType::kFixedAngle) {
      AddVector("anchor/", Dimension::kLength, &joint->anchors[0]);
    }
    if (!prismatic && joint->type != JointType::kRevolute) return;
    if (prismatic) AddVector("axis/", Dimension::kNone, &joint->axis);
    const Dimension coordinate = prismatic ? Dimension::kLength : Dimension::kAngle;
    const Dimension speed = prismatic ? Dimension::kVelocity : Dimension::kAngularVelocity;
    if (movable) {
      Add(prismatic ? "displacement" : "angle", kFree, coordinate, &joint->angle);
      Add("rate", kFree, speed, &joint->rate);
    }
    Add("damping", kNonNegative, prismatic ? Dimension::kLinearDamping : Dimension::kAngularDamping,
        &joint->damping);
    if (joint->limits) {
      Add("limits/0", kFree, coordinate, &joint->limits->first);
      Add("limits/1", kFree, coordinate, &joint->limits->second);
    }
    const Dimension effort = prismatic ? Dimension::kForce : Dimension::kTorque;
    if (joint->friction) Add("friction", kNonNegative, effort, &*joint->friction);
    if (joint->kinetic_friction) {
      Add("kinetic_friction", kNonNegative, effort, &*joint->kinetic_friction);
      Add("stribeck_speed", kPositive, speed, &joint->stribeck_speed);
    }
    if (joint->stiffness) {
      Add("stiffness", kNonNegative,
          prismatic ? Dimension::kStiffness : Dimension::kAngularStiffness, &*joint->stiffness);
      Add(prismatic ? "rest_displacement" : "rest_angle", kFree, coordinate, &joint->rest);
    }
    if (!joint->effort_signal) {
      Add("effort", kFree, effort, &joint->effort);
    }
  }

  void AddSpring(BasicSpring<T>* spring) {
    prefix_ = "springs/" + spring->name + "/";
    AddAnchors(spring->anchors);
    Add("stiffness", kNonNegative, Dimension::kStiffness, &spring->stiffness);
    Add("damping", kNonNegative, Dimension::kLinearDamping, &spring->damping);
    Add("rest_length", kNonNegative, Dimension::kLength, &spring->rest_length);
  }

  void AddForce(BasicForce<T>* force) {
    prefix_ = "forces/" + force->name + "/";
    if (!force->force_signal) AddVector("force/", Dimension::kForce, &force->force);
    if (!force->torque_signal) Add("torque", kFree, Dimension::kTorque, &force->torque);
    AddVector("at/", Dimension::kLength, &force->at);
    if (force->start) Add("start", kFree, Dimension::kTime, &*force->start);
    if (force->end) Add("end", kFree, Dimension::kTime, &*force->end);
  }

  void AddPair(BasicPair<T>* pair) {
    prefix_ = "pairs/" + pair->bodies[0] + ":" + pair->bodies[1] + "/";
    if (pair->friction) Add("friction", kNonNegative, Dimension::kNone, &*pair->friction);
    if (pair->restitution) {
      Add("restitution", NumberKind::kFraction, Dimension::kNone, &*pair->restitution);
    }
  }

  BasicScene<T>* scene_;
  std::vector<JointPlace> places_;
  std::string prefix_;
  std::vector<SceneNumber<T>> numbers_;
};

template <typename T>
Vector2<T> CastVector(const Vector2<double>& vector) {
  return Vector2<T>(T(vector.x()), T(vector.y()));
}

template <typename T>
std::optional<T> CastOptional(const std::optional<double>& value) {
  return value ? std::optional<T>(T(*value)) : std::nullopt;
}

template <typename T>
BasicBody<T> CastBody(const BasicBody<double>& from) {
  BasicBody<T> body;
  body.name = from.name;
  body.motion = from.motion;
  body.shape.type = from.shape.type;
  for (const double number : from.shape.numbers) body.shape.numbers.push_back(T(number));
  for (const Vector2<double>& point : from.contact_points) {
    body.contact_points.push_back(CastVector<T>(point));
  }
  body.mass = T(from.mass);
  body.inertia = CastOptional<T>(from.inertia);
  body.position = CastVector<T>(from.position);
  body.angle = T(from.angle);
  body.velocity = CastVector<T>(from.velocity);
  body.angular_velocity = T(from.angular_velocity);
  body.friction = T(from.friction);
  body.restitution = T(from.restitution);
  body.linear_damping = T(from.linear_damping);
  body.angular_damping = T(from.angular_damping);
  body.quadratic_drag = CastOptional<T>(from.quadratic_drag);
  return body;
}

template <typename T>
BasicJoint<T> CastJoint(const BasicJoint<double>& from) {
  BasicJoint<T> joint;
  joint.name = from.name;
  joint.type = from.type;
  for (int i = 0; i < 2; ++i) {
    joint.bodies[i] = from.bodies[i];
    joint.anchors[i] = CastVector<T>(from.anchors[i]);
  }
  joint.axis = CastVector<T>(from.axis);
  joint.angle = T(from.angle);
  joint.rate = T(from.rate);
  joint.damping = T(from.damping);
  if (from.limits) joint.limits = {T(from.limits->first), T(from.limits->second)};
  joint.stiffness = CastOptional<T>(from.stiffness);
  joint.friction = CastOptional<T>(from.friction);
  joint.kinetic_friction = CastOptional<T>(from.kinetic_friction);
  joint.stribeck_speed = T(from.stribeck_speed);
  joint.rest = T(from.rest);
  joint.effort = T(from.effort);
  joint.effort_signal = from.effort_signal;
  joint.contact = from.contact;
  return joint;
}

template <typename T>
BasicSpring<T> CastSpring(const BasicSpring<double>& from) {
  BasicSpring<T> spring;
  spring.name = from.name;
  for (int i = 0; i < 2; ++i) {
    spring.bodies[i] = from.bodies[i];
    spring.anchors[i] = CastVector<T>(from.anchors[i]);
  }
  spring.stiffness = T(from.stiffness);
  spring.damping = T(from.damping);
  spring.rest_length = T(from.rest_length);
  return spring;
}

template <typename T>
BasicForce<T> CastForce(const BasicForce<double>& from) {
  BasicForce<T> force;
  force.name = from.name;
  force.body = from.body;
  force.force = CastVector<T>(from.force);
  force.torque = T(from.torque);
  force.force_signal = from.force_signal;
  force.torque_signal = from.torque_signal;
  force.at = CastVector<T>(from.at);
  force.start = CastOptional<T>(from.start);
  force.end = CastOptional<T>(from.end);
  return force;
}

}  // namespace internal

template <typename T>
std::vector<SceneNumber<T>> EnumerateNumbers(BasicScene<T>* scene) {
  return internal::NumberList<T>(scene).Collect();
}

template <typename T>
BasicScene<T> CastScene(const Scene& scene) {
  BasicScene<T> result;
  result.name = scene.name;
  result.path = scene.path;
  result.gravity = internal::CastVector<T>(scene.gravity);
  for (const auto& body : scene.bodies) result.bodies.push_back(internal::CastBody<T>(body));
  for (const auto& joint : scene.joints) result.joints.push_back(internal::CastJoint<T>(joint));
  for (const auto& spring : scene.springs)
    result.springs.push_back(internal::CastSpring<T>(spring));
  for (const auto& force : scene.forces) result.forces.push_back(internal::CastForce<T>(force));
  for (const auto& from : scene.pairs) {
    BasicPair<T> pair;
    pair.bodies[0] = from.bodies[0];
    pair.bodies[1] = from.bodies[1];
    pair.friction = internal::CastOptional<T>(from.friction);
    pair.restitution = internal::CastOptional<T>(from.restitution);
    result.pairs.push_back(pair);
  }
  result.no_contact = scene.no_contact;
  result.simulation = scene.simulation;
  return result;
}

}  // namespace tangible
