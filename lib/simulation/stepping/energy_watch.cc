// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/energy_watch.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/dynamics/model/tolerances.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {
namespace {

// Far more than the energy that impacts by Newton's law with friction, corrections of drift and
// coarse steps add.
constexpr double kExploded = 1e4;
// Of the radius of the smallest body: bodies that overlap by more do so from the start.
constexpr double kDeep = 0.5;

}  // namespace

bool IsDriven(const Model<double>& model, const State<double>& state) {
  const ModelStructure& s = *model.structure;
  if (!s.forces.empty() || !s.paths.empty() || !s.servos.empty()) {
    return true;
  }
  for (const JointIndex& joint : s.joints) {
    if (joint.motor >= 0 && model.parameters[joint.motor] != 0.0) return true;
    if (joint.effort_signal >= 0 || (joint.effort >= 0 && model.parameters[joint.effort] != 0.0)) {
      return true;
    }
  }
  for (int body = 0; body < s.num_bodies(); ++body) {
    const double* v = &state.twist[3 * body];
    if (s.bodies[body].block < 0 && (v[0] != 0.0 || v[1] != 0.0 || v[2] != 0.0)) {
      return true;
    }
  }
  return false;
}

EnergyWatch::EnergyWatch(const Model<double>& model, const State<double>& initial) {
  const ModelStructure& s = *model.structure;
  if (IsDriven(model, initial)) {
    return;
  }
  const double kinetic = KineticEnergy(model, initial);
  start_ = kinetic + PotentialEnergy(model, initial);
  // The energy that is available: motion, springs, the fall over the range of the bodies'
  // positions, recovery from penetration.
  const double g = std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]);
  double scale = kinetic;
  for (const int body : s.moving) {
    const double mass = model.parameters[s.bodies[body].mass];
    const double place = std::hypot(initial.pose[3 * body], initial.pose[3 * body + 1]);
    const double fall = g * s.settings.duration * s.settings.duration;
    scale += mass * (g * (place + fall) + s.settings.recovery_speed * s.settings.recovery_speed);
  }
  scale += std::abs(start_);
  allowed_ = kExploded * scale;
  watches_ = std::isfinite(start_) && std::isfinite(allowed_);
}

std::string EnergyWatch::Exploded(const Model<double>& model, const State<double>& state) const {
  if (!watches_) {
    return "";
  }
  const double energy = KineticEnergy(model, state) + PotentialEnergy(model, state);
  if (energy - start_ <= allowed_) {
    return "";
  }
  char text[160];
  std::snprintf(text, sizeof(text),
                "the energy grew from %.3g J to %.3g J, though nothing drives the scene: dt is too "
                "large",
                start_, energy);
  return text;
}

double EnergyWatch::Excess(const Model<double>& model, const State<double>& state) const {
  if (!watches_) return 0.0;
  const double energy = KineticEnergy(model, state) + PotentialEnergy(model, state);
  return std::max(0.0, energy - start_ - allowed_ / kExploded);
}

std::string EnergyOfOverlap(const Model<double>& model, const State<double>& initial,
                            const State<double>& final, double depth) {
  if (model.structure->settings.stepping == Stepping::kEvent || !(depth > 0.0)) return "";
  const EnergyWatch watch(model, initial);
  double excess = watch.Excess(model, final);
  if (depth > kDeep * Lengths(model).smallest_radius() && !IsDriven(model, initial)) {
    const SimulationSettings& settings = model.structure->settings;
    const double g = std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]);
    const double kinetic = KineticEnergy(model, initial) + KineticEnergy(model, final);
    double given = kGrownByOverlap * kinetic;
    for (const int body : model.structure->moving) {
      given += model.parameters[model.structure->bodies[body].mass] *
               (settings.recovery_speed * settings.recovery_speed + 2.0 * g * depth);
    }
    excess = std::max(excess, KineticEnergy(model, final) + PotentialEnergy(model, final) -
                                  watch.start() - given);
  }
  if (!(excess > 0.0)) return "";
  char text[320];
  std::snprintf(text, sizeof text,
                "the energy grew from %.4g J to %.4g J as bodies that overlap, by up to %.3g m, "
                "were pushed apart: expected a start at which no bodies overlap",
                watch.start(), KineticEnergy(model, final) + PotentialEnergy(model, final), depth);
  return text;
}

std::string EnergyOfSqueeze(const Model<double>& model, const State<double>& initial,
                            const State<double>& final) {
  const ModelStructure& s = *model.structure;
  const auto is_driven = [&](const JointIndex& joint) {
    return joint.motor >= 0 || joint.effort >= 0 || joint.effort_signal >= 0;
  };
  if (!s.forces.empty() || !s.servos.empty() || !s.springs.empty() ||
      std::any_of(s.joints.begin(), s.joints.end(), is_driven)) {
    return "";
  }
  const Lengths lengths(model);
  double fastest = 0.0;  // of what is driven
  for (int body = 0; body < s.num_bodies(); ++body) {
    if (s.bodies[body].block >= 0) continue;
    const double* v = &initial.twist[3 * static_cast<size_t>(body)];
    const double radius = lengths.radius(body);
    fastest = std::max({fastest, std::hypot(v[0], v[1]) + std::abs(v[2]) * radius,
                        LargestGivenSpeed(model, body, 0.0, s.settings.duration, radius)});
  }
  double given = 0.0;
  for (const int body : s.moving) {
    given += 0.5 * model.parameters[s.bodies[body].mass] * fastest * fastest;
  }
  const double kinetic = KineticEnergy(model, final);
  const double had = KineticEnergy(model, initial) +
                     std::max(0.0, PotentialEnergy(model, initial) - PotentialEnergy(model, final));
  if (fastest == 0.0 || !(kinetic > kSqueezed * given + 2.0 * had)) return "";
  char text[320];
  std::snprintf(
      text, sizeof text,
      "bodies that are pressed together by bodies of given motion, which move at up to %.3g "
      "m/s, end with %.4g J: what is squeezed along a line leaves it at any speed; expected "
      "room for them, or a force in place of the motion",
      fastest, kinetic);
  return text;
}

std::string EnergyGrown(const Model<double>& model, const State<double>& initial,
                        const State<double>& final, double by_impacts, double depth) {
  const SimulationSettings& settings = model.structure->settings;
  if (settings.stepping != Stepping::kEvent || IsDriven(model, initial)) return "";
  const double kinetic[2] = {KineticEnergy(model, initial), KineticEnergy(model, final)};
  const double start = kinetic[0] + PotentialEnergy(model, initial);
  const double end = kinetic[1] + PotentialEnergy(model, final);
  const double g = std::hypot(model.parameters[kGravityX], model.parameters[kGravityY]);
  const Lengths lengths(model);
  double lifted = 0.0;
  double rounding = kTouchShare * (std::abs(start) + std::abs(end));
  for (const int body : model.structure->moving) {
    const double mass = model.parameters[model.structure->bodies[body].mass];
    const double touch = lengths.Touch(final, body, body);
    const double speed = touch / settings.dt;
    lifted += 2.0 * mass * g * depth;
    rounding += mass * (g * (touch + kTouchShare * PlaceOf(final, body, body)) + speed * speed);
  }
  if (!(end - start > kEnergyGrowth * (kinetic[0] + kinetic[1]) + by_impacts + lifted + rounding)) {
    return "";
  }
  char text[320];
  std::snprintf(text, sizeof text,
                "the energy grew from %.4g J to %.4g J, though nothing drives the scene: expected "
                "a smaller \"dt\" in \"simulation\", which follows the motion (a stiff spring, a "
                "fast turn), got %g s",
                start, end, settings.dt);
  return text;
}

}  // namespace tangible
