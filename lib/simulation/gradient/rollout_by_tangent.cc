// SPDX-License-Identifier: Apache-2.0
//
// Forward mode: a column for each direction.
#include <algorithm>
#include <utility>

#include "tangible/simulation/derivatives/rollout_directional.h"
#include "tangible/simulation/gradient/rollout_beside.h"

namespace tangible {

TangentObserver RolloutWorker::KeepTangents(const StateObserver& keep_state,
                                            const TangentKeeper& keep) const {
  return [this, keep_state, keep, next = 0](long k, double t, const State<double>& state,
                                            const RowMatrixXd& w_dot) mutable {
    keep_state(k, t, state, nullptr);
    if (next < f_.num_records() && f_.records_[next] == k) keep(next++, w_dot);
  };
}

RolloutWorker::TangentKeeper RolloutWorker::KeepRows(RowMatrixXd* jacobian) const {
  return [this, jacobian](int record, const RowMatrixXd& w_dot) {
    for (int i = 0; i < f_.num_states(); ++i) {
      jacobian->row(static_cast<Eigen::Index>(record) * f_.num_states() + i) =
          w_dot.row(f_.outputs_[i]);
    }
  };
}

void RolloutWorker::RunTangent(const ControlDirections& directions, RowMatrixXd w_dot,
                               const TangentKeeper& keep, RolloutOutput* output) {
  RunAs(
      [&](ControlledModel<double>* model, const StateObserver& keep_state) {
        return RolloutTangent(model, initial_, directions, KeepTangents(keep_state, keep),
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
                   RowMatrixXd::Constant(f_.num_records(), f_.num_states(), kNaN));
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
  RunTangent(set_controls, VariableDirections(parameters, states), KeepRows(jacobian), output);
}

RolloutOutput RolloutWorker::OneSidedJacobian(const RolloutInput& input, double sign,
                                              RowMatrixXd* jacobian) {
  RolloutOutput output;
  const int parameters = f_.num_parameters();
  jacobian->setConstant(static_cast<Eigen::Index>(f_.num_records()) * f_.num_states(), parameters,
                        kNaN);
  if (!Set(input, &output)) return output;
  RowMatrixXd w_dot = sign * VariableDirections(RowMatrixXd::Identity(parameters, parameters),
                                                RowMatrixXd::Zero(f_.num_states(), parameters));
  RunAs(
      [&](ControlledModel<double>* model, const StateObserver& keep_state) {
        return RolloutDirectional(model, initial_, KeepTangents(keep_state, KeepRows(jacobian)),
                                  &*stepper_, &w_dot, &output.final);
      },
      &output);
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
  RowMatrixXd column =
      RowMatrixXd::Constant(static_cast<Eigen::Index>(f_.num_records()) * f_.num_states(), 1, kNaN);
  RunTangent({}, std::move(w_dot), KeepRows(&column), &output);
  *tangent = column;
  return output;
}

}  // namespace tangible
