// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The fields of a scene file, each said once: its key, range, unit, and when it is there.
//
// For each kind of item a function visits its fields in the order of their parameters. The reader,
// the writer, paths, casts, the checks of values in memory and the JSON Schema are visitors. A
// visitor has a function for each form in which numbers are written:
//
//   Number          1.5
//   Optional        the same, or absent
//   Point           [x, y]
//   Points          [[x, y], ...]
//   List            [1.5, ...], or absent
//   Anchors         [[x, y], [x, y]]
//   Interval        [low, high], or absent; null: infinite
//   Numbers         two numbers of a shape: [w, h]
//   Vertices        numbers of a polygon, polyline or spline: [[x, y], ...]
//   NumberOrSignal  1.5 or {"file": ...}
//   PointOrSignal   [x, y] or {"file": ...}
//   NumberOrServo   as NumberOrSignal, or {"target": ..., "stiffness": ...}
//   PointOrServos   as PointOrSignal, each of x and y a number or such an object
//   Part            an object with fields of its own, or absent
//   Path            in such an object: "file" and "interpolation"
//   Choice, Count   settings that are no parameters
//
// What is no number by itself (names, bodies, the type of a joint or shape) is read and written
// where the items are.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tangible/scene/parameter.h"
#include "tangible/scene/scene.h"
#include "tangible/scene/scene_names.h"

namespace tangible {

struct Field {
  const char* key;
  NumberKind kind = NumberKind::kFree;
  Dimension dimension = Dimension::kNone;
  bool required = false;
  /// Whether a path can name it, where it is present.
  bool parameter = true;
  /// The field without which it has no meaning, and whether that one is there.
  const char* with = nullptr;
  bool present = true;
  /// What messages say of two numbers.
  const char* form = " [x, y]";
  /// What messages expect of the field `with`.
  const char* with_form = "a number >= 0";
  /// The field beside which it must not be; then it is not present.
  const char* without = nullptr;
  int least = 3;  ///< of points
};

inline constexpr Field kGravityField{"gravity", NumberKind::kFree, Dimension::kAcceleration};

template <typename Shape, typename Visitor>
void VisitShape(Shape& shape, Visitor* visitor) {
  auto& numbers = shape.numbers;
  const auto length = [](const char* key, const char* form = "") {
    Field field{key, NumberKind::kPositive, Dimension::kLength, true};
    field.form = form;
    return field;
  };
  switch (shape.type) {
    case ShapeType::kNone:
      break;
    case ShapeType::kCircle:
      visitor->Number(length("radius"), numbers[0]);
      break;
    case ShapeType::kEllipse:
      visitor->Numbers(length("radii", ", the semi-axes along x and y"), numbers[0], numbers[1]);
      break;
    case ShapeType::kBox:
      visitor->Numbers(length("size", " [width, height]"), numbers[0], numbers[1]);
      break;
    case ShapeType::kCapsule:
      visitor->Number(length("length"), numbers[0]);
      visitor->Number(length("radius"), numbers[1]);
      break;
    case ShapeType::kPolygon:
      visitor->Vertices({"vertices", NumberKind::kFree, Dimension::kLength, true}, numbers);
      break;
    case ShapeType::kPolyline:
    case ShapeType::kSpline: {
      Field points{"points", NumberKind::kFree, Dimension::kLength, true};
      points.least = 2;
      visitor->Vertices(points, numbers);
      break;
    }
    case ShapeType::kHalfPlane:
      visitor->Numbers({"normal", NumberKind::kFree, Dimension::kNone, true}, numbers[0],
                       numbers[1]);
      visitor->Number({"offset", NumberKind::kFree, Dimension::kLength}, numbers[2]);
      break;
  }
}

/// Whether a shape is a line that bounds a solid on one side, of a body that does not move freely.
inline bool IsTrack(ShapeType type) {
  return type == ShapeType::kPolyline || type == ShapeType::kSpline;
}

/// How many numbers a shape has; 0: any, as a polygon, polyline or spline.
inline int NumNumbers(ShapeType type) {
  switch (type) {
    case ShapeType::kNone:
    case ShapeType::kPolygon:
    case ShapeType::kPolyline:
    case ShapeType::kSpline:
      return 0;
    case ShapeType::kCircle:
      return 1;
    case ShapeType::kEllipse:
    case ShapeType::kBox:
    case ShapeType::kCapsule:
      return 2;
    case ShapeType::kHalfPlane:
      return 3;
  }
  return 0;
}

/// Friction that decays with the speed, and rolling friction, of a body or pair.
template <typename Item, typename Visitor>
void VisitFurtherFriction(Item& item, Visitor* visitor) {
  visitor->Optional({"kinetic_friction", NumberKind::kNonNegative}, item.kinetic_friction);
  visitor->Number({"stribeck_speed", NumberKind::kPositive, Dimension::kVelocity, true, true,
                   "kinetic_friction", item.kinetic_friction.has_value()},
                  item.stribeck_speed);
  visitor->Optional({"rolling_friction", NumberKind::kNonNegative, Dimension::kLength},
                    item.rolling_friction);
}

/// The recorded path of a kinematic body.
template <typename Body, typename Visitor>
void VisitDrivenMotion(Body& body, Visitor* visitor) {
  Field field{"motion"};
  field.with = "kinematic";
  field.with_form = "true";
  field.present = body.motion == Motion::kKinematic;
  visitor->Part(field, body.driven, [](auto& driven, auto* fields) {
    constexpr NumberKind kFree = NumberKind::kFree;
    fields->Path(driven.path);
    fields->Number({"delay", kFree, Dimension::kTime}, driven.delay);
    fields->Number({"scale", kFree}, driven.scale);
    fields->Point({"offset", kFree, Dimension::kLength}, driven.offset);
    fields->Number({"offset_angle", kFree, Dimension::kAngle}, driven.offset_angle);
  });
}

/// The friction of a body on the plane of motion.
template <typename Body, typename Visitor>
void VisitSupport(Body& body, Visitor* visitor) {
  visitor->Part({"support"}, body.support, [](auto& support, auto* fields) {
    constexpr NumberKind kPositive = NumberKind::kPositive;
    fields->Number({"friction", NumberKind::kNonNegative, Dimension::kNone, true},
                   support.friction);
    fields->Optional({"load", kPositive, Dimension::kForce}, support.load);
    fields->Points({"points", NumberKind::kFree, Dimension::kLength}, support.points);
    Field shares{"shares", kPositive};
    shares.with = "points";
    shares.with_form = "an array of points";
    shares.present = !support.points.empty();
    fields->List(shares, support.shares);
    fields->Optional({"radius", kPositive, Dimension::kLength}, support.radius);
  });
}

/// The fields of a body but its shape.
template <typename Body, typename Visitor>
void VisitBody(Body& body, Visitor* visitor) {
  constexpr NumberKind kPositive = NumberKind::kPositive;
  constexpr NumberKind kNonNegative = NumberKind::kNonNegative;
  const bool moves = body.motion == Motion::kMoving;
  const bool has_velocity = body.motion != Motion::kStatic && !body.driven;
  visitor->Number({"mass", kPositive, Dimension::kMass, moves, moves}, body.mass);
  visitor->Optional({"inertia", kPositive, Dimension::kInertia, false, moves}, body.inertia);
  visitor->Point({"position", NumberKind::kFree, Dimension::kLength, moves}, body.position);
  visitor->Number({"angle", NumberKind::kFree, Dimension::kAngle}, body.angle);
  VisitDrivenMotion(body, visitor);
  const auto velocity = [&](const char* key, Dimension dimension) {
    Field field{key, NumberKind::kFree, dimension, false, has_velocity};
    field.present = !body.driven.has_value();
    field.without = "motion";
    return field;
  };
  visitor->Point(velocity("velocity", Dimension::kVelocity), body.velocity);
  visitor->Number(velocity("angular_velocity", Dimension::kAngularVelocity), body.angular_velocity);
  visitor->Number({"friction", kNonNegative}, body.friction);
  visitor->Number({"restitution", NumberKind::kFraction}, body.restitution);
  visitor->Number({"linear_damping", kNonNegative, Dimension::kLinearDamping, false, moves},
                  body.linear_damping);
  visitor->Number({"angular_damping", kNonNegative, Dimension::kAngularDamping, false, moves},
                  body.angular_damping);
  visitor->Optional({"quadratic_drag", kNonNegative, Dimension::kQuadraticDrag, false, moves},
                    body.quadratic_drag);
  VisitFurtherFriction(body, visitor);
  VisitSupport(body, visitor);
}

template <typename Body, typename Visitor>
void VisitContactPoints(Body& body, Visitor* visitor) {
  visitor->Points({"contact_points", NumberKind::kFree, Dimension::kLength}, body.contact_points);
}

template <typename Joint, typename Visitor>
void VisitLimits(Joint& joint, NumberKind kind, Dimension dimension, Visitor* visitor) {
  visitor->Interval({"limits", kind, dimension}, joint.limits);
  Field restitution{"limit_restitution", NumberKind::kFraction};
  restitution.with = "limits";
  restitution.with_form = "[low, high]";
  restitution.present = joint.limits.has_value();
  visitor->Optional(restitution, joint.limit_restitution);
}

/// A servo along a coordinate that is a length, or an angle.
struct ServoFields {
  bool slides;

  template <typename Servo, typename Visitor>
  void operator()(Servo& servo, Visitor* visitor) const {
    constexpr NumberKind kNonNegative = NumberKind::kNonNegative;
    visitor->NumberOrSignal(
        {"target", NumberKind::kFree, slides ? Dimension::kLength : Dimension::kAngle, true},
        servo.target, servo.target_signal);
    visitor->Number({"stiffness", kNonNegative,
                     slides ? Dimension::kStiffness : Dimension::kAngularStiffness, true},
                    servo.stiffness);
    visitor->Number(
        {"damping", kNonNegative, slides ? Dimension::kLinearDamping : Dimension::kAngularDamping},
        servo.damping);
    visitor->Optional(
        {"limit", NumberKind::kPositive, slides ? Dimension::kForce : Dimension::kTorque},
        servo.limit);
  }
};

/// `turns`: whether the joint may start turned or moved (joint_graph.h).
template <typename Joint, typename Visitor>
void VisitJoint(Joint& joint, bool turns, Visitor* visitor) {
  constexpr NumberKind kFree = NumberKind::kFree;
  constexpr NumberKind kNonNegative = NumberKind::kNonNegative;
  const bool slides = joint.type == JointType::kPrismatic;
  visitor->Optional({"until", kFree, Dimension::kTime}, joint.until);
  if (joint.type == JointType::kCoupling) {
    visitor->Number({"ratio", kFree, Dimension::kNone, true}, joint.ratio);
    VisitLimits(joint, kFree, Dimension::kNone, visitor);
  } else if (joint.type == JointType::kDistance) {
    visitor->Anchors({"anchors", kFree, Dimension::kLength, true}, joint.anchors);
    VisitLimits(joint, kNonNegative, Dimension::kLength, visitor);
  } else if (joint.type != JointType::kFixedAngle) {
    visitor->Point({"anchor", kFree, Dimension::kLength, true}, joint.anchors[0]);
  }
  if (slides) visitor->Point({"axis", kFree, Dimension::kNone, true}, joint.axis);
  if (!slides && joint.type != JointType::kRevolute) return;
  const Dimension coordinate = slides ? Dimension::kLength : Dimension::kAngle;
  const Dimension speed = slides ? Dimension::kVelocity : Dimension::kAngularVelocity;
  const Dimension effort = slides ? Dimension::kForce : Dimension::kTorque;
  visitor->Number({slides ? "displacement" : "angle", kFree, coordinate, false, turns},
                  joint.angle);
  visitor->Number({"rate", kFree, speed, false, turns}, joint.rate);
  visitor->Number(
      {"damping", kNonNegative, slides ? Dimension::kLinearDamping : Dimension::kAngularDamping},
      joint.damping);
  VisitLimits(joint, kFree, coordinate, visitor);
  visitor->Optional({"friction", kNonNegative, effort}, joint.friction);
  visitor->Optional({"kinetic_friction", kNonNegative, effort, false, true, "friction",
                     joint.friction.has_value()},
                    joint.kinetic_friction);
  visitor->Number({"stribeck_speed", NumberKind::kPositive, speed, true, true, "kinetic_friction",
                   joint.kinetic_friction.has_value()},
                  joint.stribeck_speed);
  visitor->Part({"motor"}, joint.motor, [&](auto& motor, auto* fields) {
    fields->Number({"speed", kFree, speed, true}, motor.speed);
    fields->Number({"limit", kNonNegative, effort, true}, motor.limit);
  });
  visitor->Optional(
      {"stiffness", kNonNegative, slides ? Dimension::kStiffness : Dimension::kAngularStiffness},
      joint.stiffness);
  visitor->Number({slides ? "rest_displacement" : "rest_angle", kFree, coordinate, false, true,
                   "stiffness", joint.stiffness.has_value()},
                  joint.rest);
  visitor->NumberOrServo({"effort", kFree, effort}, joint.effort, joint.effort_signal,
                         joint.effort_servo, ServoFields{slides});
}

template <typename Spring, typename Visitor>
void VisitSpring(Spring& spring, Visitor* visitor) {
  constexpr NumberKind kNonNegative = NumberKind::kNonNegative;
  visitor->Anchors({"anchors", NumberKind::kFree, Dimension::kLength, true}, spring.anchors);
  visitor->Number({"stiffness", kNonNegative, Dimension::kStiffness, true}, spring.stiffness);
  visitor->Number({"damping", kNonNegative, Dimension::kLinearDamping}, spring.damping);
  visitor->Number({"rest_length", kNonNegative, Dimension::kLength, true}, spring.rest_length);
}

template <typename Force, typename Visitor>
void VisitForce(Force& force, Visitor* visitor) {
  constexpr NumberKind kFree = NumberKind::kFree;
  visitor->PointOrServos({"force", kFree, Dimension::kForce}, force.force, force.force_signal,
                         force.force_servos, ServoFields{true});
  visitor->NumberOrServo({"torque", kFree, Dimension::kTorque}, force.torque, force.torque_signal,
                         force.torque_servo, ServoFields{false});
  visitor->Point({"at", kFree, Dimension::kLength}, force.at);
  visitor->Optional({"start", kFree, Dimension::kTime}, force.start);
  visitor->Optional({"end", kFree, Dimension::kTime}, force.end);
}

template <typename Pair, typename Visitor>
void VisitPair(Pair& pair, Visitor* visitor) {
  visitor->Optional({"friction", NumberKind::kNonNegative}, pair.friction);
  visitor->Optional({"restitution", NumberKind::kFraction}, pair.restitution);
  VisitFurtherFriction(pair, visitor);
}

template <typename Settings, typename Visitor>
void VisitSettings(Settings& settings, Visitor* visitor) {
  constexpr NumberKind kPositive = NumberKind::kPositive;
  constexpr NumberKind kNonNegative = NumberKind::kNonNegative;
  constexpr int kMost = 1000000;
  visitor->Number({"dt", kPositive, Dimension::kTime}, settings.dt);
  visitor->Number({"duration", kNonNegative, Dimension::kTime}, settings.duration);
  visitor->Choice("stepping", kSteppingNames, settings.stepping);
  visitor->Choice("integrator", kIntegratorNames, settings.integrator);
  visitor->Choice("joint_correction", kJointCorrectionNames, settings.joint_correction);
  visitor->Number({"joint_tolerance", kPositive, Dimension::kLength}, settings.joint_tolerance);
  visitor->Choice("friction_mixing", kMixingNames, settings.friction_mixing);
  visitor->Choice("restitution_mixing", kMixingNames, settings.restitution_mixing);
  visitor->Choice("impact_law", kImpactLawNames, settings.impact_law);
  visitor->Number({"restitution_threshold", kNonNegative, Dimension::kVelocity},
                  settings.restitution_threshold);
  visitor->Number({"recovery_speed", kNonNegative, Dimension::kVelocity}, settings.recovery_speed);
  visitor->Number({"contact_margin", kNonNegative, Dimension::kLength}, settings.contact_margin);
  visitor->Count("max_events_per_step", 0, kMost, settings.max_events_per_step);
  visitor->Number({"lcp_tolerance", kPositive}, settings.lcp_tolerance);
  visitor->Count("lcp_max_iterations", 1, kMost, settings.lcp_max_iterations);
}

/// Keeps the keys alone, in order.
class FieldKeys {
 public:
  explicit FieldKeys(std::vector<std::string> keys = {}) : keys_(std::move(keys)) {}
  const std::vector<std::string>& keys() const { return keys_; }

  template <typename T>
  void Number(const Field& field, const T&) {
    Add(field.key);
  }
  template <typename T>
  void Optional(const Field& field, const T&) {
    Add(field.key);
  }
  template <typename V>
  void Point(const Field& field, const V&) {
    Add(field.key);
  }
  template <typename V>
  void Points(const Field& field, const V&) {
    Add(field.key);
  }
  template <typename V>
  void List(const Field& field, const V&) {
    Add(field.key);
  }
  template <typename V>
  void Anchors(const Field& field, const V&) {
    Add(field.key);
  }
  template <typename T>
  void Interval(const Field& field, const T&) {
    Add(field.key);
  }
  template <typename T>
  void Numbers(const Field& field, const T&, const T&) {
    Add(field.key);
  }
  template <typename T>
  void Vertices(const Field& field, const T&) {
    Add(field.key);
  }
  template <typename T, typename S>
  void NumberOrSignal(const Field& field, const T&, const S&) {
    Add(field.key);
  }
  template <typename T, typename Visit>
  void Part(const Field& field, const T&, const Visit&) {
    Add(field.key);
  }
  void Path(const std::shared_ptr<const RecordedPath>&) {
    for (const char* key : {"file", "interpolation", "time", "x", "y", "angle"}) Add(key);
  }
  template <typename V, typename S>
  void PointOrSignal(const Field& field, const V&, const S&) {
    Add(field.key);
  }
  template <typename T, typename S, typename Servo>
  void NumberOrServo(const Field& field, const T&, const S&, const Servo&, const ServoFields&) {
    Add(field.key);
  }
  template <typename V, typename S, typename Servos>
  void PointOrServos(const Field& field, const V&, const S&, const Servos&, const ServoFields&) {
    Add(field.key);
  }
  template <typename Table, typename Value>
  void Choice(const char* key, const Table&, const Value&) {
    Add(key);
  }
  void Count(const char* key, int, int, int) { Add(key); }

 private:
  void Add(const char* key) { keys_.emplace_back(key); }
  std::vector<std::string> keys_;
};

}  // namespace tangible
