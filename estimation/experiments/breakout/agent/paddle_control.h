// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Chooses buttons that move the paddle to the ball.
//
// While there is time, iLQR (lib/control) plans presses in [−1, 1] over the learned law, and the
// nearest button is pressed. In the last steps all sequences of buttons are compared by the learned
// model with its means, because whole presses move the paddle by more than the width of a section.

#include "tangible/estimation/experiments/breakout/agent/paddle_model.h"

namespace tangible {

/// The desired place of the left edge after a number of frames.
struct PaddleGoal {
  double x = 0.0;
  double low = 0.0, high = 0.0;  ///< what is as good to the ball
  double frames = 0.0;           ///< >= 1
};

class PaddleControl {
 public:
  explicit PaddleControl(const PaddleModel* model) : model_(model) {}

  /// The direction of the next step: −1, 0 or 1.
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
