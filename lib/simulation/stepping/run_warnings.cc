// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/run_warnings.h"

#include <cmath>
#include <cstdio>
#include <utility>

#include "tangible/simulation/stepping/energy_watch.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {
namespace {

double Energy(const Model<double>& model, const State<double>& state) {
  return KineticEnergy(model, state) + PotentialEnergy(model, state);
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

std::string EnergyGrown(const Model<double>& model, const RolloutReport& report,
                        const State<double>& initial, const State<double>& final) {
  if (model.structure->settings.stepping != Stepping::kEvent || IsDriven(model, initial)) {
    return "";
  }
  const double growth = Energy(model, final) - Energy(model, initial);
  const double kinetic = KineticEnergy(model, initial) + KineticEnergy(model, final);
  // Newton's law with friction may gain energy, and recovery from penetration lifts bodies.
  const double by_impacts = static_cast<double>(report.events) * report.impact_energy_gain_max;
  double weight = 0.0;
  for (const int body : model.structure->moving) {
    weight += model.parameters[model.structure->bodies[body].mass] *
              std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]);
  }
  if (!(growth > kEnergyGrowth * kinetic + by_impacts + 2.0 * weight * report.penetration_max)) {
    return "";
  }
  char text[320];
  std::snprintf(text, sizeof text,
                "the energy grew from %.4g J to %.4g J, though nothing drives the scene: expected "
                "a smaller \"dt\" in \"simulation\", which follows the motion (a slender body that "
                "rolls over its tip, a stiff spring), got %g s",
                Energy(model, initial), Energy(model, final), model.structure->settings.dt);
  return text;
}

std::vector<std::string> RunWarnings::Finish(const Model<double>& model,
                                             const RolloutReport& report,
                                             const State<double>& final) {
  if (joints_.watches()) joints_.Look(model, final, report.time);
  coordinates_.LookAtBodies(model, final, report.time);
  std::vector<std::string> lines;
  std::string energy = FirstOrderByEvents(model, initial_, final);
  if (energy.empty() && !is_controlled_) energy = EnergyGrown(model, report, initial_, final);
  for (std::string line :
       {coordinates_.Message(model), joints_.Message(model), std::move(energy)}) {
    if (!line.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace tangible
