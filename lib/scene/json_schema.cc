// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/json_schema.h"

#include <utility>

namespace tangible {

OrderedJson SchemaOfNumber(NumberKind kind, const std::string& unit) {
  OrderedJson schema = {{"type", "number"}};
  if (kind == NumberKind::kPositive) schema["exclusiveMinimum"] = 0;
  if (kind == NumberKind::kNonNegative || kind == NumberKind::kFraction) schema["minimum"] = 0;
  if (kind == NumberKind::kFraction) schema["maximum"] = 1;
  if (!unit.empty()) schema["description"] = unit;
  return schema;
}

OrderedJson SchemaOfInteger(int least, int most) {
  return {{"type", "integer"}, {"minimum", least}, {"maximum", most}};
}

OrderedJson SchemaOfArray(OrderedJson items, int least, int most) {
  OrderedJson schema = {{"type", "array"}, {"items", std::move(items)}, {"minItems", least}};
  if (most > 0) schema["maxItems"] = most;
  return schema;
}

OrderedJson SchemaOfObject(OrderedJson properties, const std::vector<std::string>& required) {
  OrderedJson schema = {
      {"type", "object"}, {"properties", std::move(properties)}, {"additionalProperties", false}};
  if (!required.empty()) schema["required"] = required;
  return schema;
}

OrderedJson SchemaByName(OrderedJson item) {
  return {{"type", "object"},
          {"propertyNames", SchemaOfName()},
          {"additionalProperties", std::move(item)}};
}

OrderedJson SchemaOfName(const std::string& also) {
  return {{"type", "string"}, {"pattern", "^[A-Za-z0-9_." + also + "-]+$"}};
}

OrderedJson SchemaOfWords(const std::vector<std::string>& words) { return {{"enum", words}}; }

OrderedJson SchemaOfAny(std::initializer_list<OrderedJson> schemas) {
  OrderedJson list = OrderedJson::array();
  for (const OrderedJson& schema : schemas) list.push_back(schema);
  return {{"anyOf", list}};
}

OrderedJson SchemaOfPoint(const std::string& unit) {
  return SchemaOfArray(SchemaOfNumber(NumberKind::kFree, unit), 2, 2);
}

OrderedJson SchemaOfFile(const std::string& title, const OrderedJson& schema) {
  OrderedJson file = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                      {"title", title + " of Tangible"}};
  file.update(schema);
  return file;
}

}  // namespace tangible
