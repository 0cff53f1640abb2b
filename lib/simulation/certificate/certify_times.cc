// SPDX-License-Identifier: Apache-2.0
// What is known before a run: when windows of forces open and close, joints end and the rates of
// paths jump; and the states that are read during the run. At the end of the run or where a state
// is read the derivative by such a time has two sides.
#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/certificate/certify_place_inl.h"
#include "tangible/simulation/events/event_edges.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace {

constexpr char kIsRead[] = " s is where a state is read";

std::string WhereItSteps(const std::string& which, const std::string& other) {
  return which + " s is where " + other + " steps";
}

bool IsReadBefore(const StateRead& x, const StateRead& y) { return x.steps < y.steps; }

// What else than `own` jumps at a time, to `near`; empty: nothing does. Beside the knot of a path,
// those of other paths do not count: they are passed one after another, or named where they drive
// the same bodies (AddOrder).
enum class Own { kJoint, kPath };
std::string OtherJump(const Model<double>& model, double time, double near, Own kind,
                      const std::string& own) {
  for (const LoadJump& jump : LoadJumpsWithin(model, time - near, time + near)) {
    if (jump.what != own && (kind != Own::kPath || jump.driven < 0)) return jump.what;
  }
  return "";
}

}  // namespace

RolloutCertifier::RolloutCertifier(CertifyOptions options) : options_(std::move(options)) {
  std::stable_sort(options_.reads.begin(), options_.reads.end(), IsReadBefore);
}

void RolloutCertifier::AddForceWindows(const Model<double>& model) {
  const SimulationSettings& settings = model.structure->settings;
  const auto same = [&](double x, double y) {
    return std::abs(x - y) <=
           kSameInstant * settings.dt + kCoordinateRounding * std::max(std::abs(x), std::abs(y));
  };
  for (const ForceIndex& force : model.structure->forces) {
    const auto check = [&](int number, const char* edge) {
      if (!Wanted(number)) {
        return;
      }
      const double time = model.parameters[number];
      const std::string which =
          std::string(edge) + " of force " + force.name + " at " + Short(time);
      // Before the start of a run, and after its end, there is no motion that the edge changes.
      if (same(time, 0.0) || same(time, settings.duration)) {
        OneSided(which +
                 (same(time, 0.0) ? " s is the start of the run" : " s is the end of the run"));
        return;
      }
      if (IsReadAt(*model.structure, time)) OneSided(which + kIsRead);
      const double near =
          kSameInstant * settings.dt + kCoordinateRounding * std::abs(settings.duration);
      if (OwnSignalSteps(*model.structure, force, time - near, time + near)) {
        OneSided(which + " s is where its own signal steps");
      }
      // By events both sides agree; the places that fixed steps reach differ by a step's length.
      const double k =
          std::clamp(std::round(time / settings.dt), 0.0, static_cast<double>(NumSteps(settings)));
      if (settings.stepping == Stepping::kFixed &&
          same(time, StepTime(settings, static_cast<long>(k)))) {
        OneSided(which + " s is on a step's boundary");
      }
    };
    check(force.start, "start");
    check(force.end, "end");
    if (force.start >= 0 && force.end >= 0 && (Wanted(force.start) || Wanted(force.end)) &&
        same(model.parameters[force.start], model.parameters[force.end])) {
      OneSided("the window of force " + force.name + " is empty");
    }
  }
}

// Ends of joints as parameters. A fixed step has a joint or has it not, so that the derivative is
// that of the discrete map, and where a step begins at the joint's end the map jumps.
void RolloutCertifier::AddReleases(const Model<double>& model) {
  const SimulationSettings& settings = model.structure->settings;
  const double near =
      kSameInstant * settings.dt + kCoordinateRounding * std::abs(settings.duration);
  for (const JointIndex& joint : model.structure->joints) {
    if (joint.until < 0 || !Wanted(joint.until)) continue;
    const double time = model.parameters[joint.until];
    const std::string which = "end of joint " + joint.name + " at " + Short(time);
    if (settings.stepping == Stepping::kFixed) {
      const bool acts = time > 0.0 && time < settings.duration;
      if (acts && certificate_.discrete_map.empty()) certificate_.discrete_map = which + " s";
      if (acts && certificate_.discrete_impact.empty()) {
        certificate_.discrete_impact = which + " s";
      }
      const double k =
          std::clamp(std::round(time / settings.dt), 0.0, static_cast<double>(NumSteps(settings)));
      if (landing_.empty() && std::abs(time - StepTime(settings, static_cast<long>(k))) <= near) {
        landing_ = which + " s is on a step's boundary";
      }
    } else if (std::abs(time) <= near) {
      OneSided(which + " s is the start of the run");
    } else if (std::abs(time - settings.duration) <= near) {
      OneSided(which + " s is the end of the run");
    } else if (IsReadAt(*model.structure, time)) {
      OneSided(which + kIsRead);
    } else if (const std::string other =
                   OtherJump(model, time, near, Own::kJoint, "joint " + joint.name);
               !other.empty()) {
      OneSided(WhereItSteps(which, other));
    }
  }
}

std::span<const StateRead> RolloutCertifier::ReadsAfter(long steps) const {
  const auto [first, last] = std::equal_range(options_.reads.begin(), options_.reads.end(),
                                              StateRead{.steps = steps}, IsReadBefore);
  return {first, last};
}

bool RolloutCertifier::IsRead(const ModelStructure& structure, long steps) const {
  return steps == NumSteps(structure.settings) || !ReadsAfter(steps).empty();
}

bool RolloutCertifier::IsReadAt(const ModelStructure& structure, double time) const {
  const auto at_or_behind = std::partition_point(
      options_.reads.begin(), options_.reads.end(), [&](const StateRead& read) {
        const double at = StepTime(structure.settings, read.steps);
        return at < time && !IsSameInstant(structure, time, at);
      });
  return at_or_behind != options_.reads.end() &&
         IsSameInstant(structure, time, StepTime(structure.settings, at_or_behind->steps));
}

std::string RolloutCertifier::AsRead(const ModelStructure& structure, long steps,
                                     const char* event) const {
  const bool ends = steps == NumSteps(structure.settings);
  return std::string(ends ? "the run ends as " : "a state is read as ") + event;
}

bool RolloutCertifier::MovesRead(const ModelStructure& structure, long steps,
                                 const ActiveContact& contact) const {
  if (steps == NumSteps(structure.settings)) return true;
  const ActiveContact whole = island_ != nullptr ? island_->InWhole(contact) : contact;
  const auto is_joined = [&](int body) {
    return std::any_of(structure.joints.begin(), structure.joints.end(),
                       [&](const JointIndex& joint) { return joint.a == body || joint.b == body; });
  };
  const std::span<const StateRead> reads = ReadsAfter(steps);
  return std::any_of(reads.begin(), reads.end(), [&](const StateRead& read) {
    return read.body < 0 || read.body == whole.a || read.body == whole.b || is_joined(contact.a) ||
           is_joined(contact.b);
  });
}

// Whether a body has a joint or spring, or touches another one as the run starts.
bool RolloutCertifier::ActsAtStart(const ModelStructure& s, int body) const {
  const auto has = [body](const auto& one) { return one.a == body || one.b == body; };
  return std::any_of(s.joints.begin(), s.joints.end(), has) ||
         std::any_of(s.springs.begin(), s.springs.end(), has) ||
         std::any_of(touching_at_start_.begin(), touching_at_start_.end(), has);
}

// Jumps of a path's rate at which the derivative by its delay has two sides.
void RolloutCertifier::AddPaths(const Model<double>& model) {
  const ModelStructure& s = *model.structure;
  for (const PathIndex& index : s.paths) {
    if (!Wanted(index.numbers + kPathDelay)) continue;
    const std::vector<double>& times = index.path->times();
    for (size_t k = 0; k < times.size(); ++k) {
      const double time = times[k] + model.parameters[index.numbers + kPathDelay];
      if (!index.path->JumpsAt(static_cast<int>(k)) || time < -s.settings.dt) continue;
      const std::string which =
          "jump of the path of " + s.bodies[index.body].name + " at " + Short(time);
      const double steps = std::round(time / s.settings.dt);
      const long step =
          static_cast<long>(std::clamp(steps, 0.0, static_cast<double>(NumSteps(s.settings))));
      if (IsSameInstant(s, time, 0.0)) {
        if (ActsAtStart(s, index.body)) OneSided(which + " s is the start of the run");
      } else if (IsSameInstant(s, time, s.settings.duration)) {
        OneSided(which + " s is the end of the run");
      } else if (IsReadAt(s, time)) {
        OneSided(which + kIsRead);
      } else if (s.settings.stepping == Stepping::kFixed &&
                 IsSameInstant(s, time, StepTime(s.settings, step))) {
        OneSided(which + " s is on a step's boundary");
      } else if (s.settings.stepping == Stepping::kEvent) {
        const std::string other = OtherJump(model, time, kSameInstant * s.settings.dt, Own::kPath,
                                            "the speed of body " + s.bodies[index.body].name);
        if (!other.empty()) OneSided(WhereItSteps(which, other));
      }
    }
  }
}

}  // namespace tangible
