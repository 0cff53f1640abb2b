// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "tangible/scene/set_parameters.h"
#include "tangible/simulation/events/event_edges.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

RolloutWorker::RolloutWorker(const RolloutFunction& function) : f_(function) {
  UseOwnScene();
  stepper_.emplace(model_);
  controls_.numbers = f_.control_numbers_;
}

void RolloutWorker::UseOwnScene() {
  scene_ = f_.scene_;
  BuildModelWithStructure(scene_, f_.structure_, &model_, &scene_state_);
  parameters_ = f_.OwnParameters();
}

bool RolloutWorker::SetParameters(const VectorX<double>& values, RolloutOutput* output) {
  const auto are_same = [&](const VectorX<double>& other) {
    return values.size() == other.size() &&
           (values.array() == other.array() || (values.array().isNaN() && other.array().isNaN()))
               .all();
  };
  if (are_same(parameters_)) return true;
  parameters_.resize(0);
  parameter_jacobian_.reset();
  if (are_same(f_.OwnParameters())) {
    UseOwnScene();
    return true;
  }
  if (!f_.OwnParameters().allFinite()) scene_ = f_.scene_;
  output->message = f_.SetOn(values, &scene_);
  if (!output->message.empty()) {
    UseOwnScene();
    output->status = RolloutStatus::kRefused;
    output->final = scene_state_;
    return false;
  }
  BuildModelWithStructure(scene_, f_.structure_, &model_, &scene_state_);
  parameters_ = values;
  return true;
}

bool RolloutWorker::Set(const RolloutInput& input, RolloutOutput* output) {
  output->states.setConstant(f_.num_records(), f_.num_states(), kNaN);
  if (!SetParameters(input.parameters, output)) {
    return false;
  }
  initial_ = scene_state_;
  own_state_ = input.state.size() > 0;
  if (own_state_) f_.SetState(input.state, &initial_);
  controls_.values.resize(input.controls.rows(),
                          static_cast<Eigen::Index>(controls_.numbers.size()));
  for (size_t j = 0; j < controls_.numbers.size(); ++j) {
    const int control = f_.control_of_number_[j];
    auto column = controls_.values.col(static_cast<Eigen::Index>(j));
    column = input.controls.col(control);
    if (!f_.LeavesControl(control)) continue;
    const double own = model_.parameters[static_cast<size_t>(controls_.numbers[j])];
    column = column.array().isNaN().select(own, column);
  }
  if (!input.state.allFinite() || !controls_.values.allFinite()) {
    output->status = RolloutStatus::kRefused;
    output->message = std::string(input.state.allFinite() ? "controls" : "initial_state") +
                      ": expected finite numbers";
    output->final = scene_state_;
    return false;
  }
  return true;
}

bool RolloutWorker::SetForDerivatives(const RolloutInput& input, RolloutOutput* output) {
  if (!Set(input, output)) return false;
  if (model_.structure->paths.empty() && !model_.structure->has_releases) return true;
  const RowMatrixXd directions(ParameterJacobian());
  output->message = CoincidingEdges(model_, directions);
  if (output->message.empty() && HasCoincidingPaths(model_, directions)) {
    const StateObserver look = [&](long, double, const State<double>&, Stepper* stepper) {
      if (stepper == nullptr || !output->message.empty()) return;
      stepper->parts().ForEachPart([&](const IslandRecord& island, const EventPart& part) {
        if (part.is_impulses || part.segment.edge_before < 0) return;
        const std::string coupled =
            CoupledPaths(model_, directions, island.NumberInWhole(part.segment.event_number),
                         island.NumberInWhole(part.segment.edge_before),
                         part.segment.time + part.segment.length);
        if (output->message.empty()) output->message = coupled;
      });
    };
    State<double> final;
    Rollout(Controlled(), initial_, look, &*stepper_, &final);
  }
  if (output->message.empty()) return true;
  output->status = RolloutStatus::kRefused;
  output->final = scene_state_;
  return false;
}

void RolloutWorker::RunAs(const Runner& run, RolloutOutput* output) {
  output->states.resize(f_.num_records(), f_.num_states());
  StartRows(&output->states);
  const StateObserver keep = [&](long k, double, const State<double>& state, Stepper*) {
    f_.samples_.Add(k, state, output->states.data());
  };
  output->SetReport(run(Controlled(), keep));
  FinishRows(output->report, &output->states);
}

void RolloutWorker::FinishRows(const RolloutReport& report, RowMatrixXd* rows) const {
  const auto reached =
      std::upper_bound(f_.records_.begin(), f_.records_.end(), report.steps) - f_.records_.begin();
  const Eigen::Index unreached = f_.num_records() - reached;
  rows->bottomRows(rows->rows() / f_.num_records() * unreached).setConstant(kNaN);
}

RolloutOutput RolloutWorker::Run(const RolloutInput& input) {
  RolloutOutput output;
  if (Set(input, &output)) {
    RunAs(
        [&](const ControlledModel<double>& model, const StateObserver& keep) {
          return Rollout(model, initial_, keep, &*stepper_, &output.final);
        },
        &output);
  }
  return output;
}

const Eigen::SparseMatrix<double>& RolloutWorker::ParameterJacobian() {
  if (!parameter_jacobian_) {
    parameter_jacobian_ = VariableJacobian(scene_, f_.structure_, f_.directions_);
  }
  return *parameter_jacobian_;
}

RowMatrixXd RolloutWorker::VariableDirections(const RowMatrixXd& parameters,
                                              const RowMatrixXd& states) {
  RowMatrixXd w_dot = ParameterJacobian() * parameters;
  for (int i = 0; i < f_.num_states(); ++i) {
    if (own_state_) w_dot.row(f_.outputs_[i]).setZero();
    w_dot.row(f_.outputs_[i]) += states.row(i);
  }
  return w_dot;
}

Certificate RolloutWorker::Certify(const RolloutInput& input, const std::vector<double>& sizes) {
  RolloutOutput output;
  if (!Set(input, &output)) {
    Certificate refused;
    refused.discontinuous = "there is no run: " + output.message;
    SetVerdict(refused);
    return refused;
  }
  const int states = own_state_ ? f_.num_states() : 0;
  const int columns = f_.num_parameters() + states;
  RowMatrixXd of_parameters = RowMatrixXd::Zero(f_.num_parameters(), columns);
  of_parameters.leftCols(f_.num_parameters()).setIdentity();
  RowMatrixXd of_states = RowMatrixXd::Zero(f_.num_states(), columns);
  of_states.rightCols(states).topRows(states).setIdentity();
  std::vector<std::string> names;
  for (const ParameterPath& parameter : f_.parameters_) names.push_back(parameter.path);
  const std::vector<std::string> outputs = OutputNames(*f_.structure_);
  names.insert(names.end(), outputs.begin(), outputs.begin() + states);
  const RowMatrixXd directions = VariableDirections(of_parameters, of_states);
  std::vector<StateRead> reads;
  for (const long steps : f_.records_) reads.push_back({steps});
  if (f_.num_controls() == 0) {
    return WithoutIdleKinks(input,
                            CertifyDerivative(model_, initial_, directions, names, sizes, reads));
  }
  CertifyOptions options{controls_.numbers, directions, names, reads};
  for (int i = 0; i < f_.structure_->num_parameters; ++i) {
    if (!directions.row(f_.structure_->ParameterVariable(i)).isZero(0.0)) {
      options.numbers.push_back(i);
    }
  }
  std::sort(options.numbers.begin(), options.numbers.end());
  return CertifyRollout(Controlled(), initial_, options);
}

RolloutOutput RolloutWorker::Jacobian(const RolloutInput& input, GradientMethod method,
                                      Inputs inputs, RowMatrixXd* jacobian, GradientMethod* used,
                                      double step) {
  RolloutOutput output;
  const long rows = f_.num_outputs();
  const long others = f_.num_states() + f_.num_steps() * f_.num_controls();
  const long columns = f_.num_parameters() + (inputs == Inputs::kAll ? others : 0);
  *used = MethodOf({.method = method}, Differentiated::kFinalState, columns, rows);
  jacobian->setConstant(rows, columns, kNaN);
  const bool set = *used == GradientMethod::kFiniteDifference ? Set(input, &output)
                                                              : SetForDerivatives(input, &output);
  if (!set) return output;
  switch (*used) {
    case GradientMethod::kAuto:
    case GradientMethod::kTangent:
      JacobianByTangent(jacobian, &output);
      break;
    case GradientMethod::kAdjoint:
      JacobianByAdjoint(jacobian, &output);
      break;
    case GradientMethod::kJet:
      JacobianByJets(JetRoute::kUnrolled, jacobian, &output);
      break;
    case GradientMethod::kJetImplicit:
      JacobianByJets(JetRoute::kImplicit, jacobian, &output);
      break;
    case GradientMethod::kFiniteDifference:
      JacobianByDifferences(step, jacobian, &output);
      break;
  }
  return output;
}

}  // namespace tangible
