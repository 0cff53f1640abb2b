// SPDX-License-Identifier: Apache-2.0
//
// Forward mode: a column for each direction.
#include <algorithm>

#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

void RolloutWorker::RunTangent(
    const ControlDirections& directions, RowMatrixXd w_dot,
    const std::function<void(int record, const RowMatrixXd& w_dot)>& keep, RolloutOutput* output) {
  int next = 0;
  RunAs(
      [&](ControlledModel<double>* model, const StateObserver& keep_state) {
        return RolloutTangent(
            model, initial_, directions,
            [&](long k, double t, const State<double>& state, const RowMatrixXd& now) {
              keep_state(k, t, state, nullptr);
              if (next < f_.num_records() && f_.records_[next] == k) keep(next++, now);
            },
            &*stepper_, &w_dot, &output->final);
      },
      output);
}

RolloutOutput RolloutWorker::Tangent(const RolloutInput& input,
                                     const std::vector<InputDirection>& directions,
                                     std::vector<RowMatrixXd>* tangents) {
  RolloutOutput output;
  const auto columns = static_cast<Eigen::Index>(directions.size());
  tangents->assign(directions.size(),
                   RowMatrixXd::Constant(f_.num_records(), f_.num_states(),
                                         std::numeric_limits<double>::quiet_NaN()));
  if (!Set(input, &output)) return output;
  RowMatrixXd parameters(f_.num_parameters(), columns);
  RowMatrixXd states(f_.num_states(), columns);
  for (Eigen::Index d = 0; d < columns; ++d) {
    parameters.col(d) = directions[d].parameters;
    states.col(d) = directions[d].state;
  }
  const auto set_controls = [&](long k, RowMatrixXd* w_dot) {
    if (f_.num_steps() == 0) return;  // no control acts
    const long row = std::min(k, f_.num_steps() - 1);
    for (size_t j = 0; j < controls_.numbers.size(); ++j) {
      for (Eigen::Index d = 0; d < columns; ++d) {
        (*w_dot)(f_.structure_->ParameterVariable(controls_.numbers[j]), d) =
            directions[d].controls(row, f_.control_of_number_[j]);
      }
    }
  };
  RunTangent(
      set_controls, VariableDirections(parameters, states),
      [&](int record, const RowMatrixXd& w_dot) {
        for (Eigen::Index d = 0; d < columns; ++d) {
          for (int i = 0; i < f_.num_states(); ++i) {
            (*tangents)[d](record, i) = w_dot(f_.outputs_[i], d);
          }
        }
      },
      &output);
  return output;
}

void RolloutWorker::JacobianByTangent(RowMatrixXd* jacobian, RolloutOutput* output) {
  const Eigen::Index first_control = f_.num_parameters() + f_.num_states();
  RowMatrixXd parameters = RowMatrixXd::Zero(f_.num_parameters(), jacobian->cols());
  parameters.leftCols(f_.num_parameters()).setIdentity();
  RowMatrixXd states = RowMatrixXd::Zero(f_.num_states(), jacobian->cols());
  const bool all = jacobian->cols() > f_.num_parameters();
  if (all) states.middleCols(f_.num_parameters(), f_.num_states()).setIdentity();
  const auto set_controls = [&](long k, RowMatrixXd* w_dot) {
    for (size_t j = 0; j < controls_.numbers.size(); ++j) {
      auto row = w_dot->row(f_.structure_->ParameterVariable(controls_.numbers[j]));
      row.setZero();
      if (all && k < f_.num_steps()) {
        row[first_control + k * f_.num_controls() + f_.control_of_number_[j]] = 1.0;
      }
    }
  };
  RunTangent(
      set_controls, VariableDirections(parameters, states),
      [&](int record, const RowMatrixXd& w_dot) {
        for (int i = 0; i < f_.num_states(); ++i) {
          jacobian->row(static_cast<Eigen::Index>(record) * f_.num_states() + i) =
              w_dot.row(f_.outputs_[i]);
        }
      },
      output);
}

}  // namespace tangible
