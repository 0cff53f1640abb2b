// SPDX-License-Identifier: Apache-2.0
//
// Finite differences.
#include <algorithm>
#include <cmath>

#include "tangible/simulation/gradient/rollout_function.h"
#include "tangible/simulation/gradient/tolerances.h"

namespace tangible {

// Central differences; where one side is refused, one-sided ones of second order on the other side.
void RolloutWorker::JacobianByDifferences(const RolloutInput& input, RowMatrixXd* jacobian,
                                          RolloutOutput* output) {
  const RolloutOutput base = Run(input);
  *output = base;
  if (base.status != RolloutStatus::kDone) return;
  const RolloutInput defaults = [&] {
    RolloutInput own = input;
    own.state.resize(f_.num_states());
    const int poses = static_cast<int>(initial_.pose.size());
    for (int i = 0; i < f_.num_states(); ++i) {
      const int variable = f_.outputs_[i];
      own.state[i] = variable < poses ? initial_.pose[variable] : initial_.twist[variable - poses];
    }
    return own;
  }();
  for (Eigen::Index column = 0; column < jacobian->cols(); ++column) {
    const bool of_parameter = column < f_.num_parameters();
    const Eigen::Index state = column - f_.num_parameters();
    const Eigen::Index control = state - f_.num_states();
    const auto value_of = [&](RolloutInput* moved) -> double& {
      if (of_parameter) return moved->parameters[column];
      if (control < 0) return moved->state[state];
      return moved->controls(control / f_.num_controls(), control % f_.num_controls());
    };
    const RolloutInput& from = !of_parameter && control < 0 ? defaults : input;
    RolloutInput moved = from;
    const double scale = of_parameter ? f_.parameters_[column].scale : 1.0;
    const double h = kRelativeStep * std::max(std::abs(value_of(&moved)), scale);
    const auto run = [&](double by) {
      moved = from;
      value_of(&moved) += by;
      return Run(moved);
    };
    const RolloutOutput plus = run(h);
    const RolloutOutput minus = run(-h);
    RowMatrixXd slope;
    if (plus.status == RolloutStatus::kDone && minus.status == RolloutStatus::kDone) {
      slope = (plus.states - minus.states) / (2.0 * h);
    } else if (plus.status == RolloutStatus::kRefused || minus.status == RolloutStatus::kRefused) {
      const bool forwards = minus.status == RolloutStatus::kRefused;
      const double side = forwards ? h : -h;
      const RolloutOutput further = run(2.0 * side);
      slope = (-3.0 * base.states + 4.0 * (forwards ? plus : minus).states - further.states) /
              (2.0 * side);
    } else {
      *output = plus.status == RolloutStatus::kDone ? minus : plus;
      return;
    }
    jacobian->col(column) = Eigen::Map<const VectorX<double>>(slope.data(), slope.size());
  }
}

}  // namespace tangible
