// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/parameter.h"

#include <algorithm>
#include <cmath>

#include "tangible/scene/joint_graph.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/parameter_inl.h"

namespace tangible {
namespace {

std::vector<std::string> Components(const std::string& path) {
  std::vector<std::string> components;
  std::size_t begin = 0;
  while (true) {
    const std::size_t slash = path.find('/', begin);
    components.push_back(path.substr(begin, slash - begin));
    if (slash == std::string::npos) return components;
    begin = slash + 1;
  }
}

std::string ShortList(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 16;
  std::string list;
  for (std::size_t i = 0; i < names.size() && i < kMost; ++i) {
    if (i > 0) list += ", ";
    list += names[i];
  }
  if (names.size() > kMost) list += ", ...";
  return list.empty() ? "none" : list;
}

struct Kind {
  const char* plural;
  const char* singular;
};
constexpr Kind kKinds[] = {{"bodies", "body"},
                           {"joints", "joint"},
                           {"springs", "spring"},
                           {"forces", "force"},
                           {"pairs", "pair"}};

std::vector<std::string> NamesOf(const Scene& scene, const std::string& kind) {
  std::vector<std::string> names;
  const auto add = [&names](const auto& items) {
    for (const auto& item : items) names.push_back(item.name);
  };
  if (kind == "bodies") add(scene.bodies);
  if (kind == "joints") add(scene.joints);
  if (kind == "springs") add(scene.springs);
  if (kind == "forces") add(scene.forces);
  if (kind == "pairs") {
    for (const auto& pair : scene.pairs) names.push_back(pair.bodies[0] + ":" + pair.bodies[1]);
  }
  return names;
}

// Whether a pattern names an item: by its own name, or by `*`.
bool Names(const std::string& pattern, const std::string& name) {
  return pattern == name || MatchesPattern(pattern, name);
}

// The numbers of one item, without its kind and name.
std::vector<std::string> NumbersOf(const std::vector<SceneNumber<double>>& numbers,
                                   const std::string& prefix) {
  std::vector<std::string> names;
  for (const auto& number : numbers) {
    if (number.path.compare(0, prefix.size(), prefix) == 0) {
      names.push_back(number.path.substr(prefix.size()));
    }
  }
  return names;
}

// Why a path matches no number.
std::string ExplainNoMatch(const Scene& scene, const std::vector<SceneNumber<double>>& numbers,
                           const std::string& path) {
  const std::vector<std::string> parts = Components(path);
  if (parts[0] == "gravity") return "expected gravity/x or gravity/y";
  if (parts[0] == "simulation") {
    return "the numbers of simulation are no parameters, expected gravity, bodies, joints, "
           "springs, forces or pairs";
  }
  const Kind* kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                  [&parts](const Kind& k) { return parts[0] == k.plural; });
  if (kind == std::end(kKinds)) {
    return "matches no number of the scene, expected a path that starts with gravity, bodies, "
           "joints, springs, forces or pairs, got " +
           Describe(Json(parts[0]));
  }
  const std::vector<std::string> names = NamesOf(scene, parts[0]);
  const std::string have = parts[0] + " are: " + ShortList(names);
  if (parts.size() < 2) return "matches no number of the scene; " + have;
  for (const std::string& name : names) {
    if (!Names(parts[1], name)) continue;
    const std::string number =
        path.substr(std::min(path.size(), parts[0].size() + parts[1].size() + 2));
    const std::string prefix = parts[0] + "/" + name + "/";
    return std::string("matches no number of the scene: ") + kind->singular + " " + name +
           " has no number " + Describe(Json(number)) +
           "; it has: " + ShortList(NumbersOf(numbers, prefix));
  }
  return "matches no number of the scene; " + have;
}

// Numbers that a path names and that the scene has, but that are not parameters. Empty if it names
// none of them. This is checked even where a `*` matches others, because silently leaving some out
// would give the derivative of something else.
std::string ExplainNoParameter(const Scene& scene, const std::string& path) {
  for (const auto& body : scene.bodies) {
    if (body.motion != Motion::kMoving || body.inertia) continue;
    if (!MatchesPath(path, "bodies/" + body.name + "/inertia")) continue;
    // `bodies/ball/*` names all numbers that exist.
    if (Components(path).back() == "*") continue;
    return "body " + body.name +
           " has no inertia of its own: it follows mass and shape; write \"inertia\" in the scene "
           "to make it a parameter";
  }
  for (const auto& body : scene.bodies) {
    if (!body.support || body.support->load || Components(path).back() == "*") continue;
    if (!MatchesPath(path, "bodies/" + body.name + "/support/load")) continue;
    return "the support of body " + body.name +
           " has no load of its own: it is mass * 9.81; write \"load\" in the scene to make it a "
           "parameter";
  }
  const std::vector<JointPlace> places = ClassifyJoints(scene);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& joint = scene.joints[i];
    const bool prismatic = joint.type == JointType::kPrismatic;
    if (places[i] == JointPlace::kTree || Components(path).back() == "*") continue;
    if (!prismatic && joint.type != JointType::kRevolute) continue;
    const std::string prefix = "joints/" + joint.name;
    if (!MatchesPath(path, prefix + (prismatic ? "/displacement" : "/angle")) &&
        !MatchesPath(path, prefix + "/rate")) {
      continue;
    }
    if (places[i] == JointPlace::kLoop) {
      return "joint " + joint.name +
             " is part of a closed loop, which cannot be turned at one joint; use the positions, "
             "angles and velocities of its bodies";
    }
    return "the first body of joint " + joint.name +
           " is attached to the world, which cannot be turned; swap the joint's two bodies";
  }
  return "";
}

// Typical magnitudes of the scene, from which those of all dimensions follow.
struct Magnitudes {
  double length = 0.0;
  double mass = 0.0;
  double gravity = 0.0;
  double duration = 0.0;
};

double SizeOf(const BasicShape<double>& shape) {
  switch (shape.type) {
    case ShapeType::kNone:
    case ShapeType::kHalfPlane:
      return 0.0;
    case ShapeType::kCircle:
      return 2.0 * shape.numbers[0];
    case ShapeType::kEllipse:
      return 2.0 * std::max(shape.numbers[0], shape.numbers[1]);
    case ShapeType::kCapsule:
      return shape.numbers[0] + 2.0 * shape.numbers[1];
    case ShapeType::kBox:
    case ShapeType::kPolygon:
    case ShapeType::kPolyline:
    case ShapeType::kSpline:
      break;
  }
  double size = 0.0;
  for (const double number : shape.numbers) size = std::max(size, std::abs(number));
  return size;
}

Magnitudes MagnitudesOf(const Scene& scene) {
  Magnitudes result;
  for (const auto& body : scene.bodies) {
    result.length = std::max(result.length, SizeOf(body.shape));
    for (const auto& point : body.contact_points) {
      result.length = std::max(result.length, point.norm());
    }
    if (body.motion == Motion::kMoving) result.mass = std::max(result.mass, body.mass);
  }
  result.gravity = scene.gravity.norm();
  result.duration = scene.simulation.duration;
  for (double* value : {&result.length, &result.mass, &result.gravity, &result.duration}) {
    if (!(*value > 0.0)) *value = 1.0;
  }
  return result;
}

double ScaleOf(Dimension dimension, const Magnitudes& of) {
  switch (dimension) {
    case Dimension::kNone:
    case Dimension::kAngle:
    case Dimension::kAngularVelocity:
      return 1.0;
    case Dimension::kLength:
    case Dimension::kVelocity:
      return of.length;
    case Dimension::kTime:
      return of.duration;
    case Dimension::kAcceleration:
      return of.gravity;
    case Dimension::kMass:
    case Dimension::kStiffness:
    case Dimension::kLinearDamping:
      return of.mass;
    case Dimension::kInertia:
    case Dimension::kAngularDamping:
      return of.mass * of.length * of.length;
    case Dimension::kQuadraticDrag:
      return of.mass / of.length;
    case Dimension::kForce:
      return of.mass * of.gravity;
    case Dimension::kTorque:
    case Dimension::kAngularStiffness:
      return of.mass * of.gravity * of.length;
  }
  return 1.0;
}

double ScaleOf(const SceneNumber<double>& number, const Magnitudes& of) {
  const bool bounded =
      number.kind == NumberKind::kPositive ||
      (number.kind == NumberKind::kNonNegative && number.dimension != Dimension::kNone);
  if (bounded && *number.value > 0.0) return *number.value;
  return ScaleOf(number.dimension, of);
}

// How restrictive a kind is; a parameter has the most restrictive kind of its numbers.
int Restriction(NumberKind kind) {
  switch (kind) {
    case NumberKind::kFree:
      return 0;
    case NumberKind::kNonNegative:
      return 1;
    case NumberKind::kPositive:
      return 2;
    case NumberKind::kFraction:
      return 3;
  }
  return 0;
}

std::vector<int> MatchingNumbers(const std::vector<SceneNumber<double>>& numbers,
                                 const std::string& path) {
  std::vector<int> matching;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i].path == path) return {static_cast<int>(i)};
    if (MatchesPath(path, numbers[i].path)) matching.push_back(static_cast<int>(i));
  }
  return matching;
}

}  // namespace

const char* UnitOf(Dimension dimension) {
  switch (dimension) {
    case Dimension::kNone:
      return "1";
    case Dimension::kLength:
      return "m";
    case Dimension::kAngle:
      return "rad";
    case Dimension::kTime:
      return "s";
    case Dimension::kVelocity:
      return "m/s";
    case Dimension::kAngularVelocity:
      return "rad/s";
    case Dimension::kAcceleration:
      return "m/s^2";
    case Dimension::kMass:
      return "kg";
    case Dimension::kInertia:
      return "kg m^2";
    case Dimension::kForce:
      return "N";
    case Dimension::kTorque:
      return "N m";
    case Dimension::kStiffness:
      return "N/m";
    case Dimension::kLinearDamping:
      return "N s/m";
    case Dimension::kAngularDamping:
      return "N m s";
    case Dimension::kQuadraticDrag:
      return "N s^2/m^2";
    case Dimension::kAngularStiffness:
      return "N m/rad";
  }
  return "1";
}

bool ResolveParameter(const Scene& scene, const std::string& path, ParameterPath* parameter,
                      std::string* error) {
  Scene copy = scene;  // EnumerateNumbers gives mutable pointers
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&copy);
  ParameterPath result;
  result.path = path;
  result.numbers = MatchingNumbers(numbers, path);
  std::string problem = ExplainNoParameter(scene, path);
  if (problem.empty() && result.numbers.empty()) problem = ExplainNoMatch(scene, numbers, path);
  if (!problem.empty()) {
    *error = OneLine("parameter " + path + ": " + problem);
    return false;
  }
  const Magnitudes magnitudes = MagnitudesOf(scene);
  const SceneNumber<double>& first = numbers[result.numbers.front()];
  result.dimension = first.dimension;
  result.value = *first.value;
  result.scale = ScaleOf(first, magnitudes);
  for (const int i : result.numbers) {
    result.scale = std::min(result.scale, ScaleOf(numbers[i], magnitudes));
    if (Restriction(numbers[i].kind) > Restriction(result.kind)) result.kind = numbers[i].kind;
  }
  *parameter = result;
  return true;
}

template std::vector<SceneNumber<double>> EnumerateNumbers(BasicScene<double>* scene);
template BasicScene<double> CastScene(const Scene& scene);
#define TANGIBLE_INSTANTIATE(N)                                                          \
  template std::vector<SceneNumber<Jet<N>>> EnumerateNumbers(BasicScene<Jet<N>>* scene); \
  template BasicScene<Jet<N>> CastScene(const Scene& scene);
TANGIBLE_FOR_EACH_JET_WIDTH_AND_LOCAL(TANGIBLE_INSTANTIATE)
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
