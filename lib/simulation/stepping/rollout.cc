// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/rollout.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "tangible/dynamics/model/model_seams.h"
#include "tangible/simulation/stepping/energy_watch.h"
#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {
namespace {

// Adds to a step's report whether the run has exploded. Not every step is examined.
StepReport Watched(const EnergyWatch& watch, const Model<double>& model, const State<double>& state,
                   long k, long steps, StepReport step) {
  constexpr long kEvery = 8;
  if (step.status == StepStatus::kDone && (k % kEvery == 0 || k + 1 == steps)) {
    step.message = watch.Exploded(model, state);
    step.status = step.message.empty() ? StepStatus::kDone : StepStatus::kDiverged;
  }
  return step;
}

// Adds to a run's report whether its energy has grown without a cause.
template <typename T>
void LookAtEnergy(const ControlledModel<T>& controlled, const Model<double>& model,
                  const State<double>& initial, const State<double>& final, RolloutReport* report) {
  if (controlled.is_controlled()) return;
  report->energy_grown = EnergyGrown(
      model, initial, final, static_cast<double>(report->events) * report->impact_energy_gain,
      report->penetration_max);
}

// The largest difference between two states, relative to the larger of 1 and the values.
template <typename T>
double ValueDifference(const State<T>& jets, const State<double>& state) {
  double worst = 0.0;
  const auto compare = [&](const std::vector<T>& x, const std::vector<double>& y) {
    for (size_t i = 0; i < y.size(); ++i) {
      const double difference = std::abs(ValueOf(x[i]) - y[i]) / std::max(1.0, std::abs(y[i]));
      worst = std::isnan(difference) ? HUGE_VAL : std::max(worst, difference);
    }
  };
  compare(jets.pose, state.pose);
  compare(jets.twist, state.twist);
  return worst;
}

template <typename T>
void SetValues(const State<double>& values, State<T>* state) {
  for (size_t i = 0; i < values.pose.size(); ++i) {
    state->pose[i].a = values.pose[i];
    state->twist[i].a = values.twist[i];
  }
}

}  // namespace

std::string FailureMessage(const StepReport& step, double t, long k) {
  std::ostringstream message;
  message << "step " << k << " at t = " << t
          << " s: " << (step.status == StepStatus::kDiverged ? "diverged: " : "unsolved: ")
          << step.message;
  return message.str();
}

void RolloutReport::Add(const StepReport& step) {
  StepCounts::Add(step);
  contacts_max = std::max(contacts_max, step.closed);
  lcp_rows_max = std::max(lcp_rows_max, step.lcp_rows);
  ++solved_by[static_cast<size_t>(step.rung)];
  penetration_max = std::max(penetration_max, -step.gap_min);
}

long RolloutReport::SolvedBy(Rung first, Rung last) const {
  return std::accumulate(&solved_by[static_cast<size_t>(first)],
                         &solved_by[static_cast<size_t>(last)] + 1, 0L);
}

RolloutReport Rollout(ControlledModel<double> model, const State<double>& initial,
                      const StateObserver& observer, Stepper* stepper, State<double>* final,
                      const StepRange& range) {
  const SimulationSettings& settings = model.structure().settings;
  RolloutReport report;
  State<double> state = initial;
  stepper->ClearGuess();
  const long steps = range.last < 0 ? NumSteps(settings) : range.last;
  EnergyWatch watch;
  if (!model.is_controlled()) watch = EnergyWatch(model.At(range.first), initial);
  report.time = StepTime(settings, range.first);
  if (observer) {
    observer(range.first, report.time, state, nullptr);
  }
  for (long k = range.first; k < steps; ++k) {
    const double t = StepTime(settings, k);
    const Model<double>& now = model.At(k);
    const StepReport step = Watched(watch, now, state, k, steps,
                                    stepper->Step(now, t, StepLength(settings, k), &state));
    report.Add(step);
    if (step.status != StepStatus::kDone) {
      report.status = step.status;
      report.message = FailureMessage(step, t, k);
      break;
    }
    ++report.steps;
    report.time = StepTime(settings, k + 1);
    if (observer) {
      observer(k + 1, report.time, state, stepper);
    }
  }
  LookAtEnergy(model, model.At(0), initial, state, &report);
  *final = std::move(state);
  return report;
}

RolloutReport Rollout(const Model<double>& model, const State<double>& initial,
                      const StateObserver& observer, State<double>* final) {
  Stepper stepper(model);
  return Rollout(model, initial, observer, &stepper, final);
}

template <typename T>
RolloutReport RolloutJets(ControlledModel<T>* model, const State<T>& initial, JetRoute route,
                          const JetObserver<T>& observer, State<T>* final, long* fallbacks) {
  *fallbacks = 0;
  Model<double> values{model->At(0).structure, {}};
  const auto set_values = [&values](const Model<T>& jets) {
    values.parameters.clear();
    for (const T& number : jets.parameters) {
      values.parameters.push_back(ValueOf(number));
    }
  };
  set_values(model->At(0));
  State<T> jets = initial;
  if (observer) {
    observer(0, 0.0, jets, nullptr);
  }
  const SimulationSettings& settings = model->structure().settings;
  State<double> state = ValuesOf(initial);
  FindModelSeams(state, &values);
  Stepper stepper(values);
  RolloutReport report;
  for (long k = 0; k < NumSteps(settings); ++k) {
    const double t = StepTime(settings, k);
    const Model<T>& now = model->At(k);
    if (model->is_controlled()) set_values(now);
    StepReport step = stepper.Step(values, t, StepLength(settings, k), &state);
    report.Add(step);
    if (step.status != StepStatus::kDone) {
      report.status = step.status;
      report.message = FailureMessage(step, t, k);
      break;
    }
    State<T> before;
    if (route == JetRoute::kUnrolled) before = jets;
    bool unrolled = StepInJets(now, values, route, state, &stepper, &jets);
    if (unrolled && route == JetRoute::kUnrolled &&
        ValueDifference(jets, state) > kBranchTolerance) {
      // At a kink an interior point has half of the digits, or another solution of several.
      jets = std::move(before);
      StepInJets(now, values, JetRoute::kImplicit, state, &stepper, &jets);
      unrolled = false;
    }
    *fallbacks += unrolled ? 0 : 1;
    if (ValueDifference(jets, state) > kBranchTolerance) {
      report.status = StepStatus::kUnsolved;
      report.message =
          "step " + std::to_string(k) + ": different branch: Jets found another solution";
      break;
    }
    // Rounding must not accumulate until the modes differ from those of the run in double.
    SetValues(state, &jets);
    ++report.steps;
    report.time = StepTime(settings, k + 1);
    if (observer) {
      observer(k + 1, report.time, jets, &stepper);
    }
  }
  LookAtEnergy(*model, values, ValuesOf(initial), state, &report);
  *final = std::move(jets);
  return report;
}

#define TANGIBLE_INSTANTIATE_JET(N)                                                                \
  template RolloutReport RolloutJets<Jet<N>>(ControlledModel<Jet<N>>*, const State<Jet<N>>&,       \
                                             JetRoute, const JetObserver<Jet<N>>&, State<Jet<N>>*, \
                                             long*);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
