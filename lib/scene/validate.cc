// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/validate.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/math/planar.h"
#include "tangible/scene/coupling.h"
#include "tangible/scene/joint_graph.h"
#include "tangible/scene/scene_fields.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/shape_json.h"
#include "tangible/scene/tolerances.h"

namespace tangible {
namespace {

// The visitor that checks the ranges of an item's numbers.
class RangeCheck {
 public:
  explicit RangeCheck(const JsonReader& item) : item_(item) {}

  void Number(const Field& field, double value) {
    if (field.present && field.parameter) Check(field.kind, value, [&] { return Place(field); });
  }
  void Optional(const Field& field, const std::optional<double>& value) {
    if (value) Number(field, *value);
  }
  void Point(const Field& field, const Vector2<double>& value) {
    if (field.parameter) CheckPoint(field, value, [&] { return Place(field); });
  }
  void Points(const Field& field, const std::vector<Vector2<double>>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      CheckPoint(field, values[i], [&] { return Place(field).At(static_cast<int>(i)); });
    }
  }
  void List(const Field& field, const std::vector<double>& values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      Check(field.kind, values[i], [&] { return Place(field).At(static_cast<int>(i)); });
    }
  }
  void Anchors(const Field& field, const Vector2<double> (&anchors)[2]) {
    for (int i = 0; i < 2; ++i) CheckPoint(field, anchors[i], [&] { return Place(field).At(i); });
  }
  void Interval(const Field& field, const std::optional<std::pair<double, double>>& value) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (!value) return;
    if (value->first != -kInfinity) {
      Check(field.kind, value->first, [&] { return Place(field).At(0); });
    }
    if (value->second != kInfinity) {
      Check(field.kind, value->second, [&] { return Place(field).At(1); });
    }
  }
  template <typename Item, typename Visit>
  void Part(const Field& field, const std::optional<Item>& item, const Visit& visit) {
    if (!item) return;
    const JsonReader place = Place(field);
    RangeCheck part(place);
    visit(*item, &part);
  }
  void Path(const std::shared_ptr<const RecordedPath>&) {}
  void Numbers(const Field& field, double first, double second) {
    Check(field.kind, first, [&] { return Place(field).At(0); });
    Check(field.kind, second, [&] { return Place(field).At(1); });
  }
  void Vertices(const Field& field, const std::vector<double>& numbers) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      Check(field.kind, numbers[i],
            [&] { return Place(field).At(static_cast<int>(i / 2)).At(static_cast<int>(i % 2)); });
    }
  }
  void NumberOrSignal(const Field& field, double value, const std::optional<Signal>& signal) {
    if (!signal) Number(field, value);
  }
  void PointOrSignal(const Field& field, const Vector2<double>& value,
                     const std::optional<Signal>& signal) {
    if (!signal) Point(field, value);
  }
  void NumberOrServo(const Field& field, double value, const std::optional<Signal>& signal,
                     const std::optional<BasicServo<double>>& servo, const ServoFields& visit) {
    if (servo) return Part(field, servo, visit);
    NumberOrSignal(field, value, signal);
  }
  void PointOrServos(const Field& field, const Vector2<double>& value,
                     const std::optional<Signal>& signal,
                     const std::optional<BasicServo<double>> (&servos)[2],
                     const ServoFields& visit) {
    PointOrSignal(field, value, signal);
    for (int i = 0; i < 2; ++i) {
      if (!servos[i]) continue;
      const JsonReader place = Place(field).At(i);
      RangeCheck part(place);
      visit(*servos[i], &part);
    }
  }

 private:
  JsonReader Place(const Field& field) const { return item_.At(field.key); }

  // Places are text, which is made where it is needed.
  template <typename PlaceOf>
  void CheckPoint(const Field& field, const Vector2<double>& value, const PlaceOf& place) {
    Check(field.kind, value.x(), [&] { return place().At(0); });
    Check(field.kind, value.y(), [&] { return place().At(1); });
  }
  template <typename PlaceOf>
  void Check(NumberKind kind, double value, const PlaceOf& place) {
    if (IsAllowed(kind, value)) return;
    place().FailExpected(Describe(kind), value);
  }

  const JsonReader& item_;
};

// What the fields alone do not tell of a recorded path, as a program may have made it too.
void CheckDrivenMotion(const BasicBody<double>& body, const JsonReader& place) {
  const auto& driven = *body.driven;
  if (body.motion != Motion::kKinematic) {
    place.Fail("expected a kinematic body, got one that is not");
  } else if (driven.path == nullptr) {
    place.At("file").Fail("missing, expected the file of a path");
  } else if (body.velocity != Vector2<double>(0.0, 0.0) || body.angular_velocity != 0.0) {
    place.Fail("expected no velocity or angular_velocity beside motion, which gives them");
  }
}

// What the fields alone do not tell of a support.
void CheckSupport(const BasicBody<double>& body, const JsonReader& place) {
  const BasicSupport<double>& support = *body.support;
  if (body.motion != Motion::kMoving) {
    place.Fail("expected a moving body, got a static or kinematic one");
  } else if (place.At("points").exists() && support.points.empty()) {
    place.At("points").FailExpected("an array of at least one point");
  } else if (support.radius && !support.points.empty()) {
    place.At("radius").FailExpected("none beside points (a body stands on points or on a disc)",
                                    *support.radius);
  } else if (support.points.empty() && !support.shares.empty()) {
    place.At("points").Fail("missing, expected an array of points with shares");
  } else if (!support.points.empty() && (place.At("shares").exists() || !support.shares.empty()) &&
             support.shares.size() != support.points.size()) {
    place.At("shares").Fail("expected " + std::to_string(support.points.size()) +
                            " numbers > 0, one for each point, got " +
                            std::to_string(support.shares.size()));
  }
}

}  // namespace

void CheckBody(const BasicBody<double>& body, const JsonReader& place) {
  const bool is_static = body.motion == Motion::kStatic;
  const bool moves = body.motion == Motion::kMoving;
  if (moves && (body.shape.type == ShapeType::kHalfPlane || IsTrack(body.shape.type))) {
    place.At("shape")
        .At(NameOf(body.shape.type, kShapeTypeNames))
        .Fail("expected a static or kinematic body, got a moving one");
  }
  if (moves && !body.inertia && body.shape.type == ShapeType::kNone) {
    place.At("inertia").Fail("missing, expected a number > 0 for a body without a shape");
  } else if (moves && !body.inertia && !IsCentred(body.shape)) {
    place.At("inertia").Fail(
        "missing, expected a number > 0 for a polygon whose centroid is not the origin");
  }
  if (body.driven) CheckDrivenMotion(body, place.At("motion"));
  if (body.support) CheckSupport(body, place.At("support"));
  if (is_static && body.velocity != Vector2<double>(0.0, 0.0)) {
    place.At("velocity").Fail("expected [0, 0] of a static body, got a velocity (kinematic moves)");
  }
  if (is_static && body.angular_velocity != 0.0) {
    place.At("angular_velocity")
        .FailExpected("0 of a static body (kinematic moves)", body.angular_velocity);
  }
}

void CheckPathOffsets(const BasicDrivenMotion<double>& driven, const JsonReader& place) {
  for (int i = 0; i < 2; ++i) {
    if (driven.path->Has(i) || driven.offset[i] == 0.0) continue;
    place.At("offset").At(i).FailExpected(std::string("0, for the path has no column ") +
                                              (i == 0 ? "x" : "y") +
                                              " (its coordinate is that of position)",
                                          driven.offset[i]);
  }
  if (!driven.path->Has(2) && driven.offset_angle != 0.0) {
    place.At("offset_angle")
        .FailExpected("0, for the path has no column angle (its angle is that of the body)",
                      driven.offset_angle);
  }
}

void CheckJoint(const BasicJoint<double>& joint, const JsonReader& place) {
  const double apart = (joint.anchors[0] - joint.anchors[1]).norm();
  if (joint.type == JointType::kDistance && !joint.limits && apart == 0.0) {
    place.At("anchors").Fail("expected two points apart, got a distance of 0");
  }
  if (joint.type == JointType::kPrismatic && joint.axis.norm() == 0.0) {
    place.At("axis").Fail("expected a direction, got the zero vector");
  }
  if (joint.type == JointType::kDistance && joint.limits && joint.limits->second == 0.0) {
    place.At("limits").At(1).FailExpected("a number > 0 (a revolute joint holds points together)",
                                          0.0);
  }
  if (joint.limits && joint.limits->first > joint.limits->second) {
    place.At("limits").Fail("expected [low, high] with low <= high, got [" +
                            Json(joint.limits->first).dump() + ", " +
                            Json(joint.limits->second).dump() + "]");
  }
}

void CheckFrictionDecay(const std::optional<double>& kinetic, double friction,
                        const JsonReader& place) {
  if (!kinetic || *kinetic <= friction) return;
  place.At("kinetic_friction")
      .FailExpected("a number <= friction, which is " + Json(friction).dump(), *kinetic);
}

void CheckRopes(const Scene& scene, const JsonReader& joints) {
  // Where joints start turned or moved, anchors are not yet where the run starts.
  for (const BasicJoint<double>& joint : scene.joints) {
    if (joint.angle != 0.0) return;
  }
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const BasicJoint<double>& joint = scene.joints[i];
    if (joint.type != JointType::kDistance || !joint.limits) continue;
    const double apart = (joint.anchors[0] - joint.anchors[1]).norm();
    const double rounding = kRopeRounding * apart;
    if (apart < joint.limits->first - rounding || apart > joint.limits->second + rounding) {
      joints.At(static_cast<int>(i))
          .At("anchors")
          .Fail("expected points whose distance is within the limits, got " + Json(apart).dump());
    }
  }
}

void CheckCouplings(const Scene& scene, const JsonReader& joints) {
  const auto names_a_joint = [&scene](int joint) {
    return joint >= 0 && joint < static_cast<int>(scene.joints.size());
  };
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const BasicJoint<double>& joint = scene.joints[i];
    if (joint.type != JointType::kCoupling) continue;
    const JsonReader place = joints.At(static_cast<int>(i)).At("joints");
    if (!names_a_joint(joint.coupled[0]) || !names_a_joint(joint.coupled[1])) {
      return place.Fail("expected two joints of the scene, got one that it does not have");
    }
    if (joint.coupled[0] == joint.coupled[1]) {
      return place.Fail("expected two different joints, got " +
                        scene.joints[joint.coupled[0]].name + " twice");
    }
    const std::string fault = EndsOf(scene, joint).fault;
    if (!fault.empty()) return place.Fail(fault);
  }
}

namespace {

// The sum of terms, and of their magnitudes.
struct RateSum {
  double sum = 0.0, size = 0.0;
  void Add(double term) {
    sum += term;
    size += std::abs(term);
  }
};

// The terms of a body's velocity at a point of the plane along a direction: as drawn.
void AddDrawn(const Scene& scene, int body, const Vector2<double>& along,
              const Vector2<double>& point, double factor, RateSum* rates) {
  if (body < 0) return;
  const BasicBody<double>& of = scene.bodies[body];
  rates->Add(factor * along.dot(of.velocity));
  rates->Add(factor * of.angular_velocity * along.dot(Perp(Vector2<double>(point - of.position))));
}

// The terms that the rates of joints add to it, in a scene whose joints start as drawn.
void AddTurned(const Scene& scene, int body, const Vector2<double>& along,
               const Vector2<double>& point, double factor, RateSum* rates) {
  if (body < 0) return;
  const std::vector<JointPlace> places = ClassifyJoints(scene);
  for (std::size_t k = 0; k < scene.joints.size(); ++k) {
    const BasicJoint<double>& joint = scene.joints[k];
    const bool has_rate = joint.rate != 0.0 && places[k] == JointPlace::kTree;
    if (!has_rate || !SubtreeOfJoint(scene, static_cast<int>(k))[body]) continue;
    const double speed = joint.type == JointType::kPrismatic
                             ? along.dot(joint.axis) / joint.axis.norm()
                             : along.dot(Perp(Vector2<double>(point - joint.anchors[0])));
    rates->Add(factor * joint.rate * speed);
  }
}

// The terms of the rate of a joint's coordinate at time 0, times a factor. Rates of other joints
// change the distance of a rope's ends, but not the coordinate of a hinge or slider.
void AddCoordinateRate(const Scene& scene, const BasicJoint<double>& joint, double factor,
                       RateSum* rates) {
  const auto& [a, b] = joint.bodies;
  if (joint.type == JointType::kRevolute) {
    rates->Add(factor * joint.rate);
    if (a >= 0) rates->Add(factor * scene.bodies[a].angular_velocity);
    if (b >= 0) rates->Add(-factor * scene.bodies[b].angular_velocity);
  } else if (joint.type == JointType::kPrismatic) {
    const Vector2<double> axis = joint.axis / joint.axis.norm();
    rates->Add(factor * joint.rate);
    AddDrawn(scene, a, axis, joint.anchors[0], factor, rates);
    AddDrawn(scene, b, axis, joint.anchors[0], -factor, rates);
  } else {
    const Vector2<double> apart = joint.anchors[0] - joint.anchors[1];
    const double length = apart.norm();
    const Vector2<double> along = length > 0.0 ? apart / length : Vector2<double>(1.0, 0.0);
    AddDrawn(scene, a, along, joint.anchors[0], factor, rates);
    AddDrawn(scene, b, along, joint.anchors[1], -factor, rates);
    AddTurned(scene, a, along, joint.anchors[0], factor, rates);
    AddTurned(scene, b, along, joint.anchors[1], -factor, rates);
  }
}

}  // namespace

void CheckCoupledRates(const Scene& scene, const JsonReader& joints) {
  const bool is_turned = std::any_of(scene.joints.begin(), scene.joints.end(),
                                     [](const auto& joint) { return joint.angle != 0.0; });
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const BasicJoint<double>& coupling = scene.joints[i];
    if (coupling.type != JointType::kCoupling || coupling.limits) continue;
    RateSum rates;
    bool is_known = true;
    for (int k = 0; k < 2; ++k) {
      const BasicJoint<double>& joint = scene.joints[coupling.coupled[k]];
      // Where joints start turned, the anchors of a rope are not yet where the run starts.
      is_known = is_known && !(is_turned && joint.type == JointType::kDistance);
      for (const int body : joint.bodies) {
        is_known = is_known && (body < 0 || !scene.bodies[body].driven);
      }
      AddCoordinateRate(scene, joint, k == 0 ? 1.0 : coupling.ratio, &rates);
    }
    if (!is_known || std::abs(rates.sum) <= kCoupledRates * rates.size) continue;
    joints.At(static_cast<int>(i))
        .Fail("expected initial rates with rate(" + scene.joints[coupling.coupled[0]].name +
              ") + ratio * rate(" + scene.joints[coupling.coupled[1]].name + ") = 0, got " +
              Json(rates.sum).dump());
    return;
  }
}

std::string CoupledRatesFault(const Scene& scene, const std::string& name) {
  JsonErrors errors(name);
  CheckCoupledRates(scene, JsonReader::Nothing(&errors).At("joints"));
  return errors.message();
}

void CheckForce(const BasicForce<double>& force, const JsonReader& place) {
  if (force.start && force.end && *force.start > *force.end) {
    place.At("end").FailExpected("a number >= start, which is " + Json(*force.start).dump(),
                                 *force.end);
  }
}

void CheckSettings(const SimulationSettings& settings, const JsonReader& place) {
  if (settings.duration / settings.dt > kMaxSteps) {
    place.Fail("expected at most 1e9 steps, got duration / dt = " + Json(settings.duration).dump() +
               " / " + Json(settings.dt).dump());
  }
}

void CheckInitialAngles(const Scene& scene, const JsonReader& joints) {
  const std::vector<JointPlace> places = ClassifyJoints(scene);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const BasicJoint<double>& joint = scene.joints[i];
    if (places[i] == JointPlace::kTree || (joint.angle == 0.0 && joint.rate == 0.0)) continue;
    const char* const angle = joint.type == JointType::kPrismatic ? "displacement" : "angle";
    const bool turned = joint.angle != 0.0;
    joints.At(static_cast<int>(i))
        .At(turned ? angle : "rate")
        .FailExpected(places[i] == JointPlace::kLoop
                          ? "0 of a joint in a closed loop (write the bodies' poses and twists)"
                          : "0 of a joint whose bodies[0] side is attached to the world or to a "
                            "static or kinematic body (swap the two bodies)",
                      turned ? joint.angle : joint.rate);
  }
}

std::string Validate(const Scene& scene, const std::string& name) {
  JsonErrors errors(name);
  const JsonReader root = JsonReader::Nothing(&errors);
  const auto each = [&](const char* list, const auto& items, const auto& check) {
    const JsonReader place = root.At(list);
    for (std::size_t i = 0; i < items.size() && errors.ok(); ++i) {
      const JsonReader item = place.At(static_cast<int>(i));
      RangeCheck ranges(item);
      check(items[i], item, &ranges);
    }
  };
  RangeCheck(root).Point(kGravityField, scene.gravity);
  each("bodies", scene.bodies, [](const auto& body, const JsonReader& item, RangeCheck* ranges) {
    if (body.shape.type != ShapeType::kNone) {
      const JsonReader shape = item.At("shape");
      const JsonReader numbers = shape.At(NameOf(body.shape.type, kShapeTypeNames));
      RangeCheck of_shape(numbers);
      VisitShape(body.shape, &of_shape);
      if (item.ok()) CheckShape(body.shape, shape);
    }
    VisitContactPoints(body, ranges);
    VisitBody(body, ranges);
    if (item.ok()) CheckBody(body, item);
  });
  each("joints", scene.joints, [](const auto& joint, const JsonReader& item, RangeCheck* ranges) {
    VisitJoint(joint, true, ranges);
    CheckJoint(joint, item);
  });
  if (errors.ok()) CheckInitialAngles(scene, root.At("joints"));
  if (errors.ok()) CheckCouplings(scene, root.At("joints"));
  each("springs", scene.springs, [](const auto& spring, const JsonReader&, RangeCheck* ranges) {
    VisitSpring(spring, ranges);
  });
  each("forces", scene.forces, [](const auto& force, const JsonReader& item, RangeCheck* ranges) {
    VisitForce(force, ranges);
    CheckForce(force, item);
  });
  each("pairs", scene.pairs,
       [](const auto& pair, const JsonReader&, RangeCheck* ranges) { VisitPair(pair, ranges); });
  if (errors.ok()) CheckSettings(scene.simulation, root.At("simulation"));
  return errors.message();
}

}  // namespace tangible
