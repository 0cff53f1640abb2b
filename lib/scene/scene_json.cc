// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/scene_json.h"

#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <utility>

#include "tangible/scene/joint_graph.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_names.h"
#include "tangible/scene/shape_json.h"
#include "tangible/scene/signal.h"

namespace tangible {
namespace {

// Absent keys leave the default.
void ReadNumber(const JsonReader& object, const char* key, NumberKind kind, double* value) {
  if (object.Has(key)) *value = object.At(key).Number(kind);
}

void ReadPoint(const JsonReader& object, const char* key, Vector2<double>* value) {
  if (object.Has(key)) *value = object.At(key).Point();
}

// `Value` is the enumeration, or an optional of it, which an absent key leaves empty.
template <typename Enum, std::size_t N, typename Value>
void ReadChoice(const JsonReader& object, const char* key,
                const std::pair<const char*, Enum> (&table)[N], Value* value) {
  if (object.Has(key)) *value = object.At(key).Choice(table);
}

void ReadDirection(const JsonReader& reader, Vector2<double>* value) {
  *value = reader.Point();
  if (reader.ok() && value->norm() == 0.0) {
    reader.Fail("expected a direction, got the zero vector");
  }
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
    ReadPoint(root, "gravity", &scene_->gravity);
    ReadAll(root.At("bodies"), "an array of bodies", &SceneReader::ReadBody);
    ReadOptional(root, "joints", &SceneReader::ReadJoint);
    if (root.ok() && root.Has("joints")) CheckInitialAngles(root.At("joints"));
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

  void ReadAnchors(const JsonReader& item, Vector2<double> (&anchors)[2]) {
    const JsonReader reader = item.At("anchors");
    if (reader.Size() != 2) return reader.FailExpected("an array of 2 points [[x, y], [x, y]]");
    for (int i = 0; i < 2; ++i) anchors[i] = reader.At(i).Point();
  }

  void ReadBody(const JsonReader& item);
  void ReadMass(const JsonReader& item, BasicBody<double>* body);
  void ReadJoint(const JsonReader& item);
  void ReadMotor(const JsonReader& item, const char* displacement, BasicJoint<double>* joint);
  void CheckInitialAngles(const JsonReader& joints);
  void ReadSpring(const JsonReader& item);
  void ReadForce(const JsonReader& item);
  void ReadPair(const JsonReader& item);
  void ReadNoContact(const JsonReader& item);
  void ReadPatterns(const JsonReader& reader, std::string* first, std::string* second);
  void ReadSimulation(const JsonReader& reader);
  Signal ReadSignalOf(const JsonReader& reader, SignalColumns columns);

  std::string folder_;
  Scene* scene_;
  std::map<std::string, int> body_index_;
  std::set<std::string> names_;  // of the list being read
};

void SceneReader::ReadBody(const JsonReader& item) {
  item.ExpectKeys({"name", "static", "kinematic", "shape", "contact_points", "mass", "inertia",
                   "position", "angle", "velocity", "angular_velocity", "friction", "restitution",
                   "linear_damping", "angular_damping", "quadratic_drag"},
                  " of a body");
  if (!item.ok()) return;
  BasicBody<double> body;
  body.name = ReadName(item);
  const bool is_static = item.Has("static") && item.At("static").Boolean();
  const bool is_kinematic = item.Has("kinematic") && item.At("kinematic").Boolean();
  if (is_static && is_kinematic) {
    item.At("kinematic").Fail("expected a body that is static or kinematic, got both");
  }
  if (is_static) body.motion = Motion::kStatic;
  if (is_kinematic) body.motion = Motion::kKinematic;
  if (item.Has("shape")) ReadShape(item.At("shape"), &body.shape);
  if (item.Has("contact_points")) {
    const JsonReader points = item.At("contact_points");
    const int size = points.ExpectArray("an array of points [x, y]");
    for (int i = 0; i < size; ++i) body.contact_points.push_back(points.At(i).Point());
  }
  ReadMass(item, &body);
  if (item.Has("position") || body.motion == Motion::kMoving) {
    body.position = item.At("position").Point();
  }
  ReadNumber(item, "angle", NumberKind::kFree, &body.angle);
  ReadPoint(item, "velocity", &body.velocity);
  ReadNumber(item, "angular_velocity", NumberKind::kFree, &body.angular_velocity);
  if (is_static && body.velocity != Vector2<double>(0.0, 0.0)) {
    item.At("velocity").Fail("expected [0, 0] of a static body, got a velocity (kinematic moves)");
  }
  if (is_static && body.angular_velocity != 0.0) {
    item.At("angular_velocity").FailExpected("0 of a static body (kinematic moves)");
  }
  ReadNumber(item, "friction", NumberKind::kNonNegative, &body.friction);
  ReadNumber(item, "restitution", NumberKind::kFraction, &body.restitution);
  ReadNumber(item, "linear_damping", NumberKind::kNonNegative, &body.linear_damping);
  ReadNumber(item, "angular_damping", NumberKind::kNonNegative, &body.angular_damping);
  if (item.Has("quadratic_drag")) {
    body.quadratic_drag = item.At("quadratic_drag").Number(NumberKind::kNonNegative);
  }
  body_index_[body.name] = static_cast<int>(scene_->bodies.size());
  scene_->bodies.push_back(std::move(body));
}

void SceneReader::ReadMass(const JsonReader& item, BasicBody<double>* body) {
  const bool moving = body->motion == Motion::kMoving;
  if (moving && body->shape.type == ShapeType::kHalfPlane) {
    item.At("shape").At("half_plane").Fail("expected a static or kinematic body, got a moving one");
  }
  if (item.Has("mass") || moving) body->mass = item.At("mass").Number(NumberKind::kPositive);
  if (item.Has("inertia")) body->inertia = item.At("inertia").Number(NumberKind::kPositive);
  if (!moving || body->inertia.has_value() || !item.ok()) return;
  if (body->shape.type == ShapeType::kNone) {
    item.At("inertia").Fail("missing, expected a number > 0 for a body without a shape");
  } else if (!IsCentred(body->shape)) {
    item.At("inertia").Fail(
        "missing, expected a number > 0 for a polygon whose centroid is not the origin");
  }
}

void SceneReader::ReadJoint(const JsonReader& item) {
  if (!item.IsObject()) return item.FailExpected("an object");
  BasicJoint<double> joint;
  joint.type = item.At("type").Choice(kJointTypeNames);
  if (!item.ok()) return;
  const bool revolute = joint.type == JointType::kRevolute;
  const bool prismatic = joint.type == JointType::kPrismatic;
  const bool distance = joint.type == JointType::kDistance;
  const char* const displacement = prismatic ? "displacement" : "angle";
  std::vector<std::string> keys = {"name", "type", "bodies", "contact"};
  if (distance) keys.emplace_back("anchors");
  if (!distance && joint.type != JointType::kFixedAngle) keys.emplace_back("anchor");
  if (prismatic) keys.emplace_back("axis");
  if (revolute || prismatic) {
    keys.insert(keys.end(), {displacement, "rate", "damping", "friction", "limits", "effort",
                             "kinetic_friction", "stribeck_speed", "stiffness",
                             prismatic ? "rest_displacement" : "rest_angle"});
  }
  item.ExpectKeys(keys, " of a " + NameOf(joint.type, kJointTypeNames) + " joint");
  if (!item.ok()) return;
  joint.name = ReadName(item);
  ReadEnds(item, joint.bodies);
  if (distance) {
    ReadAnchors(item, joint.anchors);
    if (item.ok() && (joint.anchors[0] - joint.anchors[1]).norm() == 0.0) {
      item.At("anchors").Fail("expected two points apart, got a distance of 0");
    }
  } else if (joint.type != JointType::kFixedAngle) {
    joint.anchors[0] = item.At("anchor").Point();
  }
  if (prismatic) ReadDirection(item.At("axis"), &joint.axis);
  if (revolute || prismatic) ReadMotor(item, displacement, &joint);
  if (item.Has("contact")) joint.contact = item.At("contact").Boolean();
  scene_->joints.push_back(std::move(joint));
}

void SceneReader::ReadMotor(const JsonReader& item, const char* displacement,
                            BasicJoint<double>* joint) {
  ReadNumber(item, displacement, NumberKind::kFree, &joint->angle);
  ReadNumber(item, "rate", NumberKind::kFree, &joint->rate);
  ReadNumber(item, "damping", NumberKind::kNonNegative, &joint->damping);
  if (item.Has("limits")) {
    const JsonReader limits = item.At("limits");
    if (limits.Size() != 2) return limits.FailExpected("an array of 2 numbers [low, high]");
    const double low = limits.At(0).Number();
    const double high = limits.At(1).Number();
    joint->limits = {low, high};
    if (item.ok() && low > high) {
      limits.Fail("expected [low, high] with low <= high, got [" + Json(low).dump() + ", " +
                  Json(high).dump() + "]");
    }
  }
  const bool prismatic = joint->type == JointType::kPrismatic;
  const char* const rest = prismatic ? "rest_displacement" : "rest_angle";
  if (item.Has("friction")) {
    joint->friction = item.At("friction").Number(NumberKind::kNonNegative);
  }
  if (item.Has("kinetic_friction") && joint->friction) {
    joint->kinetic_friction = item.At("kinetic_friction").Number(NumberKind::kNonNegative);
    joint->stribeck_speed = item.At("stribeck_speed").Number(NumberKind::kPositive);
  } else if (item.Has("kinetic_friction")) {
    item.At("friction").Fail("missing, expected a number >= 0 with kinetic_friction");
  } else if (item.Has("stribeck_speed")) {
    item.At("kinetic_friction").Fail("missing, expected a number >= 0 with stribeck_speed");
  }
  if (item.Has("stiffness")) {
    joint->stiffness = item.At("stiffness").Number(NumberKind::kNonNegative);
    ReadNumber(item, rest, NumberKind::kFree, &joint->rest);
  } else if (item.Has(rest)) {
    item.At("stiffness").Fail(std::string("missing, expected a number >= 0 with ") + rest);
  }
  if (!item.Has("effort")) return;
  const JsonReader effort = item.At("effort");
  if (effort.IsObject()) {
    joint->effort_signal = ReadSignalOf(effort, SignalColumns::kValue);
  } else if (effort.IsNumber()) {
    joint->effort = effort.Number();
  } else {
    effort.FailExpected("a number or {\"file\": ...}");
  }
}

void SceneReader::CheckInitialAngles(const JsonReader& joints) {
  const std::vector<JointPlace> places = ClassifyJoints(*scene_);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const BasicJoint<double>& joint = scene_->joints[i];
    if (places[i] == JointPlace::kTree || (joint.angle == 0.0 && joint.rate == 0.0)) continue;
    const bool prismatic = joint.type == JointType::kPrismatic;
    const std::string angle = prismatic ? "displacement" : "angle";
    const std::string key = joint.angle != 0.0 ? angle : "rate";
    const JsonReader place = joints.At(static_cast<int>(i)).At(key);
    place.FailExpected(places[i] == JointPlace::kLoop
                           ? "0 of a joint in a closed loop (write the bodies' poses and twists)"
                           : "0 of a joint whose bodies[0] side is attached to the world or to a "
                             "static or kinematic body (swap the two bodies)");
  }
}

void SceneReader::ReadSpring(const JsonReader& item) {
  item.ExpectKeys({"name", "bodies", "anchors", "stiffness", "damping", "rest_length"},
                  " of a spring");
  if (!item.ok()) return;
  BasicSpring<double> spring;
  spring.name = ReadName(item);
  ReadEnds(item, spring.bodies);
  ReadAnchors(item, spring.anchors);
  spring.stiffness = item.At("stiffness").Number(NumberKind::kNonNegative);
  ReadNumber(item, "damping", NumberKind::kNonNegative, &spring.damping);
  spring.rest_length = item.At("rest_length").Number(NumberKind::kNonNegative);
  scene_->springs.push_back(std::move(spring));
}

void SceneReader::ReadForce(const JsonReader& item) {
  item.ExpectKeys({"name", "body", "force", "torque", "at", "start", "end"}, " of a force");
  if (!item.ok()) return;
  BasicForce<double> force;
  force.name = ReadName(item);
  force.body = FindBody(item.At("body"));
  if (item.ok() && !Moves(force.body)) item.At("body").FailExpected("a moving body");
  if (item.At("force").IsObject()) {
    force.force_signal = ReadSignalOf(item.At("force"), SignalColumns::kForce);
  } else if (item.Has("force")) {
    const JsonReader value = item.At("force");
    if (!value.IsArray()) value.FailExpected("[x, y] or {\"file\": ...}");
    force.force = value.Point();
  }
  if (item.At("torque").IsObject()) {
    force.torque_signal = ReadSignalOf(item.At("torque"), SignalColumns::kValue);
  } else if (item.Has("torque")) {
    const JsonReader value = item.At("torque");
    if (!value.IsNumber()) value.FailExpected("a number or {\"file\": ...}");
    force.torque = value.Number();
  }
  ReadPoint(item, "at", &force.at);
  if (item.Has("start")) force.start = item.At("start").Number();
  if (item.Has("end")) force.end = item.At("end").Number();
  if (item.ok() && force.start && force.end && *force.start > *force.end) {
    item.At("end").FailExpected("a number >= start, which is " + Json(*force.start).dump());
  }
  scene_->forces.push_back(std::move(force));
}

Signal SceneReader::ReadSignalOf(const JsonReader& reader, SignalColumns columns) {
  Signal signal;
  reader.ExpectKeys({"file", "interpolation"});
  signal.file = reader.At("file").String();
  ReadChoice(reader, "interpolation", kInterpolationNames, &signal.interpolation);
  if (!reader.ok()) return signal;
  std::string error;
  if (!ReadSignal(JoinPath(folder_, signal.file), columns, &signal, &error)) {
    reader.At("file").Fail(error);
  }
  return signal;
}

// Two names of bodies with `*`; some two different bodies must match them.
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
  if (matching[0].size() == 1 && matching[0] == matching[1]) {
    reader.Fail("expected two different bodies, got \"" + scene_->bodies[matching[0][0]].name +
                "\" twice");
  }
}

void SceneReader::ReadPair(const JsonReader& item) {
  item.ExpectKeys({"bodies", "friction", "restitution"}, " of a pair");
  if (!item.ok()) return;
  BasicPair<double> pair;
  ReadPatterns(item.At("bodies"), &pair.bodies[0], &pair.bodies[1]);
  if (!item.ok()) return;
  const std::string name = pair.bodies[0] + ":" + pair.bodies[1];
  if (names_.count(name) > 0) {
    item.At("bodies").Fail("expected a pair of its own, got " + name + " a second time");
  }
  names_.insert({name, pair.bodies[1] + ":" + pair.bodies[0]});
  if (item.Has("friction")) pair.friction = item.At("friction").Number(NumberKind::kNonNegative);
  if (item.Has("restitution")) {
    pair.restitution = item.At("restitution").Number(NumberKind::kFraction);
  }
  scene_->pairs.push_back(std::move(pair));
}

void SceneReader::ReadNoContact(const JsonReader& item) {
  std::pair<std::string, std::string> patterns;
  ReadPatterns(item, &patterns.first, &patterns.second);
  scene_->no_contact.push_back(std::move(patterns));
}

void SceneReader::ReadSimulation(const JsonReader& reader) {
  reader.ExpectKeys({"dt", "duration", "stepping", "integrator", "joint_correction",
                     "joint_tolerance", "friction_mixing", "restitution_mixing", "impact_law",
                     "restitution_threshold", "recovery_speed", "contact_margin",
                     "max_events_per_step", "lcp_tolerance", "lcp_max_iterations"},
                    " of simulation", {"baumgarte", "solver", "smoothing"});
  RefuseWithdrawn(reader);
  if (!reader.ok()) return;
  constexpr int kMostIterations = 1000000;
  SimulationSettings& settings = scene_->simulation;
  ReadNumber(reader, "dt", NumberKind::kPositive, &settings.dt);
  ReadNumber(reader, "duration", NumberKind::kNonNegative, &settings.duration);
  if (reader.ok() && settings.duration / settings.dt > kMaxSteps) {
    reader.Fail("expected at most 1e9 steps, got duration / dt = " +
                Json(settings.duration).dump() + " / " + Json(settings.dt).dump());
  }
  ReadChoice(reader, "stepping", kSteppingNames, &settings.stepping);
  ReadChoice(reader, "integrator", kIntegratorNames, &settings.integrator);
  ReadChoice(reader, "joint_correction", kJointCorrectionNames, &settings.joint_correction);
  ReadNumber(reader, "joint_tolerance", NumberKind::kPositive, &settings.joint_tolerance);
  ReadChoice(reader, "friction_mixing", kMixingNames, &settings.friction_mixing);
  ReadChoice(reader, "restitution_mixing", kMixingNames, &settings.restitution_mixing);
  ReadChoice(reader, "impact_law", kImpactLawNames, &settings.impact_law);
  ReadNumber(reader, "restitution_threshold", NumberKind::kNonNegative,
             &settings.restitution_threshold);
  ReadNumber(reader, "recovery_speed", NumberKind::kNonNegative, &settings.recovery_speed);
  ReadNumber(reader, "contact_margin", NumberKind::kNonNegative, &settings.contact_margin);
  if (reader.Has("max_events_per_step")) {
    settings.max_events_per_step = reader.At("max_events_per_step").Integer(0, kMostIterations);
  }
  ReadNumber(reader, "lcp_tolerance", NumberKind::kPositive, &settings.lcp_tolerance);
  if (reader.Has("lcp_max_iterations")) {
    settings.lcp_max_iterations = reader.At("lcp_max_iterations").Integer(1, kMostIterations);
  }
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
