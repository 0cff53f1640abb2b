// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Swing-up and balance by plans over a receding horizon of 1 s. A new plan is made every 20 ms from
// the state of the plant, with any model of it.

#include <vector>

#include "tangible/control/model_predictive.h"
#include "tangible/estimation/experiments/cartpole/cart_pole.h"

namespace tangible {

struct SwingUpOptions {
  int steps = 300;     ///< of kCartPoleStep
  int horizon = 50;    ///< of a plan, steps
  int iterations = 2;  ///< of iLQR in each plan
};

struct SwingUp {
  std::vector<CartPoleState> states;  ///< of the plant, steps + 1
  std::vector<double> forces;
  std::vector<double> cpu_seconds;  ///< of each plan
  double reward = 0.0;              ///< mean of (1 + cos φ) / 2: 1 is upright all the time
  /// Within the last 2 s the pole is always within 0.2 rad of upright, and the cart at the end
  /// within 0.5 m of the middle.
  bool success = false;
};

/// The cost of plans, whose target is the upright pole at rest in the middle of the rail.
Cost SwingUpCost();

/// `model` has 4 states and 1 control, as CartPoleStep.
SwingUp RunSwingUp(StepMap* model, CartPolePlant* plant, const CartPoleState& start,
                   const SwingUpOptions& options);

/// A random start: x in ±0.5 m, any angle, v in ±0.5 m/s, ω in ±2 rad/s.
CartPoleState RandomStart(unsigned seed, unsigned number);

}  // namespace tangible
