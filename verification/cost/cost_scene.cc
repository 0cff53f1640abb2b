// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/cost_scene.h"

#include <algorithm>

namespace tangible::cost {
namespace {

constexpr int kLinks = 10;
constexpr double kLength = 0.3;
constexpr double kHalfWidth = 0.03;
constexpr double kRadius = 0.1;
constexpr double kTop = 4.0;
constexpr double kStep = 0.002;

BasicBody<double> Body(const std::string& name, const BasicShape<double>& shape, double inertia) {
  BasicBody<double> body;
  body.name = name;
  body.shape = shape;
  body.mass = 1.0;
  body.inertia = inertia;  // written out, so that it is a separate number
  body.friction = 0.3;
  body.restitution = 0.5;
  return body;
}

// "bodies/link3/mass": "mass"; "joints/pin3/anchor/x": "anchor/x".
std::string Attribute(const std::string& path) {
  const size_t second = path.find('/', path.find('/') + 1);
  return second == std::string::npos ? path : path.substr(second + 1);
}

// Sorts numbers of one attribute together, the usual parameters first.
int Rank(const std::string& path) {
  if (path == "bodies/ball/velocity/x") {
    return -1;  // the only one that matters before the ball hits the chain
  }
  static const char* const kFirst[] = {"mass",       "friction",   "restitution", "velocity/x",
                                       "velocity/y", "position/x", "position/y",  "angle"};
  const std::string attribute = Attribute(path);
  int rank = 0;
  for (const char* first : kFirst) {
    if (path.rfind("bodies/", 0) == 0 && attribute == first) {
      return rank;
    }
    ++rank;
  }
  return rank;
}

std::vector<std::string> AllPaths(Scene scene) {
  std::vector<std::string> paths;
  for (const SceneNumber<double>& number : EnumerateNumbers(&scene)) {
    paths.push_back(number.path);
  }
  std::stable_sort(paths.begin(), paths.end(),
                   [](const std::string& x, const std::string& y) { return Rank(x) < Rank(y); });
  return paths;
}

// Patterns for every attribute of bodies and joints, each once.
std::vector<std::string> Patterns(const std::vector<std::string>& paths) {
  std::vector<std::string> patterns;
  for (const char* kind : {"bodies/*/", "bodies/link*/", "joints/*/"}) {
    const std::string start(kind, std::string(kind).find('/') + 1);
    for (const std::string& path : paths) {
      const std::string pattern = kind + Attribute(path);
      const bool known = std::find(patterns.begin(), patterns.end(), pattern) != patterns.end();
      // Only some bodies have radii and sizes; their pattern would match the same as a single
      // number or as that of all links.
      const bool shape = Attribute(path).rfind("shape/", 0) == 0;
      if (path.rfind(start, 0) == 0 && !known && !shape) {
        patterns.push_back(pattern);
      }
    }
  }
  return patterns;
}

}  // namespace

Scene ChainAndBall(long steps, Stepping stepping) {
  Scene scene;
  scene.name = "chain and ball";
  for (int i = 0; i < kLinks; ++i) {
    const double width = 2.0 * kHalfWidth;
    BasicBody<double> link = Body("link" + std::to_string(i), {ShapeType::kBox, {width, kLength}},
                                  (width * width + kLength * kLength) / 12.0);
    link.position = {0.0, kTop - kLength * (i + 0.5)};
    scene.bodies.push_back(link);
    BasicJoint<double> pin;
    pin.name = "pin" + std::to_string(i);
    pin.bodies[0] = i;
    pin.bodies[1] = i - 1;
    pin.anchors[0] = pin.anchors[1] = {0.0, kTop - kLength * i};
    scene.joints.push_back(pin);
  }
  BasicBody<double> ball = Body("ball", {ShapeType::kCircle, {kRadius}}, 0.5 * kRadius * kRadius);
  ball.position = {-0.8, 2.2};
  ball.velocity = {4.0, 0.0};
  scene.bodies.push_back(ball);
  scene.no_contact.emplace_back("link*", "link*");
  scene.simulation.dt = kStep;
  scene.simulation.duration = kStep * static_cast<double>(steps);
  // The settings are written out, so that the timed scene does not depend on defaults.
  scene.simulation.stepping = stepping;
  scene.simulation.integrator =
      stepping == Stepping::kEvent ? Integrator::kRungeKutta4 : Integrator::kSemiImplicitEuler;
  scene.simulation.joint_correction = JointCorrection::kNone;
  return scene;
}

int NumNumbers(const Scene& scene) { return static_cast<int>(AllPaths(scene).size()); }

std::vector<ParameterPath> CostParameters(const Scene& scene, int count) {
  std::vector<std::string> paths = AllPaths(scene);
  const std::vector<std::string> patterns = Patterns(paths);
  paths.insert(paths.end(), patterns.begin(), patterns.end());
  std::vector<ParameterPath> parameters;
  for (size_t k = 0; k < paths.size() && static_cast<int>(parameters.size()) < count; ++k) {
    ParameterPath path;
    std::string error;
    if (ResolveParameter(scene, paths[k], &path, &error)) {
      parameters.push_back(std::move(path));
    }
  }
  for (size_t k = 0; !parameters.empty() && static_cast<int>(parameters.size()) < count; ++k) {
    parameters.push_back(ParameterPath(parameters[k]));
  }
  return parameters;
}

}  // namespace tangible::cost
