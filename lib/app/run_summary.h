// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The summary of a run that tangible-simulate writes as JSON.

#include "tangible/scene/json_writer.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

class RunSummary {
 public:
  /// Every state of the run, in order; `stepper` is null for the initial one. Only copies what the
  /// summary's figures need: they are evaluated for many steps at once, so that their time can be
  /// taken with two looks at the clock.
  void Keep(const Model<double>& model, const State<double>& state, const Stepper* stepper);
  /// Whether so much is kept that it should be evaluated.
  bool IsFull() const;
  /// Evaluates what is kept and forgets it.
  void EvaluateKept(const Model<double>& model);
  /// `last`: the run's last state. Without "seconds" and "cpu_seconds", which are null: they are
  /// known when all else is done.
  OrderedJson ToJson(const Model<double>& model, const RolloutReport& report,
                     const State<double>& last);

 private:
  bool started_ = false;
  State<double> first_;
  int islands_max_ = 0;
  double joint_drift_max_ = 0.0;
  // The last step, without its problem.
  StepRecord last_step_;
  bool stepped_ = false;
  bool by_events_ = false;

  // Kept: the poses of states one after the other, where the scene has joints, and each step's
  // bodies in contact with the place in `closed_` where they end.
  std::vector<double> poses_;
  std::vector<std::pair<int, int>> closed_;
  std::vector<size_t> closed_ends_;
  State<double> at_;  // whose joints are measured
};

/// "done", "unsolved" or "diverged".
const char* ToString(StepStatus status);

}  // namespace tangible
