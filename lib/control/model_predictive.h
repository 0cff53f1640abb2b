// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Receding horizon: at every step the plan from the state that is seen is made anew, of which the
// first control is played. The plan before, shifted by a step, is where the next one starts.

#include "tangible/control/ilqr.h"

namespace tangible {

struct PredictiveOptions {
  /// Of each step; `max_iterations` is the budget, the same on any machine.
  IlqrOptions ilqr{.max_iterations = 5};
  /// s; > 0: iterations end when this time has passed, so that plans depend on the machine.
  double budget = 0.0;
};

class PredictiveController {
 public:
  /// `controls` (horizon x m) are where the first plan starts. The problem's system and cost
  /// outlive this; its initial state and first step are set by Control.
  PredictiveController(ControlProblem problem, RowMatrixXd controls, PredictiveOptions options);

  /// The control of step k, seen in state x. Where no plan can be made, the one before is played
  /// on: `last()` says why.
  VectorX<double> Control(long k, const VectorX<double>& x);

  /// Of the last call.
  const IlqrResult& last() const { return last_; }

 private:
  ControlProblem problem_;
  RowMatrixXd controls_;
  PredictiveOptions options_;
  IlqrResult last_;
  bool started_ = false;
};

}  // namespace tangible
