// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/run_warnings.h"

#include <cstdio>
#include <utility>

#include "tangible/geometry/tolerances.h"
#include "tangible/simulation/stepping/energy_watch.h"
#include "tangible/simulation/stepping/invariants.h"

namespace tangible {
namespace {

double Energy(const Model<double>& model, const State<double>& state) {
  return KineticEnergy(model, state) + PotentialEnergy(model, state);
}

// Empty, or the line that says which steps between bodies at rest count as flush.
std::string FlushStepsMessage(const Model<double>& model) {
  if (model.seams == nullptr || model.seams->steps.count == 0) return "";
  char text[192];
  std::snprintf(text, sizeof text,
                "%d steps of at most %.3g m between faces of static bodies count as flush (up to "
                "%.0e m): what goes over them moves as on one face",
                model.seams->steps.count, model.seams->steps.highest, kFlushStep);
  return text;
}

}  // namespace

std::string FirstOrderByEvents(const Model<double>& model, const State<double>& initial,
                               const State<double>& final) {
  const SimulationSettings& settings = model.structure->settings;
  if (settings.stepping != Stepping::kEvent ||
      IntegratorOf(settings) != Integrator::kSemiImplicitEuler) {
    return "";
  }
  char text[320];
  std::snprintf(text, sizeof text,
                "semi_implicit_euler with event stepping is of first order, and its error of the "
                "energy grows with the run (here from %.4g J to %.4g J): expected \"integrator\": "
                "\"runge_kutta_4\" in \"simulation\", the default, which is of fourth order",
                Energy(model, initial), Energy(model, final));
  return text;
}

std::vector<std::string> RunWarnings::Finish(const Model<double>& model,
                                             const RolloutReport& report,
                                             const State<double>& final) {
  if (joints_.watches()) joints_.Look(model, final, report.time);
  coordinates_.LookAtBodies(model, final, report.time);
  std::vector<std::string> lines;
  std::string energy = FirstOrderByEvents(model, initial_, final);
  if (energy.empty()) energy = report.energy_grown;
  if (energy.empty()) energy = EnergyOfOverlap(model, initial_, final, report.penetration_max);
  for (std::string line : {coordinates_.Message(model), joints_.Message(model),
                           FlushStepsMessage(model), std::move(energy)}) {
    if (!line.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace tangible
