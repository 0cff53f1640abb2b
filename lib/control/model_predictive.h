// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Receding horizon: at every step a new plan is made from the observed state, and its first control
// is applied. The next plan starts from the last one, shifted by a step.

#include "tangible/control/ilqr.h"

namespace tangible {

struct PredictiveOptions {
  /// The options of each step's plan; `max_iterations` is the budget, the same on any machine.
  IlqrOptions ilqr{.max_iterations = 5};
  /// s; > 0: iterations end when this time has passed, so that plans depend on the machine.
  double budget = 0.0;
};

class PredictiveController {
 public:
  /// The first plan starts from `controls` (horizon x m). The problem's system and cost must
  /// outlive this object; Control sets its initial state and first step.
  PredictiveController(ControlProblem problem, RowMatrixXd controls, PredictiveOptions options);

  /// The control of step k at the observed state x. Where no plan can be made, the previous plan is
  /// continued; `last()` says why.
  VectorX<double> Control(long k, const VectorX<double>& x);

  /// The result of the last call.
  const IlqrResult& last() const { return last_; }

 private:
  ControlProblem problem_;
  RowMatrixXd controls_;
  PredictiveOptions options_;
  IlqrResult last_;
  bool started_ = false;
};

}  // namespace tangible
