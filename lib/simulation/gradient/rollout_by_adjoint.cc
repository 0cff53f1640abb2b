// SPDX-License-Identifier: Apache-2.0
//
// Reverse mode: a recorded run, and sweeps with a column for each loss.
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

RolloutOutput RolloutWorker::Record(const RolloutInput& input, const TapeOptions& options) {
  RolloutOutput output;
  if (SetForDerivatives(input, &output)) {
    RunAs(
        [&](const ControlledModel<double>& model, const StateObserver& keep) {
          return tape_.Record(model, initial_, options, keep, &output.final);
        },
        &output);
  }
  return output;
}

RowMatrixXd RolloutWorker::Sweep(int columns, const Bars& bars,
                                 const RolloutTape::ControlSink& sink) {
  RowMatrixXd w_bar;
  const auto seed = [&](long k, RowMatrixXd* w_bar_k) {
    f_.samples_.ForEachBar(k, *f_.structure_, [&](int row, double weight, int variable) {
      for (int c = 0; c < columns; ++c) (*w_bar_k)(variable, c) += weight * bars(row, c);
    });
  };
  tape_.AdjointFrom(Controlled(), f_.records_.back(), columns, seed, &w_bar, sink);
  return w_bar;
}

// (num_parameters x columns)
RowMatrixXd RolloutWorker::ParameterBars(const RowMatrixXd& w_bar) {
  if (!own_state_) return ParameterJacobian().transpose() * w_bar;
  RowMatrixXd without_state = w_bar;
  for (const int variable : f_.outputs_) without_state.row(variable).setZero();
  return ParameterJacobian().transpose() * without_state;
}

std::vector<InputDirection> RolloutWorker::Adjoint(const std::vector<RowMatrixXd>& bars) {
  const auto columns = static_cast<int>(bars.size());
  std::vector<InputDirection> results(bars.size());
  for (InputDirection& result : results) {
    result.controls.setZero(f_.num_controls() == 0 ? 0 : f_.num_steps(), f_.num_controls());
  }
  const RowMatrixXd w_bar = Sweep(
      columns, [&](int row, int d) { return bars[static_cast<size_t>(d)].data()[row]; },
      [&](long k, const RowMatrixXd& controls_bar) {
        for (Eigen::Index j = 0; j < controls_bar.rows(); ++j) {
          for (int d = 0; d < columns; ++d) {
            results[d].controls(k, f_.control_of_number_[j]) += controls_bar(j, d);
          }
        }
      });
  const RowMatrixXd parameters = ParameterBars(w_bar);
  for (int d = 0; d < columns; ++d) {
    results[d].parameters = parameters.col(d);
    results[d].state.resize(f_.num_states());
    for (int i = 0; i < f_.num_states(); ++i) results[d].state[i] = w_bar(f_.outputs_[i], d);
  }
  return results;
}

void RolloutWorker::JacobianByAdjoint(RowMatrixXd* jacobian, RolloutOutput* output) {
  RunAs(
      [&](const ControlledModel<double>& model, const StateObserver& keep) {
        return tape_.Record(model, initial_, TapeOptions{}, keep, &output->final);
      },
      output);
  if (output->status != RolloutStatus::kDone) return;
  const Eigen::Index first_control = f_.num_parameters() + f_.num_states();
  const bool all = jacobian->cols() > f_.num_parameters();
  jacobian->setZero();
  const RowMatrixXd w_bar = Sweep(
      static_cast<int>(jacobian->rows()),
      [](int row, int column) { return row == column ? 1.0 : 0.0; },
      [&](long k, const RowMatrixXd& controls_bar) {
        for (Eigen::Index j = 0; all && j < controls_bar.rows(); ++j) {
          jacobian->col(first_control + k * f_.num_controls() + f_.control_of_number_[j]) +=
              controls_bar.row(j).transpose();
        }
      });
  jacobian->leftCols(f_.num_parameters()) = ParameterBars(w_bar).transpose();
  for (int i = 0; all && i < f_.num_states(); ++i) {
    jacobian->col(f_.num_parameters() + i) = w_bar.row(f_.outputs_[i]).transpose();
  }
}

}  // namespace tangible
