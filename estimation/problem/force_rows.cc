// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/force_rows.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tangible/estimation/problem/tolerances.h"

namespace tangible {
namespace {

ConstraintForce ForceOf(const Observation& observation) {
  using Component = ConstraintForce::Component;
  ConstraintForce force;
  force.joint = observation.joint;
  force.a = observation.pair[0];
  force.b = observation.pair[1];
  force.component = observation.coordinate == Coordinate::kFx       ? Component::kX
                    : observation.coordinate == Coordinate::kFy     ? Component::kY
                    : observation.coordinate == Coordinate::kTorque ? Component::kTorque
                    : observation.coordinate == Coordinate::kNormal ? Component::kNormal
                                                                    : Component::kTangent;
  return force;
}

/// The first step that ends at t or later; 0: t is the start of the run.
long StepUntil(const SimulationSettings& settings, double t) {
  const double slack = kTimeTolerance * settings.dt;
  if (t <= slack) return 0;
  long k = std::clamp(static_cast<long>(t / settings.dt), 1L, std::max(1L, NumSteps(settings)));
  if (!settings.step_times.empty()) {
    k = std::lower_bound(settings.step_times.begin(), settings.step_times.end(), t - slack) -
        settings.step_times.begin();
  }
  while (k > 1 && StepTime(settings, k - 1) >= t - slack) --k;
  while (k < NumSteps(settings) && StepTime(settings, k) < t - slack) ++k;
  return k;
}

}  // namespace

ForceRows::ForceRows(const std::vector<Observation>& observations, const std::vector<double>& times,
                     const SimulationSettings& settings) {
  const bool by_events = settings.stepping == Stepping::kEvent;
  for (size_t i = 0; i < observations.size(); ++i) {
    const bool is_force = IsForce(observations[i].coordinate);
    row_of_.push_back(is_force ? num_rows() : -1);
    if (!is_force) continue;
    Row& row = rows_.emplace_back();
    row.force_of = ForceOf(observations[i]);
    const long k = StepUntil(settings, times[i]);
    row.read_at = std::max(1L, k);
    row.instant = k == 0 ? ForceInstant::kStart : ForceInstant::kEnd;
    row.state = by_events ? k : row.read_at - 1;
    last_step_ = std::max(last_step_, row.read_at);
  }
  order_.resize(rows_.size());
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(),
                   [&](int a, int b) { return rows_[a].read_at < rows_[b].read_at; });
}

std::span<const int> ForceRows::ReadAt(long k) const {
  const auto first = std::partition_point(order_.begin(), order_.end(),
                                          [&](int row) { return rows_[row].read_at < k; });
  const auto last =
      std::find_if(first, order_.end(), [&](int row) { return rows_[row].read_at != k; });
  return {first, last};
}

void ForceRows::Add(long k, const Model<double>& model, Stepper* stepper) {
  const std::span<const int> rows = ReadAt(k);
  if (stepper == nullptr || rows.empty()) return;
  for (const ForceInstant instant : {ForceInstant::kStart, ForceInstant::kEnd}) {
    std::vector<ConstraintForce> forces;
    std::vector<Row*> read;
    for (const int place : rows) {
      Row& row = rows_[place];
      if (row.instant != instant) continue;
      forces.push_back(row.force_of);
      read.push_back(&row);
    }
    if (forces.empty()) continue;
    std::vector<StepForce> values;
    forces_.Evaluate(model, forces, instant, stepper, &values);
    for (size_t f = 0; f < read.size(); ++f) read[f]->force = std::move(values[f]);
  }
}

}  // namespace tangible
