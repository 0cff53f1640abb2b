// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/engine_step.h"

namespace tangible {
namespace {

Model<double> ModelOf(const RolloutFunction& function, State<double>* start) {
  Model<double> model;
  BuildModel(function.scene(), &model, start);
  return model;
}

}  // namespace

EngineStep::EngineStep(const RolloutFunction& function)
    : function_(function), model_(ModelOf(function, &start_)), stepper_(model_) {
  const ModelStructure& s = *model_.structure;
  controls_.setZero(s.num_variables(), num_controls());
  for (size_t j = 0; j < function.control_numbers().size(); ++j) {
    controls_(s.ParameterVariable(function.control_numbers()[j]), function.control_of_number()[j]) =
        1.0;
  }
  tangent_.FixNumbers(s, controls_);
}

State<double> EngineStep::StateOf(long k, const VectorX<double>& x) const {
  State<double> state = start_;
  const ModelStructure& s = *model_.structure;
  const double t = static_cast<double>(k) * s.settings.dt;
  // Bodies that move by themselves keep their speed.
  for (size_t i = 0; i < state.pose.size(); ++i) state.pose[i] += t * state.twist[i];
  const int poses = static_cast<int>(state.pose.size());
  for (int i = 0; i < num_states(); ++i) {
    const int variable = function_.output_variables()[i];
    (variable < poses ? state.pose[variable] : state.twist[variable - poses]) = x[i];
  }
  return state;
}

bool EngineStep::Advance(long k, const VectorX<double>& x, const VectorX<double>& u,
                         VectorX<double>* next, std::string* error) {
  for (size_t j = 0; j < function_.control_numbers().size(); ++j) {
    model_.parameters[function_.control_numbers()[j]] = u[function_.control_of_number()[j]];
  }
  if (!x.allFinite() || !u.allFinite()) {
    *error = "step " + std::to_string(k) + ": expected finite states and controls";
    return false;
  }
  State<double> state = StateOf(k, x);
  const double h = model_.structure->settings.dt;
  const double t = static_cast<double>(k) * h;
  stepper_.ClearGuess();
  const StepReport report = stepper_.Step(model_, t, h, &state);
  if (report.status != StepStatus::kDone) {
    *error = FailureMessage(report, t, k);
    return false;
  }
  next->resize(num_states());
  const int poses = static_cast<int>(state.pose.size());
  for (int i = 0; i < num_states(); ++i) {
    const int variable = function_.output_variables()[i];
    (*next)[i] = variable < poses ? state.pose[variable] : state.twist[variable - poses];
  }
  return true;
}

bool EngineStep::Step(long k, const VectorX<double>& x, const VectorX<double>& u,
                      VectorX<double>* next, std::string* error) {
  return Advance(k, x, u, next, error);
}

bool EngineStep::Linearise(long k, const VectorX<double>& x, const VectorX<double>& u,
                           VectorX<double>* next, MatrixX<double>* a, MatrixX<double>* b,
                           std::string* error) {
  return LineariseAlong(k, x, u, MatrixX<double>::Identity(num_states(), num_states()), next, a, b,
                        error);
}

bool EngineStep::LineariseAlong(long k, const VectorX<double>& x, const VectorX<double>& u,
                                const MatrixX<double>& columns, VectorX<double>* next,
                                MatrixX<double>* a, MatrixX<double>* b, std::string* error) {
  if (!Advance(k, x, u, next, error)) return false;
  w_dot_.setZero(controls_.rows(), columns.cols() + num_controls());
  w_dot_.rightCols(num_controls()) = controls_;
  for (int i = 0; i < num_states(); ++i) {
    w_dot_.row(function_.output_variables()[i]).head(columns.cols()) = columns.row(i);
  }
  tangent_.Apply(model_, &stepper_, &w_dot_);
  a->resize(num_states(), columns.cols());
  b->resize(num_states(), num_controls());
  for (int i = 0; i < num_states(); ++i) {
    const auto row = w_dot_.row(function_.output_variables()[i]);
    a->row(i) = row.head(columns.cols());
    b->row(i) = row.tail(num_controls());
  }
  if (a->allFinite() && b->allFinite()) return true;
  *error = "step " + std::to_string(k) + ": its derivative is not finite";
  return false;
}

}  // namespace tangible
