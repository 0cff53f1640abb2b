// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "tangible/scene/json_writer.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

OrderedJson PointJson(const Vector2<double>& point) {
  return OrderedJson::array({point.x(), point.y()});
}

OrderedJson AnchorsJson(const Vector2<double> (&anchors)[2]) {
  return OrderedJson::array({PointJson(anchors[0]), PointJson(anchors[1])});
}

OrderedJson SignalJson(const Signal& signal) {
  return {{"file", signal.file},
          {"interpolation", NameOf(signal.interpolation, kInterpolationNames)}};
}

OrderedJson ShapeJson(const BasicShape<double>& shape) {
  const std::vector<double>& numbers = shape.numbers;
  OrderedJson body = OrderedJson::object();
  switch (shape.type) {
    case ShapeType::kNone:
      break;
    case ShapeType::kCircle:
      body["radius"] = numbers[0];
      break;
    case ShapeType::kEllipse:
      body["radii"] = {numbers[0], numbers[1]};
      break;
    case ShapeType::kBox:
      body["size"] = {numbers[0], numbers[1]};
      break;
    case ShapeType::kCapsule:
      body["length"] = numbers[0];
      body["radius"] = numbers[1];
      break;
    case ShapeType::kPolygon:
      for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
        body["vertices"].push_back(OrderedJson::array({numbers[i], numbers[i + 1]}));
      }
      break;
    case ShapeType::kHalfPlane:
      body["normal"] = {numbers[0], numbers[1]};
      body["offset"] = numbers[2];
      break;
  }
  OrderedJson json = OrderedJson::object();
  json[NameOf(shape.type, kShapeTypeNames)] = body;
  return json;
}

OrderedJson BodyJson(const BasicBody<double>& body) {
  OrderedJson json = OrderedJson::object();
  json["name"] = body.name;
  if (body.motion == Motion::kStatic) json["static"] = true;
  if (body.motion == Motion::kKinematic) json["kinematic"] = true;
  if (body.shape.type != ShapeType::kNone) json["shape"] = ShapeJson(body.shape);
  for (const Vector2<double>& point : body.contact_points) {
    json["contact_points"].push_back(PointJson(point));
  }
  if (body.mass > 0.0) json["mass"] = body.mass;
  if (body.inertia) json["inertia"] = *body.inertia;
  json["position"] = PointJson(body.position);
  json["angle"] = body.angle;
  json["velocity"] = PointJson(body.velocity);
  json["angular_velocity"] = body.angular_velocity;
  json["friction"] = body.friction;
  json["restitution"] = body.restitution;
  json["linear_damping"] = body.linear_damping;
  json["angular_damping"] = body.angular_damping;
  if (body.quadratic_drag) json["quadratic_drag"] = *body.quadratic_drag;
  return json;
}

class SceneWriter {
 public:
  explicit SceneWriter(const Scene& scene) : scene_(scene) {}

  OrderedJson Write() const {
    OrderedJson json = OrderedJson::object();
    json["name"] = scene_.name;
    json["gravity"] = PointJson(scene_.gravity);
    json["bodies"] = OrderedJson::array();
    for (const auto& body : scene_.bodies) json["bodies"].push_back(BodyJson(body));
    for (const auto& joint : scene_.joints) json["joints"].push_back(JointJson(joint));
    for (const auto& spring : scene_.springs) json["springs"].push_back(SpringJson(spring));
    for (const auto& force : scene_.forces) json["forces"].push_back(ForceJson(force));
    for (const auto& pair : scene_.pairs) {
      OrderedJson item = {{"bodies", {pair.bodies[0], pair.bodies[1]}}};
      if (pair.friction) item["friction"] = *pair.friction;
      if (pair.restitution) item["restitution"] = *pair.restitution;
      json["pairs"].push_back(item);
    }
    for (const auto& [first, second] : scene_.no_contact) {
      json["no_contact"].push_back(OrderedJson::array({first, second}));
    }
    json["simulation"] = SimulationJson();
    return json;
  }

 private:
  std::string BodyName(int body) const { return body < 0 ? "world" : scene_.bodies[body].name; }

  OrderedJson EndsJson(const int (&bodies)[2]) const {
    return OrderedJson::array({BodyName(bodies[0]), BodyName(bodies[1])});
  }

  OrderedJson JointJson(const BasicJoint<double>& joint) const {
    OrderedJson json = {{"name", joint.name},
                        {"type", NameOf(joint.type, kJointTypeNames)},
                        {"bodies", EndsJson(joint.bodies)}};
    const bool prismatic = joint.type == JointType::kPrismatic;
    if (joint.type == JointType::kDistance) {
      json["anchors"] = AnchorsJson(joint.anchors);
    } else if (joint.type != JointType::kFixedAngle) {
      json["anchor"] = PointJson(joint.anchors[0]);
    }
    if (prismatic) json["axis"] = PointJson(joint.axis);
    if (prismatic || joint.type == JointType::kRevolute) {
      json[prismatic ? "displacement" : "angle"] = joint.angle;
      json["rate"] = joint.rate;
      json["damping"] = joint.damping;
      if (joint.limits) {
        json["limits"] = OrderedJson::array({joint.limits->first, joint.limits->second});
      }
      if (joint.friction) json["friction"] = *joint.friction;
      if (joint.kinetic_friction) {
        json["kinetic_friction"] = *joint.kinetic_friction;
        json["stribeck_speed"] = joint.stribeck_speed;
      }
      if (joint.stiffness) {
        json["stiffness"] = *joint.stiffness;
        json[prismatic ? "rest_displacement" : "rest_angle"] = joint.rest;
      }
      json["effort"] =
          joint.effort_signal ? SignalJson(*joint.effort_signal) : OrderedJson(joint.effort);
    }
    json["contact"] = joint.contact;
    return json;
  }

  OrderedJson SpringJson(const BasicSpring<double>& spring) const {
    return {{"name", spring.name},
            {"bodies", EndsJson(spring.bodies)},
            {"anchors", AnchorsJson(spring.anchors)},
            {"stiffness", spring.stiffness},
            {"damping", spring.damping},
            {"rest_length", spring.rest_length}};
  }

  OrderedJson ForceJson(const BasicForce<double>& force) const {
    OrderedJson json = {{"name", force.name}, {"body", BodyName(force.body)}};
    json["force"] = force.force_signal ? SignalJson(*force.force_signal) : PointJson(force.force);
    json["torque"] =
        force.torque_signal ? SignalJson(*force.torque_signal) : OrderedJson(force.torque);
    json["at"] = PointJson(force.at);
    if (force.start) json["start"] = *force.start;
    if (force.end) json["end"] = *force.end;
    return json;
  }

  OrderedJson SimulationJson() const {
    const SimulationSettings& settings = scene_.simulation;
    OrderedJson json = {{"dt", settings.dt},
                        {"duration", settings.duration},
                        {"stepping", NameOf(settings.stepping, kSteppingNames)}};
    // Settings that are not set are not written, so that they follow the stepping when the file is
    // read.
    if (settings.integrator) json["integrator"] = NameOf(*settings.integrator, kIntegratorNames);
    if (settings.joint_correction) {
      json["joint_correction"] = NameOf(*settings.joint_correction, kJointCorrectionNames);
    }
    json["joint_tolerance"] = settings.joint_tolerance;
    json["friction_mixing"] = NameOf(settings.friction_mixing, kMixingNames);
    json["restitution_mixing"] = NameOf(settings.restitution_mixing, kMixingNames);
    json["impact_law"] = NameOf(settings.impact_law, kImpactLawNames);
    json["restitution_threshold"] = settings.restitution_threshold;
    json["recovery_speed"] = settings.recovery_speed;
    json["contact_margin"] = settings.contact_margin;
    json["max_events_per_step"] = settings.max_events_per_step;
    json["lcp_tolerance"] = settings.lcp_tolerance;
    json["lcp_max_iterations"] = settings.lcp_max_iterations;
    return json;
  }

  const Scene& scene_;
};

}  // namespace

std::string SceneToJson(const Scene& scene) { return JsonText(SceneWriter(scene).Write()); }

}  // namespace tangible
