// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Rollouts: many steps from an initial state.

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "tangible/simulation/stepping/controlled_model.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {

/// The report of a run: sums and extremes of the steps' reports.
struct RolloutReport : StepCounts {
  StepStatus status = StepStatus::kDone;
  std::string message;   ///< empty unless it failed: when, where, what
  long steps = 0;        ///< done
  double time = 0.0;     ///< s, reached
  int contacts_max = 0;  ///< contacts with an impulse in a step
  long lcp_rows_max = 0;
  int fixed_numbers = 0;  ///< of the model: with a tangent, those that no column varies
  std::array<long, kNumRungs> solved_by{};  ///< steps, by the rung that solved them
  double penetration_max = 0.0;             ///< m
  /// Event stepping: empty, or a line that the energy has grown though nothing drives the scene.
  std::string energy_grown;

  /// Adds a step's report.
  void Add(const StepReport& step);
  /// Steps that one of these rungs solved, the first and the last included.
  long SolvedBy(Rung first, Rung last) const;
};

/// Called with the state at each recorded time: after k steps, at time t. The stepper holds the
/// record of the step that led there; nullptr at k = 0.
using StateObserver =
    std::function<void(long k, double t, const State<double>& state, Stepper* stepper)>;

/// Steps first, first + 1, ... before last; a negative last is the end of the run.
struct StepRange {
  long first = 0;
  long last = -1;
};

/// Runs the scene's duration, or from `initial` before the first step of a range. `final` (may be
/// the initial state itself) gets the last good state; the observer may be empty. The stepper keeps
/// its memory from run to run; its guess is cleared first.
RolloutReport Rollout(ControlledModel<double> model, const State<double>& initial,
                      const StateObserver& observer, Stepper* stepper, State<double>* final,
                      const StepRange& range = {});
/// The same with a stepper of its own.
RolloutReport Rollout(const Model<double>& model, const State<double>& initial,
                      const StateObserver& observer, State<double>* final);

/// The stepper as for a StateObserver.
template <typename T>
using JetObserver = std::function<void(long k, double t, const State<T>& state, Stepper* stepper)>;

/// A rollout in Jets beside one in double, which makes the discrete choices. `fallbacks` counts
/// unrolled steps in which the interior point failed, or found values that differ from the double
/// step's by more than kBranchTolerance (at a kink, or a different branch), and the implicit
/// derivative was used instead; where its values differ too the rollout fails with a message.
template <typename T>
RolloutReport RolloutJets(ControlledModel<T>* model, const State<T>& initial, JetRoute route,
                          const JetObserver<T>& observer, State<T>* final, long* fallbacks);
template <typename T>
RolloutReport RolloutJets(const Model<T>& model, const State<T>& initial, JetRoute route,
                          const JetObserver<T>& observer, State<T>* final, long* fallbacks) {
  ControlledModel<T> plain(model);
  return RolloutJets<T>(&plain, initial, route, observer, final, fallbacks);
}

/// The message about step k from time t, which failed: one line that says where and why.
std::string FailureMessage(const StepReport& step, double t, long k);

}  // namespace tangible
