// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/fit_schema.h"

#include <limits>
#include <string>
#include <vector>

#include "tangible/estimation/problem/observation.h"
#include "tangible/estimation/results/fit_names.h"
#include "tangible/scene/json_schema.h"

namespace tangible {
namespace {

constexpr NumberKind kFree = NumberKind::kFree;
constexpr NumberKind kPositive = NumberKind::kPositive;

OrderedJson Free(const std::string& unit = "") { return SchemaOfNumber(kFree, unit); }
OrderedJson Positive(const std::string& unit = "") { return SchemaOfNumber(kPositive, unit); }

// {"gaussian": {...}} or {"log_normal": {...}}
OrderedJson DistributionSchema(const OrderedJson& gaussian, const OrderedJson& log_normal) {
  OrderedJson schema = SchemaOfObject({{"gaussian", gaussian}, {"log_normal", log_normal}}, {});
  schema["minProperties"] = 1;
  schema["maxProperties"] = 1;
  return schema;
}

OrderedJson ParameterSchema() {
  const OrderedJson spread = SchemaOfObject(
      {{"spread", SchemaOfAny({SchemaOfWords({"estimate"}), Positive()})}}, {"spread"});
  const OrderedJson set = SchemaOfObject(
      {{"path", SchemaOfText()}, {"scale", Free()}, {"offset", Free()}, {"add", SchemaOfFlag()}},
      {"path"});
  OrderedJson parameter = SchemaOfObject(
      {{"name", SchemaOfText()},
       {"initial", Free()},
       {"lower", Free()},
       {"upper", Free()},
       {"sets", SchemaOfArray(set, 0)},
       {"path", SchemaOfText()},
       {"scale", SchemaOfWords(WordsOf(kScales))},
       {"prior",
        DistributionSchema(
            SchemaOfObject({{"mean", Free()}, {"sigma", Positive()}}, {"mean", "sigma"}),
            SchemaOfObject({{"median", Positive()}, {"sigma", Positive()}}, {"median", "sigma"}))},
       {"per", SchemaOfWords({"recording"})},
       {"varies", DistributionSchema(spread, spread)}},
      {});
  parameter["oneOf"] =
      OrderedJson::array({{{"required", {"path"}}}, {{"required", {"name", "sets"}}}});
  return SchemaOfAny({SchemaOfText(), parameter});
}

OrderedJson SigmaSchema() {
  OrderedJson coordinates = OrderedJson::object();
  for (int i = 0; i < kCoordinates; ++i) {
    coordinates[NameOf(static_cast<Coordinate>(i))] = Positive();
  }
  // The other keys are names of events.
  OrderedJson by_name = SchemaOfObject(coordinates, {});
  by_name["additionalProperties"] = Positive("s");
  return SchemaOfAny({Positive(), by_name});
}

OrderedJson ObservationsSchema() {
  return SchemaOfArray(SchemaOfObject({{"file", SchemaOfText()},
                                       {"sigma", SigmaSchema()},
                                       {"sensor", SchemaOfName()},
                                       {"camera", SchemaOfName()},
                                       {"clock", SchemaOfName()},
                                       {"relative_to", SchemaOfName()},
                                       {"unwrap", SchemaOfFlag()},
                                       {"frame", SchemaOfWords(WordsOf(kFrames))},
                                       {"gravity", SchemaOfFlag()}},
                                      {"file"}),
                       1);
}

// What a recording may have for itself as well as the file for all.
OrderedJson SharedKeys() {
  OrderedJson camera = SchemaOfObject({{"scale", Positive()},
                                       {"rotation", Free("rad")},
                                       {"origin", SchemaOfPoint("m")},
                                       {"marker", SchemaOfName()},
                                       {"aspect", Positive()},
                                       {"radial", Free()},
                                       {"radial_length", Positive("m")}},
                                      {});
  const OrderedJson bodies = SchemaOfArray(SchemaOfName(), 2, 2);
  camera["dependentRequired"] = {{"radial", OrderedJson::array({"radial_length"})}};
  return {
      {"scene", SchemaOfText()},
      {"observations", ObservationsSchema()},
      {"points", SchemaByName(SchemaOfObject({{"body", SchemaOfName()}, {"at", SchemaOfPoint("m")}},
                                             {"body"}))},
      {"sensors", SchemaByName(SchemaOfObject({{"delay", Free("s")},
                                               {"gain", Free()},
                                               {"bias", Free()},
                                               {"sigma", Positive()},
                                               {"estimate_sigma", SchemaOfFlag()}},
                                              {}))},
      {"cameras", SchemaByName(camera)},
      {"clocks", SchemaByName(SchemaOfObject({{"rate", Positive()}, {"offset", Free("s")}}, {}))},
      {"events", SchemaByName(SchemaOfObject(
                     {{"bodies", bodies}, {"kind", SchemaOfWords(WordsOf(kObservedEventKinds))}},
                     {"bodies", "kind"}))}};
}

OrderedJson RecordingSchema() {
  OrderedJson properties = {{"name", SchemaOfText()}};
  properties.update(SharedKeys());
  const OrderedJson numbers = {{"type", "object"}, {"additionalProperties", Free()}};
  properties["start"] = SchemaOfNumber(NumberKind::kNonNegative, "s");
  properties["end"] = Free("s");
  properties["weight"] = Positive();
  properties["values"] = numbers;
  properties["initial"] = SchemaOfAny({SchemaOfWords({"from_observations"}), numbers});
  properties["role"] = SchemaOfWords({"identify", "predict"});
  properties["state_from"] = SchemaOfNumber(NumberKind::kNonNegative, "s");
  return SchemaOfObject(properties, {"name", "observations"});
}

OrderedJson NoiseSchema() {
  OrderedJson term =
      SchemaOfObject({{"body", SchemaOfName()},
                      {"joint", SchemaOfName()},
                      {"coordinate", SchemaOfWords(WordsOf(kNoiseCoordinates))},
                      {"intensity", SchemaOfAny({SchemaOfWords({"estimate"}), Positive()})},
                      {"correlation_time", SchemaOfNumber(NumberKind::kNonNegative, "s")}},
                     {"coordinate", "intensity"});
  term["oneOf"] = OrderedJson::array({{{"required", {"body"}}}, {{"required", {"joint"}}}});
  return SchemaOfArray(term, 0);
}

}  // namespace

OrderedJson DesignSchema() {
  OrderedJson values = {{"type", "object"}, {"additionalProperties", {{"type", "number"}}}};
  OrderedJson wanted = {{"type", "object"}, {"additionalProperties", Positive()}};
  const OrderedJson candidate = SchemaOfObject(
      {{"values", values}, {"duration", Positive()}, {"camera", SchemaOfName()}}, {});
  return SchemaOfObject({{"candidates", SchemaOfArray(candidate, 1)}, {"wanted", wanted}},
                        {"candidates"});
}

OrderedJson FitSchema() {
  OrderedJson properties = SharedKeys();
  properties["recordings"] = SchemaOfArray(RecordingSchema(), 1);
  properties["initial"] = SchemaOfWords({"from_observations"});
  properties["links"] = SchemaByName(
      SchemaOfObject({{"from", SchemaOfName()}, {"to", SchemaOfName()}}, {"from", "to"}));
  properties["parameters"] = SchemaOfArray(ParameterSchema(), 0);
  properties["derivatives"] = SchemaOfWords(WordsOf(kMethods));
  properties["process_noise"] = NoiseSchema();
  properties["loss"] = SchemaOfObject({{"huber", Positive()}}, {"huber"});
  properties["approach"] = SchemaOfWords(WordsOf(kApproaches));
  properties["segments"] = SchemaOfInteger(1, kMaxSegments);
  properties["starts"] = SchemaOfInteger(1, kMaxStarts);
  properties["missing"] = {{"type", "boolean"}};
  properties["seed"] = SchemaOfInteger(0, std::numeric_limits<int>::max());
  OrderedJson schema = SchemaOfObject(properties, {"parameters"});
  schema["oneOf"] = OrderedJson::array(
      {{{"required", {"recordings"}}}, {{"required", {"scene", "observations"}}}});
  schema["$defs"] = {{"design", DesignSchema()}};
  return SchemaOfFile("a fit", schema);
}

}  // namespace tangible
