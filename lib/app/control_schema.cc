// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/control_schema.h"

#include "tangible/scene/json_schema.h"

namespace tangible {
namespace {

constexpr int kMost = 1000000;

OrderedJson ControlSchemaOfOne() {
  const OrderedJson number = SchemaOfNumber(NumberKind::kFree);
  return SchemaOfObject(
      {{"path", SchemaOfText()}, {"low", number}, {"high", number}, {"initial", number}}, {"path"});
}

OrderedJson TermSchema() {
  OrderedJson schema = SchemaOfObject(
      {{"state", SchemaOfText()},
       {"point", SchemaOfObject({{"body", SchemaOfName()}, {"at", SchemaOfPoint("m")}}, {"body"})},
       {"control", SchemaOfText()},
       {"target", SchemaOfAny({SchemaOfNumber(NumberKind::kFree), SchemaOfPoint("m")})},
       {"weight", SchemaOfNumber(NumberKind::kNonNegative)},
       {"at", SchemaOfWords({"steps", "end"})},
       {"wrap", SchemaOfFlag()}},
      {});
  schema["oneOf"] = OrderedJson::array({{{"required", {"state"}}},
                                        {{"required", {"point", "target"}}},
                                        {{"required", {"control"}}}});
  return schema;
}

OrderedJson ObservationsSchema() {
  OrderedJson sensor = SchemaOfObject(
      {{"state", SchemaOfText()},
       {"point", SchemaOfObject({{"body", SchemaOfName()}, {"at", SchemaOfPoint("m")}}, {"body"})},
       {"sigma", SchemaOfNumber(NumberKind::kPositive)}},
      {"sigma"});
  sensor["oneOf"] = OrderedJson::array({{{"required", {"state"}}}, {{"required", {"point"}}}});
  return SchemaOfObject({{"sensors", SchemaOfArray(sensor, 1)},
                         {"every", SchemaOfInteger(1, kMost)},
                         {"seed", SchemaOfInteger(0, 1000000000)},
                         {"initial_sigma", SchemaOfNumber(NumberKind::kNonNegative)},
                         {"acceleration_sigma", SchemaOfNumber(NumberKind::kNonNegative)}},
                        {"sensors"});
}

}  // namespace

OrderedJson ControlSchema() {
  const OrderedJson positive = SchemaOfNumber(NumberKind::kPositive);
  const OrderedJson seed = SchemaOfInteger(0, 1000000000);
  const OrderedJson seconds = SchemaOfNumber(NumberKind::kPositive, "s");
  return SchemaOfFile(
      "a control problem",
      SchemaOfObject(
          {{"name", SchemaOfText()},
           {"scene", SchemaOfText()},
           {"controls", SchemaOfArray(ControlSchemaOfOne(), 1)},
           {"cost", SchemaOfArray(TermSchema(), 1)},
           {"horizon", seconds},
           {"max_iterations", SchemaOfInteger(1, kMost)},
           {"gradient_tolerance", positive},
           {"second_order", SchemaOfAny({SchemaOfFlag(), SchemaOfWords({"secants"})})},
           {"reference_extension", SchemaOfFlag()},
           {"surrogate",
            SchemaOfObject(
                {{"samples", SchemaOfInteger(2, kMost)}, {"deviation", positive}, {"seed", seed}},
                {"samples"})},
           {"starts", SchemaOfAny({SchemaOfInteger(1, kMostStarts),
                                   SchemaOfObject({{"count", SchemaOfInteger(1, kMostStarts)},
                                                   {"pieces", SchemaOfInteger(1, kMost)},
                                                   {"seed", seed}},
                                                  {"count"})})},
           {"sampling", SchemaOfObject({{"method", SchemaOfWords({"cross_entropy", "mppi"})},
                                        {"samples", SchemaOfInteger(2, 100000)},
                                        {"iterations", SchemaOfInteger(1, 10000)},
                                        {"seed", seed}},
                                       {"method"})},
           {"initial", SchemaOfObject({{"file", SchemaOfText()}}, {"file"})},
           {"mpc", SchemaOfObject({{"duration", seconds},
                                   {"horizon", seconds},
                                   {"iterations", SchemaOfInteger(1, kMost)},
                                   {"observations", ObservationsSchema()}},
                                  {"duration", "horizon"})}},
          {"scene", "controls", "cost"}));
}

}  // namespace tangible
