// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/scene_json.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tangible/scene/field_reader.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_fields.h"
#include "tangible/scene/scene_names.h"
#include "tangible/scene/shape_json.h"
#include "tangible/scene/signal.h"
#include "tangible/scene/validate.h"

namespace tangible {
namespace {

// The times of a series that stands in the scene, which increase.
std::vector<double> ReadSeriesTimes(const JsonReader& series) {
  const JsonReader times = series.At("time");
  const VectorX<double> values = times.Vector();
  if (values.size() == 0) times.FailExpected("an array of at least one time");
  for (Eigen::Index i = 1; i < values.size(); ++i) {
    if (values[i] > values[i - 1]) continue;
    times.At(static_cast<int>(i))
        .FailExpected("a number > " + Json(values[i - 1]).dump() + " (the time before)");
  }
  return std::vector<double>(values.begin(), values.end());
}

// A column of it.
std::vector<double> ReadSeriesColumn(const JsonReader& series, const char* key) {
  const JsonReader column = series.At(key);
  const int size = series.At("time").Size();
  const VectorX<double> values = column.Vector();
  if (column.ok() && column.Size() != size) {
    column.FailExpected(std::to_string(size) + " numbers, one for each time");
  }
  return std::vector<double>(values.begin(), values.end());
}

// Fails on settings that earlier scenes could have and no scene needs. A file that writes out the
// value that every run has is read.
void RefuseWithdrawn(const JsonReader& simulation) {
  const struct {
    const char* key;
    Json of_every_run;
    const char* expected;
  } keys[] = {
      {"baumgarte", 0.2, "no such key (\"joint_correction\": \"projection\" closes joints)"},
      {"solver", "auto", "no such key (a step is solved by the first method that can)"},
      {"smoothing", 0.0, "no such key (every step is solved to \"lcp_tolerance\")"}};
  for (const auto& [key, of_every_run, expected] : keys) {
    const JsonReader value = simulation.At(key);
    if (value.exists() && !value.Is(of_every_run)) value.FailExpected(expected);
  }
  const JsonReader correction = simulation.At("joint_correction");
  if (correction.Is("baumgarte")) correction.FailExpected("\"projection\", which closes joints");
  for (const char* key : {"friction_mixing", "restitution_mixing"}) {
    const JsonReader mixing = simulation.At(key);
    if (mixing.Is("minimum") || mixing.Is("maximum")) {
      mixing.FailExpected("average, geometric_mean, or the pair's own value in \"pairs\"");
    }
  }
}

class SceneReader {
 public:
  SceneReader(std::string folder, Scene* scene) : folder_(std::move(folder)), scene_(scene) {}

  void Read(const JsonReader& root) {
    root.ExpectKeys({"name", "gravity", "bodies", "joints", "springs", "forces", "pairs",
                     "no_contact", "simulation"},
                    " of a scene");
    if (!root.ok()) return;
    if (root.Has("name")) scene_->name = root.At("name").String();
    FieldReader(root).Point(kGravityField, scene_->gravity);
    ReadAll(root.At("bodies"), "an array of bodies", &SceneReader::ReadBody);
    ReadOptional(root, "joints", &SceneReader::ReadJoint);
    ReadCoupled(root.At("joints"));
    if (root.ok()) CheckInitialAngles(*scene_, root.At("joints"));
    if (root.ok()) CheckCouplings(*scene_, root.At("joints"));
    if (root.ok()) CheckCoupledRates(*scene_, root.At("joints"));
    if (root.ok()) CheckRopes(*scene_, root.At("joints"));
    ReadOptional(root, "springs", &SceneReader::ReadSpring);
    ReadOptional(root, "forces", &SceneReader::ReadForce);
    ReadOptional(root, "pairs", &SceneReader::ReadPair);
    ReadOptional(root, "no_contact", &SceneReader::ReadNoContact);
    if (root.ok() && root.Has("simulation")) ReadSimulation(root.At("simulation"));
  }

 private:
  using Member = void (SceneReader::*)(const JsonReader&);

  void ReadAll(const JsonReader& list, const std::string& expected, Member read) {
    names_.clear();
    const int size = list.ExpectArray(expected);
    for (int i = 0; i < size && list.ok(); ++i) (this->*read)(list.At(i));
  }

  void ReadOptional(const JsonReader& root, const char* key, Member read) {
    if (root.ok() && root.Has(key)) {
      ReadAll(root.At(key), std::string("an array of ") + key, read);
    }
  }

  // A name that is new within its list.
  std::string ReadName(const JsonReader& item) {
    const JsonReader reader = item.At("name");
    std::string name = reader.String();
    if (!reader.ok()) return name;
    if (!IsName(name, "")) {
      reader.FailExpected("a name of letters, digits, _ . -");
    } else if (name == "world") {
      reader.Fail("expected another name, got \"world\", which is reserved");
    } else if (!names_.insert(name).second) {
      reader.Fail("expected a name of its own, got \"" + name + "\" a second time");
    }
    return name;
  }

  std::string BodyList() const {
    constexpr std::size_t kMost = 8;
    std::string list;
    for (std::size_t i = 0; i < scene_->bodies.size() && i < kMost; ++i) {
      list += (i == 0 ? "" : ", ") + scene_->bodies[i].name;
    }
    if (scene_->bodies.size() > kMost) list += ", ...";
    return list.empty() ? "there are none" : "bodies are " + list;
  }

  int FindBody(const JsonReader& reader) const {
    const std::string name = reader.String();
    if (!reader.ok()) return -1;
    const auto place = body_index_.find(name);
    if (place != body_index_.end()) return place->second;
    reader.Fail("expected the name of a body (" + BodyList() + "), got " + Describe(Json(name)));
    return -1;
  }

  bool Moves(int body) const { return body >= 0 && scene_->bodies[body].motion == Motion::kMoving; }

  // The two ends of a joint or spring: bodies or the world, not twice the same, at least one
  // moving.
  void ReadEnds(const JsonReader& item, int (&bodies)[2]) {
    const JsonReader ends = item.At("bodies");
    if (ends.Size() != 2) return ends.FailExpected("an array of 2 names of bodies or world");
    for (int i = 0; i < 2; ++i) {
      const JsonReader end = ends.At(i);
      const bool world = end.IsString() && end.String() == "world";
      bodies[i] = world ? -1 : FindBody(end);
    }
    if (!item.ok()) return;
    if (bodies[0] == bodies[1]) {
      const std::string name = ends.At(0).String();
      ends.Fail("expected two different bodies, got \"" + name + "\" twice");
    } else if (!Moves(bodies[0]) && !Moves(bodies[1])) {
      ends.Fail("expected at least one moving body, got two that are static, kinematic or world");
    }
  }

  void ReadBody(const JsonReader& item);
  void ReadJoint(const JsonReader& item);
  void ReadCoupled(const JsonReader& joints);
  void ReadSpring(const JsonReader& item);
  void ReadForce(const JsonReader& item);
  void ReadPair(const JsonReader& item);
  void ReadNoContact(const JsonReader& item);
  void ReadPatterns(const JsonReader& reader, std::string* first, std::string* second);
  void ReadSimulation(const JsonReader& reader);
  Signal ReadSignalOf(const JsonReader& reader, SignalColumns columns);
  Signal ReadSeriesOf(const JsonReader& reader, SignalColumns columns);
  std::shared_ptr<const RecordedPath> ReadPathOf(const JsonReader& reader);
  SignalReader Signals() {
    return [this](const JsonReader& reader, SignalColumns columns) {
      return ReadSignalOf(reader, columns);
    };
  }

  std::string folder_;
  Scene* scene_;
  std::map<std::string, int> body_index_;
  std::set<std::string> names_;  // of the list being read
};

void SceneReader::ReadBody(const JsonReader& item) {
  BasicBody<double> body;
  FieldKeys fields({"name", "static", "kinematic", "shape"});
  VisitContactPoints(body, &fields);
  VisitBody(body, &fields);
  item.ExpectKeys(fields.keys(), " of a body");
  if (!item.ok()) return;
  body.name = ReadName(item);
  const bool is_static = item.Has("static") && item.At("static").Boolean();
  const bool is_kinematic = item.Has("kinematic") && item.At("kinematic").Boolean();
  if (is_static && is_kinematic) {
    item.At("kinematic").Fail("expected a body that is static or kinematic, got both");
  }
  if (is_static) body.motion = Motion::kStatic;
  if (is_kinematic) body.motion = Motion::kKinematic;
  if (item.Has("shape")) ReadShape(item.At("shape"), &body.shape);
  FieldReader reader(item, nullptr,
                     [this](const JsonReader& motion) { return ReadPathOf(motion); });
  VisitContactPoints(body, &reader);
  VisitBody(body, &reader);
  if (item.ok()) CheckBody(body, item);
  if (item.ok() && body.driven) CheckPathOffsets(*body.driven, item.At("motion"));
  if (item.ok()) CheckFrictionDecay(body.kinetic_friction, body.friction, item);
  body_index_[body.name] = static_cast<int>(scene_->bodies.size());
  scene_->bodies.push_back(std::move(body));
}

void SceneReader::ReadJoint(const JsonReader& item) {
  if (!item.IsObject()) return item.FailExpected("an object");
  BasicJoint<double> joint;
  joint.type = item.At("type").Choice(kJointTypeNames);
  if (!item.ok()) return;
  const bool couples = joint.type == JointType::kCoupling;
  FieldKeys fields({"name", "type", couples ? "joints" : "bodies", "contact"});
  VisitJoint(joint, true, &fields);
  item.ExpectKeys(fields.keys(), " of a " + NameOf(joint.type, kJointTypeNames) + " joint");
  if (!item.ok()) return;
  joint.name = ReadName(item);
  if (!couples) ReadEnds(item, joint.bodies);
  FieldReader reader(item, Signals());
  VisitJoint(joint, true, &reader);
  reader.Flag("contact", joint.contact);
  if (item.ok()) CheckJoint(joint, item);
  scene_->joints.push_back(std::move(joint));
}

// The joints that couplings name, which may stand after them.
void SceneReader::ReadCoupled(const JsonReader& joints) {
  for (std::size_t i = 0; i < scene_->joints.size() && joints.ok(); ++i) {
    BasicJoint<double>& coupling = scene_->joints[i];
    if (coupling.type != JointType::kCoupling) continue;
    const JsonReader names = joints.At(static_cast<int>(i)).At("joints");
    if (names.Size() != 2) return names.FailExpected("an array of 2 names of joints");
    for (int k = 0; k < 2; ++k) {
      const std::string name = names.At(k).String();
      if (!names.ok()) return;
      const auto place = std::find_if(scene_->joints.begin(), scene_->joints.end(),
                                      [&name](const auto& joint) { return joint.name == name; });
      if (place == scene_->joints.end()) {
        return names.At(k).Fail("expected the name of a joint, got " + Describe(Json(name)));
      }
      coupling.coupled[k] = static_cast<int>(place - scene_->joints.begin());
    }
  }
}

void SceneReader::ReadSpring(const JsonReader& item) {
  BasicSpring<double> spring;
  FieldKeys fields({"name", "bodies"});
  VisitSpring(spring, &fields);
  item.ExpectKeys(fields.keys(), " of a spring");
  if (!item.ok()) return;
  spring.name = ReadName(item);
  ReadEnds(item, spring.bodies);
  FieldReader reader(item);
  VisitSpring(spring, &reader);
  scene_->springs.push_back(std::move(spring));
}

void SceneReader::ReadForce(const JsonReader& item) {
  BasicForce<double> force;
  FieldKeys fields({"name", "body"});
  VisitForce(force, &fields);
  item.ExpectKeys(fields.keys(), " of a force");
  if (!item.ok()) return;
  force.name = ReadName(item);
  force.body = FindBody(item.At("body"));
  if (item.ok() && !Moves(force.body)) item.At("body").FailExpected("a moving body");
  FieldReader reader(item, Signals());
  VisitForce(force, &reader);
  if (item.ok()) CheckForce(force, item);
  scene_->forces.push_back(std::move(force));
}

Signal SceneReader::ReadSignalOf(const JsonReader& reader, SignalColumns columns) {
  if (reader.Has("time")) return ReadSeriesOf(reader, columns);
  Signal signal;
  reader.ExpectKeys({"file", "interpolation"});
  signal.file = reader.At("file").String();
  FieldReader(reader).Choice("interpolation", kInterpolationNames, signal.interpolation);
  if (!reader.ok()) return signal;
  std::string error;
  if (!ReadSignal(JoinPath(folder_, signal.file), columns, &signal, &error)) {
    reader.At("file").Fail(error);
  }
  return signal;
}

// A signal whose series stands in the scene itself, with the keys of a file's columns.
Signal SceneReader::ReadSeriesOf(const JsonReader& reader, SignalColumns columns) {
  Signal signal;
  const bool force = columns == SignalColumns::kForce;
  std::vector<std::string> keys = {"time", "interpolation"};
  if (force) {
    keys.insert(keys.begin() + 1, {"x", "y"});
  } else {
    keys.insert(keys.begin() + 1, "value");
  }
  reader.ExpectKeys(keys);
  FieldReader(reader).Choice("interpolation", kInterpolationNames, signal.interpolation);
  signal.time = ReadSeriesTimes(reader);
  if (!force) {
    signal.value = ReadSeriesColumn(reader, "value");
    return signal;
  }
  if (!reader.Has("x") && !reader.Has("y")) reader.Fail("missing x or y beside time");
  const std::vector<double> zeros(signal.time.size(), 0.0);
  signal.x = reader.Has("x") ? ReadSeriesColumn(reader, "x") : zeros;
  signal.y = reader.Has("y") ? ReadSeriesColumn(reader, "y") : zeros;
  return signal;
}

// A path from a file, or from a series that stands in the scene; null after a failure.
std::shared_ptr<const RecordedPath> SceneReader::ReadPathOf(const JsonReader& reader) {
  PathSeries series;
  if (reader.Has("time") && reader.Has("file")) {
    reader.At("time").Fail("expected no time beside file, which has the times");
  } else if (reader.Has("time")) {
    series.time = ReadSeriesTimes(reader);
    if (!reader.Has("x") && !reader.Has("y") && !reader.Has("angle")) {
      reader.Fail("missing x, y or angle beside time");
    }
    if (reader.Has("x")) series.x = ReadSeriesColumn(reader, "x");
    if (reader.Has("y")) series.y = ReadSeriesColumn(reader, "y");
    if (reader.Has("angle")) series.angle = ReadSeriesColumn(reader, "angle");
  } else {
    for (const char* column : {"x", "y", "angle"}) {
      if (reader.Has(column)) reader.At(column).Fail("expected time beside it, or file alone");
    }
    series.file = reader.At("file").String();
    std::string error;
    if (reader.ok() && !ReadPath(JoinPath(folder_, series.file), &series, &error)) {
      reader.At("file").Fail(error);
    }
  }
  FieldReader(reader).Choice("interpolation", kPathInterpolationNames, series.interpolation);
  return reader.ok() ? std::make_shared<const RecordedPath>(std::move(series)) : nullptr;
}

// Two names of bodies with `*`; where one is a name, some two different bodies must match them.
void SceneReader::ReadPatterns(const JsonReader& reader, std::string* first, std::string* second) {
  if (reader.Size() != 2) return reader.FailExpected("an array of 2 names of bodies");
  std::vector<int> matching[2];
  for (int i = 0; i < 2; ++i) {
    const JsonReader name = reader.At(i);
    std::string& pattern = i == 0 ? *first : *second;
    pattern = name.String();
    if (!reader.ok()) return;
    if (!IsName(pattern, "*")) return name.FailExpected("a name of letters, digits, _ . - *");
    for (std::size_t b = 0; b < scene_->bodies.size(); ++b) {
      if (MatchesPattern(pattern, scene_->bodies[b].name)) {
        matching[i].push_back(static_cast<int>(b));
      }
    }
    if (matching[i].empty()) {
      return name.FailExpected("a name or pattern of a body (" + BodyList() + ")");
    }
  }
  // Two patterns may match one body alone: they name no pair then, and no body twice.
  const bool are_patterns =
      first->find('*') != std::string::npos && second->find('*') != std::string::npos;
  if (!are_patterns && matching[0].size() == 1 && matching[0] == matching[1]) {
    reader.Fail("expected two different bodies, got \"" + scene_->bodies[matching[0][0]].name +
                "\" twice");
  }
}

void SceneReader::ReadPair(const JsonReader& item) {
  BasicPair<double> pair;
  FieldKeys fields({"bodies"});
  VisitPair(pair, &fields);
  item.ExpectKeys(fields.keys(), " of a pair");
  if (!item.ok()) return;
  ReadPatterns(item.At("bodies"), &pair.bodies[0], &pair.bodies[1]);
  if (!item.ok()) return;
  const std::string name = pair.bodies[0] + ":" + pair.bodies[1];
  if (names_.count(name) > 0) {
    item.At("bodies").Fail("expected a pair of its own, got " + name + " a second time");
  }
  names_.insert({name, pair.bodies[1] + ":" + pair.bodies[0]});
  FieldReader reader(item);
  VisitPair(pair, &reader);
  if (item.ok() && pair.friction) {
    CheckFrictionDecay(pair.kinetic_friction, *pair.friction, item);
  }
  scene_->pairs.push_back(std::move(pair));
}

void SceneReader::ReadNoContact(const JsonReader& item) {
  std::pair<std::string, std::string> patterns;
  ReadPatterns(item, &patterns.first, &patterns.second);
  scene_->no_contact.push_back(std::move(patterns));
}

void SceneReader::ReadSimulation(const JsonReader& reader) {
  SimulationSettings& settings = scene_->simulation;
  FieldKeys fields;
  VisitSettings(settings, &fields);
  reader.ExpectKeys(fields.keys(), " of simulation", {"baumgarte", "solver", "smoothing"});
  RefuseWithdrawn(reader);
  if (!reader.ok()) return;
  FieldReader values(reader);
  VisitSettings(settings, &values);
  if (reader.ok()) CheckSettings(settings, reader);
}

}  // namespace

bool ParseScene(const std::string& text, const std::string& name_for_messages,
                const std::string& folder_for_relative_files, Scene* scene, std::string* error) {
  Json json;
  if (!ParseJson(text, name_for_messages, &json, error)) return false;
  *scene = Scene();
  scene->path = name_for_messages;
  JsonErrors errors(name_for_messages);
  SceneReader(folder_for_relative_files, scene).Read(JsonReader(json, &errors));
  if (errors.ok()) return true;
  *error = errors.message();
  return false;
}

bool LoadScene(const std::string& file, Scene* scene, std::string* error) {
  std::string text;
  return ReadTextFile(file, &text, error) && ParseScene(text, file, FolderOf(file), scene, error);
}

}  // namespace tangible
