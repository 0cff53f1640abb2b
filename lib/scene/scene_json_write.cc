// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/scene/json_writer.h"
#include "tangible/scene/scene_fields.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

OrderedJson PointJson(const Vector2<double>& point) {
  return OrderedJson::array({point.x(), point.y()});
}

OrderedJson SignalJson(const Signal& signal) {
  OrderedJson json = OrderedJson::object();
  if (!signal.file.empty()) {
    json["file"] = signal.file;
  } else {
    json["time"] = signal.time;
    if (!signal.x.empty()) json["x"] = signal.x;
    if (!signal.y.empty()) json["y"] = signal.y;
    if (!signal.value.empty()) json["value"] = signal.value;
  }
  json["interpolation"] = NameOf(signal.interpolation, kInterpolationNames);
  return json;
}

// Writes the fields of an item. A number that is no parameter and outside its range is that of an
// absent key: the mass of a body that does not move.
class FieldWriter {
 public:
  explicit FieldWriter(OrderedJson* json) : json_(*json) {}

  void Number(const Field& field, double value) {
    const bool is_absent = !field.parameter && !IsAllowed(field.kind, value);
    if (field.present && !is_absent) json_[field.key] = value;
  }
  void Optional(const Field& field, const std::optional<double>& value) {
    if (value) json_[field.key] = *value;
  }
  void Point(const Field& field, const Vector2<double>& value) {
    if (!field.present) return;
    json_[field.key] = PointJson(value);
  }
  void Points(const Field& field, const std::vector<Vector2<double>>& values) {
    for (const Vector2<double>& value : values) json_[field.key].push_back(PointJson(value));
  }
  void List(const Field& field, const std::vector<double>& values) {
    for (const double value : values) json_[field.key].push_back(value);
  }
  void Anchors(const Field& field, const Vector2<double> (&anchors)[2]) {
    json_[field.key] = OrderedJson::array({PointJson(anchors[0]), PointJson(anchors[1])});
  }
  void Interval(const Field& field, const std::optional<std::pair<double, double>>& value) {
    if (value) Numbers(field, value->first, value->second);
  }
  // JSON has no infinity: a bound that limits nothing is written as null.
  void Numbers(const Field& field, double first, double second) {
    json_[field.key] = OrderedJson::array({first, second});
  }
  void Vertices(const Field& field, const std::vector<double>& numbers) {
    for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) {
      json_[field.key].push_back(OrderedJson::array({numbers[i], numbers[i + 1]}));
    }
  }
  void NumberOrSignal(const Field& field, double value, const std::optional<Signal>& signal) {
    json_[field.key] = signal ? SignalJson(*signal) : OrderedJson(value);
  }
  void PointOrSignal(const Field& field, const Vector2<double>& value,
                     const std::optional<Signal>& signal) {
    json_[field.key] = signal ? SignalJson(*signal) : PointJson(value);
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
      OrderedJson servo = OrderedJson::object();
      FieldWriter part(&servo);
      visit(*servos[i], &part);
      json_[field.key][static_cast<std::size_t>(i)] = servo;
    }
  }
  template <typename Item, typename Visit>
  void Part(const Field& field, const std::optional<Item>& item, const Visit& visit) {
    if (!item) return;
    FieldWriter part(&json_[field.key]);
    visit(*item, &part);
  }
  void Path(const std::shared_ptr<const RecordedPath>& path) {
    const PathSeries& series = path->series();
    if (!series.file.empty()) {
      json_["file"] = series.file;
    } else {
      json_["time"] = series.time;
      if (!series.x.empty()) json_["x"] = series.x;
      if (!series.y.empty()) json_["y"] = series.y;
      if (!series.angle.empty()) json_["angle"] = series.angle;
    }
    Choice("interpolation", kPathInterpolationNames, series.interpolation);
  }
  template <typename Enum, std::size_t N>
  void Choice(const char* key, const std::pair<const char*, Enum> (&table)[N], Enum value) {
    json_[key] = NameOf(value, table);
  }
  // A setting that is not set is not written, so that it follows the stepping when the file is
  // read.
  template <typename Enum, std::size_t N>
  void Choice(const char* key, const std::pair<const char*, Enum> (&table)[N],
              const std::optional<Enum>& value) {
    if (value) Choice(key, table, *value);
  }
  void Count(const char* key, int /*low*/, int /*high*/, int value) { json_[key] = value; }

 private:
  OrderedJson& json_;
};

OrderedJson BodyJson(const BasicBody<double>& body) {
  OrderedJson json = OrderedJson::object();
  json["name"] = body.name;
  if (body.motion == Motion::kStatic) json["static"] = true;
  if (body.motion == Motion::kKinematic) json["kinematic"] = true;
  if (body.shape.type != ShapeType::kNone) {
    OrderedJson* const item = &json["shape"][NameOf(body.shape.type, kShapeTypeNames)];
    FieldWriter shape(item);
    VisitShape(body.shape, &shape);
    if (IsTrack(body.shape.type)) {
      (*item)["closed"] = body.shape.closed;
      shape.Choice("solid", kSolidSideNames, body.shape.solid);
    }
  }
  FieldWriter writer(&json);
  VisitContactPoints(body, &writer);
  VisitBody(body, &writer);
  return json;
}

class SceneWriter {
 public:
  explicit SceneWriter(const Scene& scene) : scene_(scene) {}

  OrderedJson Write() const {
    OrderedJson json = OrderedJson::object();
    json["name"] = scene_.name;
    FieldWriter(&json).Point(kGravityField, scene_.gravity);
    json["bodies"] = OrderedJson::array();
    for (const auto& body : scene_.bodies) json["bodies"].push_back(BodyJson(body));
    for (const auto& joint : scene_.joints) {
      OrderedJson item = {{"name", joint.name}, {"type", NameOf(joint.type, kJointTypeNames)}};
      if (joint.type == JointType::kCoupling) {
        item["joints"] = {scene_.joints[joint.coupled[0]].name,
                          scene_.joints[joint.coupled[1]].name};
      } else {
        item["bodies"] = EndsJson(joint.bodies);
      }
      FieldWriter writer(&item);
      VisitJoint(joint, true, &writer);
      item["contact"] = joint.contact;
      json["joints"].push_back(item);
    }
    for (const auto& spring : scene_.springs) {
      OrderedJson item = {{"name", spring.name}, {"bodies", EndsJson(spring.bodies)}};
      FieldWriter writer(&item);
      VisitSpring(spring, &writer);
      json["springs"].push_back(item);
    }
    for (const auto& force : scene_.forces) {
      OrderedJson item = {{"name", force.name}, {"body", BodyName(force.body)}};
      FieldWriter writer(&item);
      VisitForce(force, &writer);
      json["forces"].push_back(item);
    }
    for (const auto& pair : scene_.pairs) {
      OrderedJson item = {{"bodies", {pair.bodies[0], pair.bodies[1]}}};
      FieldWriter writer(&item);
      VisitPair(pair, &writer);
      json["pairs"].push_back(item);
    }
    for (const auto& [first, second] : scene_.no_contact) {
      json["no_contact"].push_back(OrderedJson::array({first, second}));
    }
    FieldWriter settings(&json["simulation"]);
    VisitSettings(scene_.simulation, &settings);
    return json;
  }

 private:
  std::string BodyName(int body) const { return body < 0 ? "world" : scene_.bodies[body].name; }

  OrderedJson EndsJson(const int (&bodies)[2]) const {
    return OrderedJson::array({BodyName(bodies[0]), BodyName(bodies[1])});
  }

  const Scene& scene_;
};

}  // namespace

std::string SceneToJson(const Scene& scene) { return JsonText(SceneWriter(scene).Write()); }

std::string SceneWithSignalsToJson(Scene scene) {
  for (auto& body : scene.bodies) {
    if (!body.driven) continue;
    PathSeries series = body.driven->path->series();
    series.file.clear();
    body.driven->path = std::make_shared<const RecordedPath>(std::move(series));
  }
  const auto whole = [](std::optional<BasicServo<double>>* servo) {
    if (*servo && (*servo)->target_signal) (*servo)->target_signal->file.clear();
  };
  for (auto& joint : scene.joints) {
    if (joint.effort_signal) joint.effort_signal->file.clear();
    whole(&joint.effort_servo);
  }
  for (auto& force : scene.forces) {
    if (force.force_signal) force.force_signal->file.clear();
    if (force.torque_signal) force.torque_signal->file.clear();
    for (auto& servo : force.force_servos) whole(&servo);
    whole(&force.torque_servo);
  }
  return SceneToJson(scene);
}

}  // namespace tangible
