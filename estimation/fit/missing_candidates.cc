// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/missing_candidates.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "tangible/scene/joint_graph.h"
#include "tangible/scene/parameter.h"

namespace tangible {
namespace {

// Those of one run.
constexpr int kHeldNumbers = 0;
constexpr int kSmoothForces = 1;
constexpr int kNewInstruments = 2;
// What is observed is within this distance of the lens' axis, where nothing is: m.
constexpr double kNoRadius = 1.0;
// Natural frequencies of a joint made softer, times dt: the largest is one that explicit steps
// follow.
constexpr double kStiffest = 0.4;
// So many of them, each lower than the last one by this factor.
constexpr int kSoftTries = 5;
constexpr double kSofter = 3.0;
// Of the critical damping: a joint made softer loses its oscillation within a few periods.
constexpr double kSoftDamping = 0.2;
// Of the mass of the lighter body: what carries an anchor that may move.
constexpr double kCarrierMass = 0.02;

/// A name that no item of the list has.
template <typename Items>
std::string FreeName(const std::string& wanted, const Items& items) {
  std::string name = wanted;
  const auto is_taken = [&](const auto& item) { return item.name == name; };
  while (std::any_of(items.begin(), items.end(), is_taken)) name += "_";
  return name;
}

FitParameter AtPath(const std::string& path) {
  FitParameter parameter;
  parameter.name = path;
  parameter.sets = {{path}};
  return parameter;
}

bool IsSet(const FitProblem& problem, const std::string& path) {
  return std::any_of(
      problem.parameters.begin(), problem.parameters.end(), [&](const FitParameter& parameter) {
        return std::any_of(parameter.sets.begin(), parameter.sets.end(),
                           [&](const auto& set) { return MatchesPath(set.path, path); });
      });
}

bool IsPosition(Coordinate coordinate) {
  return coordinate == Coordinate::kX || coordinate == Coordinate::kY;
}

/// Whether a camera would change what is observed.
bool IsSeen(Coordinate coordinate) {
  return IsPosition(coordinate) || coordinate == Coordinate::kVx || coordinate == Coordinate::kVy ||
         coordinate == Coordinate::kDistance;
}

/// Lists the candidates of a problem.
class CandidateList {
 public:
  CandidateList(const FitProblem& problem, int most) : problem_(problem), most_(most) {}

  std::vector<MissingCandidate> List() {
    AddNumbers();
    AddForces();
    AddInstruments();
    AddMarkers();
    AddSofterJoints();
    return std::move(all_);
  }

 private:
  MissingCandidate& Add(const std::string& name, MissingKind kind,
                        const std::vector<std::string>& paths, int together,
                        std::function<void(FitProblem*)> change = {}) {
    MissingCandidate& one = all_.emplace_back();
    one.name = name;
    one.kind = kind;
    for (const std::string& path : paths) one.parameters.push_back(AtPath(path));
    one.together = together;
    one.change = std::move(change);
    return one;
  }

  // Numbers that are there and that no parameter sets.
  void AddNumbers() {
    ParameterizedScene scene;
    ParameterError error;
    Scene copy = problem_.scene;
    const auto numbers = EnumerateNumbers(&copy);
    std::vector<bool> set(numbers.size(), false);
    if (scene.Create(problem_.scene, problem_.points, problem_.parameters, &error,
                     problem_.instruments)) {
      set = scene.NumbersSet();
    }
    const auto is_free = [&](size_t i) {
      ParameterPath path;
      std::string what;
      return !set[i] && ResolveParameter(copy, numbers[i].path, &path, &what) &&
             IsAllowed(numbers[i].kind, *numbers[i].value);
    };
    std::vector<std::string> paths;
    for (size_t i = 0; i < numbers.size(); ++i) {
      if (is_free(i)) paths.push_back(numbers[i].path);
    }
    if (static_cast<int>(paths.size()) <= most_) {
      for (const std::string& path : paths) Add(path, MissingKind::kNumber, {path}, kHeldNumbers);
    }
    Instruments instruments = problem_.instruments;
    for (const InstrumentNumber& number : EnumerateNumbers(&instruments)) {
      if (number.needs == nullptr && !IsSet(problem_, number.path)) {
        Add(number.path, MissingKind::kNumber, {number.path}, kHeldNumbers);
      }
    }
    for (const BodyPoint& point : problem_.points) {
      const std::string path = "points/" + point.name + "/at";
      if (IsSet(problem_, path + "/x") || IsSet(problem_, path + "/y")) continue;
      Add(path, MissingKind::kMarker, {path + "/x", path + "/y"}, kHeldNumbers);
    }
  }

  // Keys that are absent, and forces.
  void AddForces() {
    const Scene& scene = problem_.scene;
    const bool in_plane = scene.gravity.x() == 0.0 && scene.gravity.y() == 0.0;
    const auto num_shapes =
        std::count_if(scene.bodies.begin(), scene.bodies.end(),
                      [](const auto& body) { return !body.shape.numbers.empty(); });
    for (size_t i = 0; i < scene.bodies.size(); ++i) {
      const BasicBody<double>& body = scene.bodies[i];
      if (body.motion != Motion::kMoving) continue;
      const std::string path = "bodies/" + body.name;
      if (!body.quadratic_drag) {
        Add(path + "/quadratic_drag", MissingKind::kForce, {path + "/quadratic_drag"},
            kSmoothForces, [i](FitProblem* one) { one->scene.bodies[i].quadratic_drag = 0.0; });
      }
      if (!body.rolling_friction && num_shapes > 1 && !body.shape.numbers.empty()) {
        Add(path + "/rolling_friction", MissingKind::kForce, {path + "/rolling_friction"}, -1,
            [i](FitProblem* one) { one->scene.bodies[i].rolling_friction = 0.0; });
      }
      if (!body.support && in_plane) {
        Add(path + "/support/friction", MissingKind::kForce, {path + "/support/friction"}, -1,
            [i](FitProblem* one) { one->scene.bodies[i].support.emplace(); });
      }
      AddForceOn(static_cast<int>(i));
    }
    for (size_t i = 0; i < scene.joints.size(); ++i) {
      const BasicJoint<double>& joint = scene.joints[i];
      if (joint.type != JointType::kRevolute && joint.type != JointType::kPrismatic) continue;
      const std::string path = "joints/" + joint.name;
      if (!joint.friction) {
        Add(path + "/friction", MissingKind::kForce, {path + "/friction"}, -1,
            [i](FitProblem* one) { one->scene.joints[i].friction = 0.0; });
      }
      if (!joint.stiffness) {
        Add(path + "/stiffness", MissingKind::kForce, {path + "/stiffness"}, kSmoothForces,
            [i](FitProblem* one) { one->scene.joints[i].stiffness = 0.0; });
      }
    }
  }

  // A constant force and torque.
  void AddForceOn(int body) {
    const std::string name = FreeName("on_" + problem_.scene.bodies[static_cast<size_t>(body)].name,
                                      problem_.scene.forces);
    const auto change = [name, body](FitProblem* one) {
      std::vector<BasicForce<double>>& forces = one->scene.forces;
      if (FreeName(name, forces) != name) return;
      BasicForce<double>& force = forces.emplace_back();
      force.name = name;
      force.body = body;
    };
    const std::string path = "forces/" + name;
    Add(path + "/force", MissingKind::kForce, {path + "/force/x", path + "/force/y"}, kSmoothForces,
        change);
    Add(path + "/torque", MissingKind::kForce, {path + "/torque"}, kSmoothForces, change);
  }

  void AddInstruments();
  void AddSensors(std::vector<std::string>* delayed);
  void AddMarkers();
  void AddSofterJoints();
  void AddHingeInPlaceOf(size_t joint);
  void AddElasticPivot(size_t joint);

  const FitProblem& problem_;
  int most_;
  std::vector<MissingCandidate> all_;
};

/// Gives each channel without a clock this one, and each that sees positions without a camera that
/// one.
void GiveInstruments(const std::string& clock, const std::string& camera, double radius,
                     FitProblem* problem) {
  if (problem->channels.empty()) problem->channels.emplace_back();
  Instruments& instruments = problem->instruments;
  for (Camera& old : instruments.cameras) {
    if (!(old.radial_length > 0.0)) old.radial_length = radius / old.scale;
  }
  int new_clock = -1, new_camera = -1;
  std::vector<bool> seen(problem->channels.size(), false);
  for (const Observation& one : problem->observations) {
    if (one.body >= 0 && IsSeen(one.coordinate)) seen[static_cast<size_t>(one.channel)] = true;
  }
  for (size_t i = 0; i < problem->channels.size(); ++i) {
    Channel& channel = problem->channels[i];
    if (channel.clock < 0) {
      if (new_clock < 0) {
        new_clock = static_cast<int>(instruments.clocks.size());
        instruments.clocks.push_back({clock});
      }
      channel.clock = new_clock;
    }
    if (channel.camera < 0 && seen[i]) {
      if (new_camera < 0) {
        new_camera = static_cast<int>(instruments.cameras.size());
        instruments.cameras.emplace_back().name = camera;
        instruments.cameras.back().radial_length = radius;
      }
      channel.camera = new_camera;
    }
  }
}

/// The name of the sensor of a series without one: "x", "angle_of_bob".
std::string SensorName(const FitProblem& problem, const Observation& one) {
  if (one.body < 0 || IsPosition(one.coordinate)) return NameOf(one.coordinate);
  return std::string(NameOf(one.coordinate)) + "_of_" +
         problem.scene.bodies[static_cast<size_t>(one.body)].name;
}

/// Gives each observation without a sensor one of its own coordinate.
void GiveSensors(FitProblem* problem) {
  if (problem->channels.empty()) problem->channels.emplace_back();
  std::map<std::pair<int, std::string>, int> channels;
  std::map<std::string, int> sensors;
  for (Observation& one : problem->observations) {
    if (problem->channels[static_cast<size_t>(one.channel)].sensor >= 0) continue;
    const std::string name = SensorName(*problem, one);
    const auto [sensor, is_new] =
        sensors.emplace(name, static_cast<int>(problem->instruments.sensors.size()));
    if (is_new) {
      problem->instruments.sensors.emplace_back().name =
          FreeName(name, problem->instruments.sensors);
    }
    const auto [channel, added] =
        channels.emplace(std::pair(one.channel, name), static_cast<int>(problem->channels.size()));
    if (added) {
      Channel with = problem->channels[static_cast<size_t>(one.channel)];
      with.sensor = sensor->second;
      problem->channels.push_back(with);
    }
    one.channel = channel->second;
  }
}

/// The largest distance from the origin of the recorded positions, in their units.
double RadiusOf(const FitProblem& problem) {
  double radius = 0.0;
  for (const Observation& one : problem.observations) {
    if (IsPosition(one.coordinate)) radius = std::max(radius, std::abs(one.value));
  }
  return radius > 0.0 ? radius : kNoRadius;
}

void CandidateList::AddInstruments() {
  const std::string clock = FreeName("clock", problem_.instruments.clocks);
  const std::string camera = FreeName("camera", problem_.instruments.cameras);
  const double radius = RadiusOf(problem_);
  FitProblem with = problem_;
  GiveInstruments(clock, camera, radius, &with);
  const auto give = [clock, camera, radius](FitProblem* one) {
    GiveInstruments(clock, camera, radius, one);
  };
  const bool forces = std::any_of(problem_.observations.begin(), problem_.observations.end(),
                                  [](const Observation& one) { return IsForce(one.coordinate); });
  const auto add = [&](const std::string& path) {
    if (!IsSet(problem_, path)) Add(path, MissingKind::kInstrument, {path}, kNewInstruments, give);
  };
  if (with.instruments.clocks.size() > problem_.instruments.clocks.size() && !forces) {
    add("clocks/" + clock + "/rate");
    add("clocks/" + clock + "/offset");
  }
  for (size_t i = 0; i < with.instruments.cameras.size(); ++i) {
    const Camera& one = with.instruments.cameras[i];
    const std::string path = "cameras/" + one.name + "/";
    const bool is_new = i >= problem_.instruments.cameras.size();
    for (const char* key : {"scale", "rotation", "origin/x", "origin/y", "aspect"}) {
      if (is_new) add(path + key);
    }
    // Along y the pixels differ where both do.
    if (is_new) {
      Add(path + "aspect with scale", MissingKind::kInstrument, {path + "aspect", path + "scale"},
          -1, give);
    }
    if (is_new || !(problem_.instruments.cameras[i].radial_length > 0.0)) add(path + "radial");
  }
  FitProblem sensed = problem_;
  GiveSensors(&sensed);
  for (size_t i = problem_.instruments.sensors.size(); i < sensed.instruments.sensors.size(); ++i) {
    const std::string& name = sensed.instruments.sensors[i].name;
    const bool of_body = name.find("_of_") != std::string::npos;
    for (const char* key : {"gain", "bias", "delay"}) {
      // What all sensors show later is the clock's offset.
      if (std::string(key) == "delay" && (!of_body || forces)) continue;
      const std::string path = "sensors/" + name + "/" + key;
      Add(path, MissingKind::kInstrument, {path}, kNewInstruments, GiveSensors);
    }
  }
}

void CandidateList::AddMarkers() {
  std::set<int> bodies;
  for (const Observation& one : problem_.observations) {
    if (one.body >= 0 && one.point < 0 && IsPosition(one.coordinate)) bodies.insert(one.body);
  }
  for (const int body : bodies) {
    const std::string& of = problem_.scene.bodies[static_cast<size_t>(body)].name;
    const std::string name = FreeName("marker_of_" + of, problem_.points);
    const std::string path = "points/" + name + "/at";
    Add(path, MissingKind::kMarker, {path + "/x", path + "/y"}, kNewInstruments,
        [body, name](FitProblem* one) {
          const auto has = [&](const BodyPoint& point) { return point.name == name; };
          if (std::any_of(one->points.begin(), one->points.end(), has)) return;
          const int point = static_cast<int>(one->points.size());
          one->points.push_back({name, body});
          for (Observation& row : one->observations) {
            if (row.body == body && row.point < 0 && row.event < 0) row.point = point;
          }
        });
  }
}

/// What resists a turn of a joint's bodies about its anchor, or a motion of the anchor: the smaller
/// one of its bodies.
double ResistanceOf(const Scene& scene, const BasicJoint<double>& joint, bool turns) {
  double least = HUGE_VAL;
  for (const int index : joint.bodies) {
    if (index < 0 || scene.bodies[static_cast<size_t>(index)].motion != Motion::kMoving) continue;
    const BasicBody<double>& body = scene.bodies[static_cast<size_t>(index)];
    const double distance = (body.position - joint.anchors[0]).norm();
    // Without an inertia of its own the body is about as large as the distance.
    const double inertia = body.inertia.value_or(body.mass * distance * distance / 3.0);
    const double about = inertia + body.mass * distance * distance;
    least = std::min(least, turns ? about : body.mass);
  }
  return least;
}

/// Stiffness and damping of joints made softer, from the stiffest on.
std::vector<Eigen::VectorXd> SoftTries(double resistance, double dt) {
  std::vector<Eigen::VectorXd> tries;
  double frequency = kStiffest / dt;
  for (int i = 0; i < kSoftTries; ++i, frequency /= kSofter) {
    tries.push_back(Eigen::Vector2d(resistance * frequency * frequency,
                                    2.0 * kSoftDamping * resistance * frequency));
  }
  return tries;
}

FitParameter Logarithmic(const std::string& name, const std::string& path, double initial) {
  FitParameter parameter = AtPath(path);
  parameter.name = name;
  parameter.initial = initial;
  parameter.scale = ParameterScale::kLogarithmic;
  return parameter;
}

void CandidateList::AddSofterJoints() {
  const Scene& scene = problem_.scene;
  for (size_t i = 0; i < scene.joints.size(); ++i) {
    const BasicJoint<double>& joint = scene.joints[i];
    if (!std::isfinite(ResistanceOf(scene, joint, true))) continue;
    if (joint.type == JointType::kWeld) AddHingeInPlaceOf(i);
    const auto is_fixed = [&](int body) {
      return body < 0 || scene.bodies[static_cast<size_t>(body)].motion == Motion::kStatic;
    };
    if (joint.type == JointType::kRevolute &&
        is_fixed(joint.bodies[0]) != is_fixed(joint.bodies[1])) {
      AddElasticPivot(i);
    }
  }
}

void CandidateList::AddHingeInPlaceOf(size_t index) {
  const BasicJoint<double>& joint = problem_.scene.joints[index];
  MissingCandidate& one = all_.emplace_back();
  one.name = "joints/" + joint.name + " as a hinge with stiffness";
  one.kind = MissingKind::kJoint;
  one.tries = SoftTries(ResistanceOf(problem_.scene, joint, true), problem_.scene.simulation.dt);
  const std::string path = "joints/" + joint.name;
  one.parameters = {Logarithmic(path + "/stiffness", path + "/stiffness", one.tries[0][0]),
                    Logarithmic(path + "/damping", path + "/damping", one.tries[0][1])};
  // What may turn does not start as drawn, unless others say how it starts.
  if (ClassifyJoints(problem_.scene)[index] == JointPlace::kTree) {
    for (const char* key : {"/angle", "/rate"}) one.parameters.push_back(AtPath(path + key));
    for (Eigen::VectorXd& values : one.tries) {
      values.conservativeResize(4);
      values.tail<2>().setZero();
    }
  }
  one.change = [index](FitProblem* problem) {
    BasicJoint<double>& weld = problem->scene.joints[index];
    weld.type = JointType::kRevolute;
    weld.stiffness = 0.0;
  };
}

// The anchor is that of a light body which does not turn and is held in its place by a servo.
void CandidateList::AddElasticPivot(size_t index) {
  const Scene& scene = problem_.scene;
  const BasicJoint<double>& joint = scene.joints[index];
  MissingCandidate& one = all_.emplace_back();
  one.name = "joints/" + joint.name + " as an elastic pivot";
  one.kind = MissingKind::kJoint;
  const double mass = ResistanceOf(scene, joint, false);
  one.tries = SoftTries(mass, scene.simulation.dt);
  const std::string body = FreeName("carrier_of_" + joint.name, scene.bodies);
  const std::string force = FreeName("support_of_" + joint.name, scene.forces);
  const std::string keep = FreeName("guide_of_" + joint.name, scene.joints);
  const std::string path = "forces/" + force + "/force/*/";
  one.parameters = {Logarithmic("joints/" + joint.name + " stiffness of the pivot",
                                path + "stiffness", one.tries[0][0]),
                    Logarithmic("joints/" + joint.name + " damping of the pivot", path + "damping",
                                one.tries[0][1])};
  one.change = [index, mass, body, force, keep](FitProblem* problem) {
    Scene& soft = problem->scene;
    const int at = static_cast<int>(soft.bodies.size());
    BasicJoint<double>& pivot = soft.joints[index];
    BasicBody<double>& carrier = soft.bodies.emplace_back();
    carrier.name = body;
    carrier.mass = kCarrierMass * mass;
    carrier.inertia = 1.0;
    carrier.position = pivot.anchors[0];
    BasicForce<double>& support = soft.forces.emplace_back();
    support.name = force;
    support.body = at;
    for (int axis = 0; axis < 2; ++axis) {
      support.force_servos[axis].emplace().target = carrier.position[axis];
    }
    BasicJoint<double> guide;
    guide.name = keep;
    guide.type = JointType::kFixedAngle;
    guide.bodies[0] = at;
    for (int& side : pivot.bodies) {
      const bool fixed =
          side < 0 || soft.bodies[static_cast<size_t>(side)].motion == Motion::kStatic;
      if (fixed) side = at;
    }
    soft.joints.push_back(guide);
  };
}

}  // namespace

const char* NameOf(MissingKind kind) {
  switch (kind) {
    case MissingKind::kNumber:
      return "number";
    case MissingKind::kForce:
      return "force";
    case MissingKind::kInstrument:
      return "instrument";
    case MissingKind::kMarker:
      return "marker";
    case MissingKind::kJoint:
      return "joint";
  }
  return "";
}

std::vector<MissingCandidate> FindMissingCandidates(const FitProblem& fitted, int most) {
  return CandidateList(fitted, most).List();
}

}  // namespace tangible
