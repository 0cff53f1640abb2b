// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/tradeoff/sweep.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tangible/dynamics/model/model.h"
#include "tangible/dynamics/model/settings.h"
#include "tangible/scene/scene_names.h"

namespace tangible::tradeoff {
namespace {

constexpr double kCoarseTolerance = 1e-6;

// Whether a step may have complementarity rows.
bool MayTouch(const ModelStructure& structure) {
  for (const JointIndex& joint : structure.joints) {
    if (joint.HasLimits()) return true;
  }
  for (int i = 0; i < structure.world(); ++i) {
    for (int j = i + 1; j < structure.world(); ++j) {
      if (structure.MayCollide(i, j)) return true;
    }
  }
  return false;
}

void AddOnce(const std::string& line, std::vector<std::string>* lines) {
  if (std::find(lines->begin(), lines->end(), line) == lines->end()) lines->push_back(line);
}

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%g", value);
  return text;
}

// Adds the scene's settings, or says why not.
void Add(const Scene& scene, Sweep* sweep) {
  const SimulationSettings& settings = scene.simulation;
  std::string why;
  if (!CheckSettings(scene, &why)) {
    AddOnce(NameOf(settings.stepping, kSteppingNames) + " stepping with " +
                NameOf(IntegratorOf(settings), kIntegratorNames) + ": " + why,
            &sweep->left_out);
  } else {
    sweep->settings.push_back(settings);
  }
}

}  // namespace

Sweep MakeSweep(const Scene& scene, SweepKind kind) {
  const SimulationSettings& own = scene.simulation;
  const bool touches = MayTouch(*BuildStructure(scene));
  std::vector<double> tolerances = {own.lcp_tolerance};
  if (touches && own.lcp_tolerance != kCoarseTolerance) tolerances.push_back(kCoarseTolerance);
  Sweep sweep;
  Scene with = scene;
  for (const auto& stepping : kSteppingNames) {
    for (const auto& integrator : kIntegratorNames) {
      for (const auto& correction : kJointCorrectionNames) {
        const bool own_correction = correction.second == JointCorrectionOf(own);
        if (scene.joints.empty() && !own_correction) continue;
        for (const double tolerance : tolerances) {
          const bool own_tolerance = tolerance == own.lcp_tolerance;
          if (!own_tolerance && !own_correction && kind == SweepKind::kStar) continue;
          SimulationSettings& settings = with.simulation;
          settings.stepping = stepping.second;
          settings.integrator = integrator.second;
          settings.joint_correction = correction.second;
          settings.lcp_tolerance = tolerance;
          Add(with, &sweep);
        }
      }
    }
  }
  if (scene.joints.empty()) sweep.left_out.push_back("joint corrections: the scene has no joints");
  if (!touches) {
    sweep.left_out.push_back("tolerances: nothing may touch and no joint has limits");
  }
  return sweep;
}

std::vector<double> StepLengths(const SimulationSettings& settings, int samples,
                                const std::vector<double>& factors) {
  std::vector<double> lengths;
  for (const double factor : factors) {
    const double fit = settings.duration / (samples * settings.dt * factor);
    const double steps = samples * std::max(1.0, std::round(fit));
    lengths.push_back(settings.duration / steps);
  }
  std::sort(lengths.begin(), lengths.end(), std::greater<>());
  lengths.erase(std::unique(lengths.begin(), lengths.end()), lengths.end());
  return lengths;
}

std::string NameOf(const SimulationSettings& settings, const SimulationSettings& of_scene) {
  std::string name = NameOf(settings.stepping, kSteppingNames) + " " +
                     NameOf(IntegratorOf(settings), kIntegratorNames) + ", " +
                     NameOf(JointCorrectionOf(settings), kJointCorrectionNames);
  if (settings.lcp_tolerance != of_scene.lcp_tolerance) {
    name += ", tolerance " + Number(settings.lcp_tolerance);
  }
  return name;
}

std::vector<ParameterPath> DefaultParameters(const Scene& scene) {
  std::vector<std::string> wanted = {"gravity/y", "bodies/*/mass", "bodies/*/friction",
                                     "bodies/*/restitution"};
  for (const auto& body : scene.bodies) {
    if (body.motion != Motion::kMoving) continue;
    wanted.push_back("bodies/" + body.name + "/velocity/x");
    break;
  }
  if (!scene.joints.empty()) wanted.back() = "joints/" + scene.joints[0].name + "/angle";
  std::vector<ParameterPath> found;
  for (const std::string& path : wanted) {
    ParameterPath parameter;
    std::string none;
    if (ResolveParameter(scene, path, &parameter, &none)) found.push_back(std::move(parameter));
  }
  return found;
}

}  // namespace tangible::tradeoff
