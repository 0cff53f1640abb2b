// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/cartpole/cart_pole_control.h"

#include <cmath>
#include <numbers>

#include "tangible/math/cpu_time.h"
#include "tangible/math/random.h"

namespace tangible {
namespace {

// The bounds of a successful swing-up.
constexpr double kUprightAngle = 0.2, kMiddle = 0.5, kUprightTime = 2.0;
// N: the controls from which the first plan starts. For a pole that hangs at rest, a plan without
// force is stationary.
constexpr double kFirstForce = 1.0;

CostTerm Term(CostTerm::Kind kind, int index, double weight, bool at_end) {
  CostTerm term;
  term.kind = kind;
  term.index = index;
  term.weight = weight;
  term.at_end = at_end;
  return term;
}

}  // namespace

Cost SwingUpCost() {
  using Kind = CostTerm::Kind;
  return Cost(4, 1, kCartPoleStep,
              {Term(Kind::kAngle, 1, 10.0, false), Term(Kind::kState, 0, 1.0, false),
               Term(Kind::kState, 2, 0.1, false), Term(Kind::kState, 3, 0.1, false),
               Term(Kind::kControl, 0, 0.01, false), Term(Kind::kAngle, 1, 10.0, true),
               Term(Kind::kState, 0, 2.0, true), Term(Kind::kState, 2, 1.0, true),
               Term(Kind::kState, 3, 0.5, true)});
}

SwingUp RunSwingUp(StepMap* model, CartPolePlant* plant, const CartPoleState& start,
                   const SwingUpOptions& options) {
  const Cost cost = SwingUpCost();
  const VectorX<double> bound = VectorX<double>::Constant(1, kCartPoleForce);
  PredictiveOptions predictive;
  predictive.ilqr.max_iterations = options.iterations;
  PredictiveController controller({model, &cost, start, -bound, bound, 0},
                                  RowMatrixXd::Constant(options.horizon, 1, kFirstForce),
                                  predictive);
  SwingUp run;
  CartPoleState state = start;
  const int last = static_cast<int>(std::lround(kUprightTime / kCartPoleStep));
  run.success = true;
  for (int k = 0; k < options.steps; ++k) {
    run.states.push_back(state);
    const double began = ThreadCpuSeconds();
    const double force = controller.Control(k, state)[0];
    run.cpu_seconds.push_back(ThreadCpuSeconds() - began);
    run.forces.push_back(force);
    state = plant->Advance(state, force, kCartPoleStep);
    run.reward += 0.5 * (1.0 + std::cos(state[1])) / options.steps;
    if (k + last >= options.steps && std::cos(state[1]) < std::cos(kUprightAngle)) {
      run.success = false;
    }
  }
  run.states.push_back(state);
  run.success = run.success && std::abs(state[0]) <= kMiddle;
  return run;
}

CartPoleState RandomStart(unsigned seed, unsigned number) {
  std::mt19937_64 random = Generator(seed, number);
  CartPoleState start;
  start[0] = Uniform(-0.5, 0.5, &random);
  start[1] = Uniform(-std::numbers::pi, std::numbers::pi, &random);
  start[2] = Uniform(-0.5, 0.5, &random);
  start[3] = Uniform(-2.0, 2.0, &random);
  return start;
}

}  // namespace tangible
