// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Buttons that bring the paddle to where the ball will be.
//
// While there is time, iLQR (lib/control) plans presses in [−1, 1] over the learned law, and the
// nearest button is pressed. In the last steps all sequences of buttons are compared with the
// learned model, means included: whole presses move the paddle by more than a section is wide.

#include "tangible/estimation/experiments/breakout/agent/paddle_model.h"

namespace tangible {

/// Where the left edge should be after so many frames.
struct PaddleGoal {
  double x = 0.0;
  double low = 0.0, high = 0.0;  ///< what is as good to the ball
  double frames = 0.0;           ///< >= 1
};

class PaddleControl {
 public:
  explicit PaddleControl(const PaddleModel* model) : model_(model) {}

  /// −1, 0 or 1: of the next step.
  int Direction(const PaddleState& state, const PaddleGoal& goal);
  long num_plans() const { return num_plans_; }

 private:
  int Plan(const PaddleState& state, const PaddleGoal& goal);
  struct Best {
    double cost = 0.0;
    int direction = 0;
  };
  Best Compare(const PaddleState& state, const PaddleGoal& goal, int frames) const;

  const PaddleModel* model_;
  long num_plans_ = 0;
};

}  // namespace tangible
