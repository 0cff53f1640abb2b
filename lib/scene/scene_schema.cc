// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/scene_schema.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/scene/json_schema.h"
#include "tangible/scene/scene_fields.h"
#include "tangible/scene/scene_names.h"

namespace tangible {
namespace {

OrderedJson SignalSchema() {
  return SchemaOfObject(
      {{"file", SchemaOfText()}, {"interpolation", SchemaOfWords(WordsOf(kInterpolationNames))}},
      {"file"});
}

// A signal whose series stands in the scene: `time` and these columns.
OrderedJson SeriesSchema(const std::vector<std::string>& columns,
                         const std::vector<std::string>& required) {
  const OrderedJson numbers = SchemaOfArray(SchemaOfNumber(NumberKind::kFree), 1);
  OrderedJson properties = {{"time", numbers},
                            {"interpolation", SchemaOfWords(WordsOf(kInterpolationNames))}};
  for (const std::string& column : columns) properties[column] = numbers;
  return SchemaOfObject(properties, required);
}

// The visitor that describes the fields of an item.
class FieldSchema {
 public:
  template <typename T>
  void Number(const Field& field, const T&) {
    Add(field, NumberSchema(field));
  }
  template <typename T>
  void Optional(const Field& field, const T&) {
    Add(field, NumberSchema(field));
  }
  template <typename V>
  void Point(const Field& field, const V&) {
    Add(field, PointSchema(field));
  }
  template <typename V>
  void Points(const Field& field, const V&) {
    Add(field, SchemaOfArray(PointSchema(field), 0));
  }
  template <typename V>
  void List(const Field& field, const V&) {
    Add(field, SchemaOfArray(NumberSchema(field), 1));
  }
  template <typename V>
  void Anchors(const Field& field, const V&) {
    Add(field, SchemaOfArray(PointSchema(field), 2, 2));
  }
  template <typename T>
  void Interval(const Field& field, const T&) {
    Add(field, SchemaOfArray(SchemaOfAny({NumberSchema(field), SchemaOfNull()}), 2, 2));
  }
  template <typename Item, typename Visit>
  void Part(const Field& field, const std::optional<Item>&, const Visit& visit) {
    FieldSchema fields;
    Item item;
    visit(item, &fields);
    Add(field, fields.Item(OrderedJson::object(), {}));
  }
  void Path(const std::shared_ptr<const RecordedPath>&) {
    properties_["file"] = SchemaOfText();
    properties_["interpolation"] = SchemaOfWords(WordsOf(kPathInterpolationNames));
    for (const char* column : {"time", "x", "y", "angle"}) {
      properties_[column] = SchemaOfArray(SchemaOfNumber(NumberKind::kFree), 1);
    }
  }
  template <typename T>
  void Numbers(const Field& field, const T&, const T&) {
    Add(field, PointSchema(field));
  }
  template <typename T>
  void Vertices(const Field& field, const T&) {
    Add(field, SchemaOfArray(PointSchema(field), field.least));
  }
  template <typename T, typename S>
  void NumberOrSignal(const Field& field, const T&, const S&) {
    Add(field, SchemaOfAny({NumberSchema(field), SignalSchema(),
                            SeriesSchema({"value"}, {"time", "value"})}));
  }
  template <typename V, typename S>
  void PointOrSignal(const Field& field, const V&, const S&) {
    Add(field,
        SchemaOfAny({PointSchema(field), SignalSchema(), SeriesSchema({"x", "y"}, {"time"})}));
  }
  template <typename T, typename S, typename Servo>
  void NumberOrServo(const Field& field, const T&, const S&, const std::optional<Servo>&,
                     const ServoFields& visit) {
    Add(field, SchemaOfAny({NumberSchema(field), SignalSchema(),
                            SeriesSchema({"value"}, {"time", "value"}), ServoSchema(visit)}));
  }
  template <typename V, typename S, typename Servos>
  void PointOrServos(const Field& field, const V&, const S&, const Servos&,
                     const ServoFields& visit) {
    const OrderedJson component = SchemaOfAny({NumberSchema(field), ServoSchema(visit)});
    Add(field, SchemaOfAny({SchemaOfArray(component, 2, 2), SignalSchema(),
                            SeriesSchema({"x", "y"}, {"time"})}));
  }
  template <typename Table, typename Value>
  void Choice(const char* key, const Table& table, const Value&) {
    properties_[key] = SchemaOfWords(WordsOf(table));
  }
  void Count(const char* key, int low, int high, int) {
    properties_[key] = SchemaOfInteger(low, high);
  }

  const OrderedJson& properties() const { return properties_; }
  const std::vector<std::string>& required() const { return required_; }
  const OrderedJson& needs() const { return needs_; }

  // The item with other properties before these.
  OrderedJson Item(OrderedJson properties, std::vector<std::string> required) const {
    properties.update(properties_);
    required.insert(required.end(), required_.begin(), required_.end());
    OrderedJson schema = SchemaOfObject(std::move(properties), required);
    if (!needs_.empty()) schema["dependentRequired"] = needs_;
    return schema;
  }

 private:
  static OrderedJson NumberSchema(const Field& field) {
    return SchemaOfNumber(field.kind, UnitOf(field.dimension));
  }
  static OrderedJson ServoSchema(const ServoFields& visit) {
    FieldSchema fields;
    BasicServo<double> servo;
    visit(servo, &fields);
    return fields.Item(OrderedJson::object(), {});
  }
  static OrderedJson PointSchema(const Field& field) {
    return SchemaOfArray(NumberSchema(field), 2, 2);
  }

  void Add(const Field& field, OrderedJson schema) {
    properties_[field.key] = std::move(schema);
    if (field.with != nullptr) {
      needs_[field.key].push_back(field.with);
      if (field.required) needs_[field.with].push_back(field.key);
    } else if (field.required) {
      required_.emplace_back(field.key);
    }
  }

  OrderedJson properties_ = OrderedJson::object();
  std::vector<std::string> required_;
  OrderedJson needs_ = OrderedJson::object();
};

OrderedJson ShapeSchema() {
  OrderedJson shapes = OrderedJson::object();
  for (const auto& [name, type] : kShapeTypeNames) {
    const BasicShape<double> shape{type, std::vector<double>(NumNumbers(type))};
    FieldSchema fields;
    VisitShape(shape, &fields);
    OrderedJson flags = OrderedJson::object();
    if (IsTrack(type)) {
      flags = {{"closed", SchemaOfFlag()}, {"solid", SchemaOfWords(WordsOf(kSolidSideNames))}};
    }
    shapes[name] = fields.Item(std::move(flags), {});
  }
  OrderedJson schema = SchemaOfObject(std::move(shapes), {});
  schema["minProperties"] = 1;
  schema["maxProperties"] = 1;
  return schema;
}

OrderedJson BodySchema() {
  BasicBody<double> body;
  FieldSchema moving;
  VisitContactPoints(body, &moving);
  VisitBody(body, &moving);
  OrderedJson schema = moving.Item({{"name", SchemaOfName()},
                                    {"static", SchemaOfFlag()},
                                    {"kinematic", SchemaOfFlag()},
                                    {"shape", ShapeSchema()}},
                                   {"name"});
  // What only moving bodies need.
  schema["required"] = {"name"};
  const auto is_true = [](const char* key) {
    return OrderedJson{{"properties", {{key, {{"const", true}}}}}, {"required", {key}}};
  };
  schema["if"] = {{"anyOf", OrderedJson::array({is_true("static"), is_true("kinematic")})}};
  schema["then"] = OrderedJson::object();
  schema["else"] = {{"required", moving.required()}};
  // The path gives the velocities too; it is a file, or a series in the scene.
  const auto has = [](const char* key) { return OrderedJson{{"required", {key}}}; };
  schema["dependentSchemas"]["motion"] = {
      {"not", {{"anyOf", OrderedJson::array({has("velocity"), has("angular_velocity")})}}}};
  schema["properties"]["motion"]["oneOf"] = OrderedJson::array({has("file"), has("time")});
  OrderedJson& support = schema["properties"]["support"];
  support["properties"]["points"]["minItems"] = 1;
  support["not"] = {{"required", {"points", "radius"}}};
  return schema;
}

OrderedJson EndsSchema() { return SchemaOfArray(SchemaOfName(), 2, 2); }

OrderedJson JointSchema() {
  OrderedJson types = OrderedJson::array();
  for (const auto& [name, type] : kJointTypeNames) {
    BasicJoint<double> joint;
    joint.type = type;
    FieldSchema fields;
    VisitJoint(joint, true, &fields);
    const char* const ends = type == JointType::kCoupling ? "joints" : "bodies";
    types.push_back(fields.Item({{"name", SchemaOfName()},
                                 {"type", {{"const", name}}},
                                 {ends, EndsSchema()},
                                 {"contact", SchemaOfFlag()}},
                                {"name", "type", ends}));
  }
  return {{"type", "object"}, {"oneOf", types}};
}

template <typename Item, typename Visit>
OrderedJson ItemSchema(OrderedJson properties, const std::vector<std::string>& required,
                       const Visit& visit) {
  Item item;
  FieldSchema fields;
  visit(item, &fields);
  return fields.Item(std::move(properties), required);
}

}  // namespace

OrderedJson SceneSchema() {
  const OrderedJson patterns = SchemaOfArray(SchemaOfName("*"), 2, 2);
  FieldSchema scene;
  scene.Point(kGravityField, Vector2<double>());
  OrderedJson properties = {{"name", SchemaOfText()}};
  properties.update(scene.properties());
  properties["bodies"] = SchemaOfArray(BodySchema(), 0);
  properties["joints"] = SchemaOfArray(JointSchema(), 0);
  properties["springs"] =
      SchemaOfArray(ItemSchema<BasicSpring<double>>(
                        {{"name", SchemaOfName()}, {"bodies", EndsSchema()}}, {"name", "bodies"},
                        [](auto& item, auto* visitor) { VisitSpring(item, visitor); }),
                    0);
  properties["forces"] =
      SchemaOfArray(ItemSchema<BasicForce<double>>(
                        {{"name", SchemaOfName()}, {"body", SchemaOfName()}}, {"name", "body"},
                        [](auto& item, auto* visitor) { VisitForce(item, visitor); }),
                    0);
  properties["pairs"] = SchemaOfArray(
      ItemSchema<BasicPair<double>>({{"bodies", patterns}}, {"bodies"},
                                    [](auto& item, auto* visitor) { VisitPair(item, visitor); }),
      0);
  properties["no_contact"] = SchemaOfArray(patterns, 0);
  properties["simulation"] = ItemSchema<SimulationSettings>(
      OrderedJson::object(), {}, [](auto& item, auto* visitor) { VisitSettings(item, visitor); });
  return SchemaOfFile("a scene", SchemaOfObject(std::move(properties), {"bodies"}));
}

}  // namespace tangible
