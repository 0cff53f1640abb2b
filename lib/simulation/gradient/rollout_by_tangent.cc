// SPDX-License-Identifier: Apache-2.0
//
// Forward mode: a column for each direction.
#include <algorithm>
#include <utility>

#include "tangible/simulation/derivatives/rollout_directional.h"
#include "tangible/simulation/gradient/rollout_beside.h"

namespace tangible {

TangentObserver RolloutWorker::KeepTangents(const StateObserver& keep, RowMatrixXd* rows) const {
  StartRows(rows);
  return
      [this, keep, rows](long k, double t, const State<double>& state, const RowMatrixXd& w_dot) {
        keep(k, t, state, nullptr);
        f_.samples_.AddTangent(k, *f_.structure_, w_dot, rows);
      };
}

void RolloutWorker::RunTangent(const ControlDirections& directions, RowMatrixXd w_dot,
                               RowMatrixXd* rows, RolloutOutput* output) {
  RunAs(
      [&](const ControlledModel<double>& model, const StateObserver& keep) {
        return RolloutTangent(model, initial_, directions, KeepTangents(keep, rows), &*stepper_,
                              &w_dot, &output->final);
      },
      output);
  FinishRows(output->report, rows);
}

RolloutOutput RolloutWorker::Tangent(const RolloutInput& input,
                                     const std::vector<InputDirection>& directions,
                                     std::vector<RowMatrixXd>* tangents) {
  RolloutOutput output;
  const auto columns = static_cast<Eigen::Index>(directions.size());
  tangents->assign(directions.size(),
                   RowMatrixXd::Constant(f_.num_records(), f_.num_states(), kNaN));
  if (!SetForDerivatives(input, &output)) return output;
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
  RowMatrixXd rows(f_.num_outputs(), columns);
  RunTangent(set_controls, VariableDirections(parameters, states), &rows, &output);
  for (Eigen::Index d = 0; d < columns; ++d) {
    VectorX<double>::Map((*tangents)[d].data(), rows.rows()) = rows.col(d);
  }
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
  RunTangent(set_controls, VariableDirections(parameters, states), jacobian, output);
}

RolloutOutput RolloutWorker::OneSidedJacobian(const RolloutInput& input, double sign,
                                              RowMatrixXd* jacobian) {
  RolloutOutput output;
  const int parameters = f_.num_parameters();
  jacobian->setConstant(f_.num_outputs(), parameters, kNaN);
  if (!Set(input, &output)) return output;
  RowMatrixXd w_dot = sign * VariableDirections(RowMatrixXd::Identity(parameters, parameters),
                                                RowMatrixXd::Zero(f_.num_states(), parameters));
  RunAs(
      [&](const ControlledModel<double>& model, const StateObserver& keep) {
        return RolloutDirectional(model, initial_, KeepTangents(keep, jacobian), &*stepper_, &w_dot,
                                  &output.final);
      },
      &output);
  FinishRows(output.report, jacobian);
  *jacobian = (sign * *jacobian).array() + 0.0;  // no −0
  return output;
}

RolloutOutput RolloutWorker::TangentBeside(const RolloutInput& input, int parameter, double shift,
                                           VectorX<double>* tangent) {
  RolloutOutput output;
  if (!Set(input, &output)) return output;
  const Beside beside(this, parameter, shift);
  if (beside.is_refused()) {
    output.status = RolloutStatus::kRefused;
    return output;
  }
  RowMatrixXd w_dot =
      VariableJacobian(scene_, f_.structure_, {f_.directions_[static_cast<size_t>(parameter)]});
  for (int i = 0; own_state_ && i < f_.num_states(); ++i) w_dot.row(f_.outputs_[i]).setZero();
  RowMatrixXd column(f_.num_outputs(), 1);
  RunTangent({}, std::move(w_dot), &column, &output);
  *tangent = column;
  return output;
}

}  // namespace tangible
