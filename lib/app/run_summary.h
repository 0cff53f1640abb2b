// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The summary of a run that tangible-simulate writes as JSON.

#include "tangible/scene/json_writer.h"
#include "tangible/simulation/rollout.h"

namespace tangible {

class RunSummary {
 public:
  /// Every state of the run; `stepper` is null for the initial one.
  void Add(const Model<double>& model, const State<double>& state, Stepper* stepper);
  /// `seconds`: of the whole run; `cpu_seconds`: of its steps alone.
  OrderedJson ToJson(const Model<double>& model, const RolloutReport& report, double seconds,
                     double cpu_seconds) const;

 private:
  bool started_ = false;
  State<double> first_, last_;
  int islands_max_ = 0;
  double joint_drift_max_ = 0.0;
  // The last step, without its problem.
  StepRecord last_step_;
  bool stepped_ = false;
  bool by_events_ = false;
};

/// "done", "unsolved" or "diverged".
const char* ToString(StepStatus status);

}  // namespace tangible
