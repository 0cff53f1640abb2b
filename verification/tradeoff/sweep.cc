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
constexpr double kSmoothings[] = {1e-8, 1e-4};

// Whether a step may have complementarity rows.
bool MayTouch(const ModelStructure& structure) {
  for (const JointIndex& joint : structure.joints) {
    if (joint.low >= 0) return true;
  }
  for (int i = 0; i < structure.world(); ++i) {
    for (int j = i + 1; j < structure.world(); ++j) {
      if (structure.MayCollide(i, j)) return true;
    }
  }
  return false;
}

// How the contacts' problem is solved.
struct Solving {
  SolverChoice solver;
  double tolerance;
  double smoothing;
};

std::vector<Solving> SolvingsOf(const SimulationSettings& own, bool touches, SweepKind kind) {
  const Solving first{own.solver, own.lcp_tolerance, own.smoothing};
  std::vector<Solving> all = {first};
  if (!touches) return all;
  std::vector<SolverChoice> solvers = {own.solver};
  for (const auto& entry : kSolverNames) {
    if (entry.second != own.solver) solvers.push_back(entry.second);
  }
  std::vector<double> tolerances = {own.lcp_tolerance};
  if (own.lcp_tolerance != kCoarseTolerance) tolerances.push_back(kCoarseTolerance);
  std::vector<double> smoothings = {0.0};
  smoothings.insert(smoothings.end(), std::begin(kSmoothings), std::end(kSmoothings));
  if (std::find(smoothings.begin(), smoothings.end(), own.smoothing) == smoothings.end()) {
    smoothings.insert(smoothings.begin(), own.smoothing);
  }
  for (const SolverChoice solver : solvers) {
    for (const double tolerance : tolerances) {
      for (const double smoothing : smoothings) {
        const int differ = (solver != first.solver ? 1 : 0) +
                           (tolerance != first.tolerance ? 1 : 0) +
                           (smoothing != first.smoothing ? 1 : 0);
        if (differ == 1 || (differ > 1 && kind == SweepKind::kFull)) {
          all.push_back({solver, tolerance, smoothing});
        }
      }
    }
  }
  return all;
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
  if (settings.stepping == Stepping::kEvent && settings.smoothing > 0.0) {
    AddOnce("event stepping with smoothing: its impacts are solved exactly", &sweep->left_out);
  } else if (!CheckSettings(scene, &why)) {
    AddOnce(NameOf(settings.stepping, kSteppingNames) + " stepping with " +
                NameOf(IntegratorOf(settings), kIntegratorNames) + ": " + why,
            &sweep->left_out);
  } else if (settings.smoothing > 0.0 && settings.solver == SolverChoice::kLemke) {
    AddOnce("lemke with smoothing: only the interior point stops early", &sweep->left_out);
  } else {
    sweep->settings.push_back(settings);
  }
}

}  // namespace

Sweep MakeSweep(const Scene& scene, SweepKind kind) {
  const SimulationSettings& own = scene.simulation;
  const bool touches = MayTouch(*BuildStructure(scene));
  Sweep sweep;
  Scene with = scene;
  for (const auto& stepping : kSteppingNames) {
    for (const auto& integrator : kIntegratorNames) {
      for (const auto& correction : kJointCorrectionNames) {
        const bool own_correction = correction.second == JointCorrectionOf(own);
        if (scene.joints.empty() && !own_correction) continue;
        const std::vector<Solving> solvings = SolvingsOf(own, touches, kind);
        for (size_t i = 0; i < solvings.size(); ++i) {
          if (i > 0 && !own_correction && kind == SweepKind::kStar) continue;
          SimulationSettings& settings = with.simulation;
          settings.stepping = stepping.second;
          settings.integrator = integrator.second;
          settings.joint_correction = correction.second;
          settings.solver = solvings[i].solver;
          settings.lcp_tolerance = solvings[i].tolerance;
          settings.smoothing = solvings[i].smoothing;
          Add(with, &sweep);
        }
      }
    }
  }
  if (scene.joints.empty()) sweep.left_out.push_back("joint corrections: the scene has no joints");
  if (!touches) {
    sweep.left_out.push_back(
        "solvers, tolerances and smoothing: nothing may touch and no joint has limits");
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
  if (settings.solver != of_scene.solver) name += ", " + NameOf(settings.solver, kSolverNames);
  if (settings.lcp_tolerance != of_scene.lcp_tolerance) {
    name += ", tolerance " + Number(settings.lcp_tolerance);
  }
  if (settings.smoothing != of_scene.smoothing) {
    name += ", smoothing " + Number(settings.smoothing);
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
