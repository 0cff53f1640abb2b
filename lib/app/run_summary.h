// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The summary of a run that tangible-simulate writes as JSON.

#include "tangible/scene/json_writer.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

class RunSummary {
 public:
  /// Every state of the run, in order; `stepper` is null for the initial one. Only copies the data
  /// that the summary's figures need: the figures are evaluated for many steps at once, so that
  /// their time can be measured by reading the clock twice.
  void Keep(const Model<double>& model, const State<double>& state, const Stepper* stepper);
  /// Whether enough data are kept that they should be evaluated.
  bool IsFull() const;
  /// Evaluates the kept data and discards them.
  void EvaluateKept(const Model<double>& model);
  /// `last`: the run's last state. "seconds" and "cpu_seconds" are null, because they are known
  /// only at the very end.
  OrderedJson ToJson(const Model<double>& model, const RolloutReport& report,
                     const State<double>& last);

 private:
  bool started_ = false;
  State<double> first_;
  int islands_max_ = 0;
  double joint_drift_max_ = 0.0;
  double penetration_max_ = 0.0;  // by events: at the ends of steps
  // The last step, without its problem.
  StepRecord last_step_;
  bool stepped_ = false;

  // The kept data: the poses of states one after the other, where the scene has joints or runs by
  // events, and for each step the bodies in contact and the position in `closed_` where they end.
  std::vector<double> poses_;
  std::vector<double> times_;  // of the poses
  std::vector<std::pair<int, int>> closed_;
  std::vector<size_t> closed_ends_;
  State<double> at_;  // the state whose joints and gaps are measured
};

}  // namespace tangible
