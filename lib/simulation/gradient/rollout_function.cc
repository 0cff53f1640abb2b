// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/rollout_function.h"

#include <algorithm>
#include <atomic>
#include <set>

#include "tangible/dynamics/model/settings.h"
#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/scene/set_parameters.h"
#include "tangible/simulation/gradient/tolerances.h"

namespace tangible {
namespace {

RolloutStatus StatusOf(StepStatus status) {
  switch (status) {
    case StepStatus::kDone:
      return RolloutStatus::kDone;
    case StepStatus::kUnsolved:
      return RolloutStatus::kUnsolved;
    case StepStatus::kDiverged:
      return RolloutStatus::kDiverged;
  }
  return RolloutStatus::kUnsolved;
}

bool EndsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// Whether a canonical path is that of a force, a torque or an effort.
bool MayBeControlled(const std::string& path) {
  const bool of_force = path.rfind("forces/", 0) == 0;
  return (of_force && (EndsWith(path, "/force/x") || EndsWith(path, "/force/y") ||
                       EndsWith(path, "/torque"))) ||
         (path.rfind("joints/", 0) == 0 && EndsWith(path, "/effort"));
}

std::string SizeError(const char* what, const std::string& expected, const std::string& got) {
  return std::string(what) + ": expected " + expected + ", got " + got;
}

}  // namespace

const char* NameOf(RolloutStatus status) {
  switch (status) {
    case RolloutStatus::kDone:
      return "done";
    case RolloutStatus::kUnsolved:
      return "unsolved";
    case RolloutStatus::kDiverged:
      return "diverged";
    case RolloutStatus::kRefused:
      return "refused";
  }
  return "";
}

std::string RolloutFunction::AddControl(const std::string& path) {
  ParameterPath control;
  std::string error;
  if (!ResolveParameter(scene_, path, &control, &error)) return error;
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene_);
  for (const int number : control.numbers) {
    if (!MayBeControlled(numbers[number].path)) {
      return "control " + path + ": expected forces/NAME/force/x, forces/NAME/force/y, " +
             "forces/NAME/torque or joints/NAME/effort, got " + numbers[number].path;
    }
  }
  // Each is one parameter of the model, with the same value.
  const Eigen::SparseMatrix<double> map =
      VariableJacobian(scene_, structure_, {DirectionOf(control)});
  size_t found = 0;
  for (Eigen::SparseMatrix<double>::InnerIterator it(map, 0); it; ++it, ++found) {
    control_numbers_.push_back(static_cast<int>(it.row()) - 6 * structure_->num_bodies());
    control_of_number_.push_back(num_controls());
  }
  if (found != control.numbers.size()) {
    return "control " + path + ": expected a value that the scene gives, got one from a file";
  }
  controls_.push_back(std::move(control));
  return "";
}

std::string RolloutFunction::Create(const Scene& scene, const std::vector<std::string>& parameters,
                                    const std::vector<std::string>& controls,
                                    const std::vector<long>& records) {
  *this = RolloutFunction();
  scene_ = scene;
  std::string error;
  if (!CheckSettings(scene_, &error)) return error;
  structure_ = BuildStructure(scene_);
  outputs_ = OutputVariables(*structure_);
  for (const std::string& path : parameters) {
    ParameterPath parameter;
    if (!ResolveParameter(scene_, path, &parameter, &error)) return error;
    directions_.push_back(DirectionOf(parameter));
    parameters_.push_back(std::move(parameter));
  }
  for (const std::string& path : controls) {
    error = AddControl(path);
    if (!error.empty()) return error;
  }
  std::vector<ParameterPath> all = parameters_;
  all.insert(all.end(), controls_.begin(), controls_.end());
  if (!CheckApart(scene_, all, &error)) return error;
  records_ = records.empty() ? std::vector<long>{num_steps()} : records;
  for (size_t i = 0; i < records_.size(); ++i) {
    if (records_[i] < (i == 0 ? 0 : records_[i - 1] + 1) || records_[i] > num_steps()) {
      return "records: expected ascending steps from 0 to " + std::to_string(num_steps()) +
             ", got " + std::to_string(records_[i]);
    }
  }
  return "";
}

RolloutFunction RolloutFunction::OfFinalState(const Scene& scene,
                                              const std::vector<ParameterPath>& parameters) {
  RolloutFunction function;
  function.scene_ = scene;
  function.structure_ = BuildStructure(scene);
  function.outputs_ = OutputVariables(*function.structure_);
  function.parameters_ = parameters;
  for (const ParameterPath& parameter : parameters) {
    function.directions_.push_back(DirectionOf(parameter));
  }
  function.records_ = {function.num_steps()};
  return function;
}

std::vector<double> RolloutFunction::record_times() const {
  std::vector<double> times;
  for (const long k : records_) times.push_back(StepTime(structure_->settings, k));
  return times;
}

RolloutInput RolloutFunction::Defaults() const {
  RolloutInput input;
  input.parameters.resize(num_parameters());
  for (int i = 0; i < num_parameters(); ++i) input.parameters[i] = parameters_[i].value;
  input.controls.resize(num_controls() == 0 ? 0 : num_steps(), num_controls());
  for (int i = 0; i < num_controls(); ++i) input.controls.col(i).setConstant(controls_[i].value);
  Model<double> model;
  State<double> state;
  BuildModelWithStructure(scene_, structure_, &model, &state);
  input.state.resize(num_states());
  const int poses = static_cast<int>(state.pose.size());
  for (int i = 0; i < num_states(); ++i) {
    input.state[i] =
        outputs_[i] < poses ? state.pose[outputs_[i]] : state.twist[outputs_[i] - poses];
  }
  return input;
}

std::string RolloutFunction::CheckSizes(const RolloutInput& input) const {
  const auto shape = [](Eigen::Index rows, Eigen::Index columns) {
    return "(" + std::to_string(rows) + ", " + std::to_string(columns) + ")";
  };
  if (input.parameters.size() != num_parameters()) {
    return SizeError("parameters", std::to_string(num_parameters()) + " values",
                     std::to_string(input.parameters.size()));
  }
  if (input.state.size() != 0 && input.state.size() != num_states()) {
    return SizeError("initial_state", std::to_string(num_states()) + " values",
                     std::to_string(input.state.size()));
  }
  const long rows = num_controls() == 0 ? 0 : num_steps();
  if (input.controls.size() != rows * num_controls() ||
      (num_controls() > 0 && input.controls.cols() != num_controls())) {
    return SizeError("controls", "shape " + shape(num_steps(), num_controls()),
                     shape(input.controls.rows(), input.controls.cols()));
  }
  return "";
}

RolloutWorker::RolloutWorker(const RolloutFunction& function) : f_(function), scene_(f_.scene_) {
  BuildModelWithStructure(scene_, f_.structure_, &model_, &scene_state_);
  stepper_.emplace(model_);
  controls_.numbers = f_.control_numbers_;
  parameters_ = f_.Defaults().parameters;
}

bool RolloutWorker::SetParameters(const VectorX<double>& values, RolloutOutput* output) {
  if (values.size() == parameters_.size() && values == parameters_) {
    return true;
  }
  parameters_.resize(0);
  parameter_jacobian_.reset();
  output->message = tangible::SetParameters(f_.parameters_, values.data(), &scene_);
  if (!output->message.empty()) {
    scene_ = f_.scene_;
    BuildModelWithStructure(scene_, f_.structure_, &model_, &scene_state_);
    output->status = RolloutStatus::kRefused;
    output->final = scene_state_;
    if (f_.num_parameters() > 0) parameters_ = f_.Defaults().parameters;
    return false;
  }
  BuildModelWithStructure(scene_, f_.structure_, &model_, &scene_state_);
  parameters_ = values;
  return true;
}

bool RolloutWorker::Set(const RolloutInput& input, RolloutOutput* output) {
  output->states = RowMatrixXd::Constant(f_.num_records(), f_.num_states(),
                                         std::numeric_limits<double>::quiet_NaN());
  if (!SetParameters(input.parameters, output)) {
    return false;
  }
  initial_ = scene_state_;
  own_state_ = input.state.size() > 0;
  const int poses = static_cast<int>(initial_.pose.size());
  for (Eigen::Index i = 0; i < input.state.size(); ++i) {
    const int variable = f_.outputs_[i];
    (variable < poses ? initial_.pose[variable] : initial_.twist[variable - poses]) =
        input.state[i];
  }
  controls_.values.resize(input.controls.rows(),
                          static_cast<Eigen::Index>(controls_.numbers.size()));
  for (size_t j = 0; j < controls_.numbers.size(); ++j) {
    controls_.values.col(static_cast<Eigen::Index>(j)) =
        input.controls.col(f_.control_of_number_[j]);
  }
  if (!input.state.allFinite() || !input.controls.allFinite()) {
    output->status = RolloutStatus::kRefused;
    output->message = std::string(input.state.allFinite() ? "controls" : "initial_state") +
                      ": expected finite numbers";
    output->final = scene_state_;
    return false;
  }
  return true;
}

void RolloutWorker::RunAs(const Runner& run, RolloutOutput* output) {
  size_t next = 0;
  const int poses = static_cast<int>(initial_.pose.size());
  const StateObserver keep = [&](long k, double, const State<double>& state, Stepper*) {
    if (next < f_.records_.size() && f_.records_[next] == k) {
      for (int i = 0; i < f_.num_states(); ++i) {
        const int variable = f_.outputs_[i];
        output->states(static_cast<Eigen::Index>(next), i) =
            variable < poses ? state.pose[variable] : state.twist[variable - poses];
      }
      ++next;
    }
  };
  if (f_.num_controls() == 0) {
    ControlledModel<double> model(model_);
    output->report = run(&model, keep);
  } else {
    ControlledModel<double> model(model_, controls_);
    output->report = run(&model, keep);
  }
  output->status = StatusOf(output->report.status);
  output->message = output->report.message;
}

RolloutOutput RolloutWorker::Run(const RolloutInput& input) {
  RolloutOutput output;
  if (Set(input, &output)) {
    RunAs(
        [&](ControlledModel<double>* model, const StateObserver& keep) {
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

RolloutOutput RolloutWorker::Record(const RolloutInput& input, const TapeOptions& options) {
  RolloutOutput output;
  if (Set(input, &output)) {
    RunAs(
        [&](ControlledModel<double>* model, const StateObserver& keep) {
          return tape_.Record(model, initial_, options, keep, &output.final);
        },
        &output);
  }
  return output;
}

RowMatrixXd RolloutWorker::Sweep(int columns, const Bars& bars,
                                 const RolloutTape::ControlSink& sink) {
  RowMatrixXd w_bar;
  RowMatrixXd own(f_.num_states(), columns);
  int next = f_.num_records() - 1;
  const auto seed = [&](long k, RowMatrixXd* bar) {
    if (next < 0 || f_.records_[next] != k) return;
    own.setZero();
    bars(next--, &own);
    for (int i = 0; i < f_.num_states(); ++i) bar->row(f_.outputs_[i]) += own.row(i);
  };
  if (f_.num_controls() == 0) {
    ControlledModel<double> model(model_);
    tape_.AdjointFrom(&model, f_.records_.back(), columns, seed, sink, &w_bar);
  } else {
    ControlledModel<double> model(model_, controls_);
    tape_.AdjointFrom(&model, f_.records_.back(), columns, seed, sink, &w_bar);
  }
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
      columns,
      [&](int record, RowMatrixXd* own) {
        for (int d = 0; d < columns; ++d) own->col(d) = bars[d].row(record).transpose();
      },
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

Certificate RolloutWorker::Certify(const RolloutInput& input) {
  RolloutOutput output;
  if (!Set(input, &output)) return {};
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
  if (f_.num_controls() == 0) {
    return CertifyDerivative(model_, initial_, directions, names);
  }
  CertifyOptions options{controls_.numbers, directions, names};
  for (int i = 0; i < f_.structure_->num_parameters; ++i) {
    if (!directions.row(f_.structure_->ParameterVariable(i)).isZero(0.0)) {
      options.numbers.push_back(i);
    }
  }
  std::sort(options.numbers.begin(), options.numbers.end());
  RolloutReport report;
  ControlledModel<double> model(model_, controls_);
  return CertifyRollout(&model, initial_, options, &report);
}

RolloutOutput RolloutWorker::Jacobian(const RolloutInput& input, GradientMethod method,
                                      Inputs inputs, RowMatrixXd* jacobian, GradientMethod* used) {
  RolloutOutput output;
  const long rows = static_cast<long>(f_.num_records()) * f_.num_states();
  const long others = f_.num_states() + f_.num_steps() * f_.num_controls();
  const long columns = f_.num_parameters() + (inputs == Inputs::kAll ? others : 0);
  *used = MethodOf({.method = method}, Differentiated::kFinalState, columns, rows);
  jacobian->setConstant(rows, columns, std::numeric_limits<double>::quiet_NaN());
  if (!Set(input, &output)) return output;
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
      JacobianByDifferences(input, jacobian, &output);
      break;
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

void RolloutWorker::JacobianByAdjoint(RowMatrixXd* jacobian, RolloutOutput* output) {
  RunAs(
      [&](ControlledModel<double>* model, const StateObserver& keep) {
        return tape_.Record(model, initial_, TapeOptions{}, keep, &output->final);
      },
      output);
  if (output->status != RolloutStatus::kDone) return;
  const Eigen::Index first_control = f_.num_parameters() + f_.num_states();
  const bool all = jacobian->cols() > f_.num_parameters();
  jacobian->setZero();
  const RowMatrixXd w_bar = Sweep(
      static_cast<int>(jacobian->rows()),
      [&](int record, RowMatrixXd* own) {
        own->middleCols(static_cast<Eigen::Index>(record) * f_.num_states(), f_.num_states())
            .setIdentity();
      },
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

namespace {

constexpr int WidestJet() {
  int widest = 0;
#define TANGIBLE_WIDER(N) widest = N > widest ? N : widest;
  TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_WIDER)
#undef TANGIBLE_WIDER
  return widest;
}

}  // namespace

template <int N>
bool RolloutWorker::JetPass(JetRoute route, Eigen::Index first, RowMatrixXd* jacobian,
                            RolloutOutput* output) {
  Model<Jet<N>> model;
  State<Jet<N>> state;
  BuildModelWithStructure(
      SeededScene<Jet<N>>(scene_, f_.directions_,
                          static_cast<int>(std::min<Eigen::Index>(first, f_.num_parameters()))),
      f_.structure_, &model, &state);
  // The columns after the parameters are initial states, and then controls.
  const auto seed = [&](Eigen::Index column, Jet<N>* value) {
    if (column >= first && column < first + N) value->v[column - first] += 1.0;
  };
  const int poses = static_cast<int>(state.pose.size());
  for (int i = 0; i < f_.num_states(); ++i) {
    const int variable = f_.outputs_[i];
    Jet<N>& value = variable < poses ? state.pose[variable] : state.twist[variable - poses];
    if (own_state_) {
      value = Jet<N>(variable < poses ? initial_.pose[variable] : initial_.twist[variable - poses]);
    }
    seed(f_.num_parameters() + i, &value);
  }
  BasicControls<Jet<N>> controls{controls_.numbers, controls_.values.template cast<Jet<N>>()};
  for (Eigen::Index k = 0; k < controls.values.rows(); ++k) {
    for (size_t j = 0; j < controls.numbers.size(); ++j) {
      seed(f_.num_parameters() + f_.num_states() + k * f_.num_controls() + f_.control_of_number_[j],
           &controls.values(k, static_cast<Eigen::Index>(j)));
    }
  }
  ControlledModel<Jet<N>> plain(model);
  ControlledModel<Jet<N>> controlled(model, controls);
  size_t next = 0;
  const JetObserver<Jet<N>> keep = [&](long k, double, const State<Jet<N>>& now) {
    if (next == f_.records_.size() || f_.records_[next] != k) return;
    for (int i = 0; i < f_.num_states(); ++i) {
      const int variable = f_.outputs_[i];
      const Jet<N>& x = variable < poses ? now.pose[variable] : now.twist[variable - poses];
      output->states(static_cast<Eigen::Index>(next), i) = x.a;
      for (int d = 0; d < N && first + d < jacobian->cols(); ++d) {
        (*jacobian)(static_cast<Eigen::Index>(next) * f_.num_states() + i, first + d) = x.v[d];
      }
    }
    ++next;
  };
  long fallbacks = 0;
  State<Jet<N>> final;
  output->report = RolloutJets<Jet<N>>(f_.num_controls() == 0 ? &plain : &controlled, state, route,
                                       keep, &final, &fallbacks);
  output->fallbacks += fallbacks;
  output->final = ValuesOf(final);
  output->status = StatusOf(output->report.status);
  output->message = output->report.message;
  return output->status == RolloutStatus::kDone;
}

void RolloutWorker::JacobianByJets(JetRoute route, RowMatrixXd* jacobian, RolloutOutput* output) {
  constexpr int kWidth = WidestJet();
  if constexpr (kWidth == 0) {
    output->status = RolloutStatus::kRefused;
    output->message =
        "methods jet and jet_implicit: no width of Jets was built (TANGIBLE_JET_WIDTHS is empty)";
  } else {
    bool good = true;
    // Without columns one pass gives the states.
    for (Eigen::Index first = 0; good && (first == 0 || first < jacobian->cols());
         first += kWidth) {
      good = JetPass<kWidth>(route, first, jacobian, output);
    }
  }
}

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

void ForEachRollout(const RolloutFunction& function, long count, int threads,
                    const std::function<void(RolloutWorker* worker, long i)>& work) {
  const int used = static_cast<int>(std::min<long>(NumThreads(threads), std::max(1L, count)));
  WorkerPool pool(used);
  std::vector<std::optional<RolloutWorker>> workers(static_cast<size_t>(used));
  pool.Run(static_cast<size_t>(count), used, [&](size_t i, int thread) {
    std::optional<RolloutWorker>& worker = workers[static_cast<size_t>(thread)];
    if (!worker) worker.emplace(function);
    work(&*worker, static_cast<long>(i));
  });
}

std::vector<RolloutOutput> RolloutBatch::Run(const std::vector<RolloutInput>& inputs) const {
  std::vector<RolloutOutput> outputs(inputs.size());
  ForEachRollout(function_, static_cast<long>(inputs.size()), threads_,
                 [&](RolloutWorker* worker, long i) { outputs[i] = worker->Run(inputs[i]); });
  return outputs;
}

std::vector<RolloutOutput> RolloutBatch::Tangent(const std::vector<RolloutInput>& inputs,
                                                 const std::vector<InputDirection>& directions,
                                                 std::vector<RowMatrixXd>* tangents) const {
  std::vector<RolloutOutput> outputs(inputs.size());
  tangents->resize(inputs.size());
  ForEachRollout(function_, static_cast<long>(inputs.size()), threads_,
                 [&](RolloutWorker* worker, long i) {
                   std::vector<RowMatrixXd> one;
                   outputs[i] = worker->Tangent(inputs[i], {directions[i]}, &one);
                   (*tangents)[i] = std::move(one[0]);
                 });
  return outputs;
}

std::vector<RolloutOutput> RolloutBatch::Record(std::vector<RolloutInput> inputs) {
  inputs_ = std::move(inputs);
  std::vector<RolloutOutput> outputs(inputs_.size());
  tapes_.resize(inputs_.size());
  std::atomic<size_t> bytes{0};
  ForEachRollout(function_, static_cast<long>(inputs_.size()), threads_,
                 [&](RolloutWorker* worker, long i) {
                   if (bytes >= kTapeBudget) {
                     tapes_[i].reset();
                     outputs[i] = worker->Run(inputs_[i]);
                     return;
                   }
                   if (tapes_[i] == nullptr) {
                     tapes_[i] = std::make_unique<RolloutWorker>(function_);
                   }
                   outputs[i] = tapes_[i]->Record(inputs_[i]);
                   bytes += tapes_[i]->tape().bytes();
                 });
  statuses_.clear();
  for (const RolloutOutput& output : outputs) statuses_.push_back(output.status);
  return outputs;
}

std::vector<InputDirection> RolloutBatch::Adjoint(const std::vector<RowMatrixXd>& bars) {
  std::vector<InputDirection> results(inputs_.size());
  ForEachRollout(function_, static_cast<long>(inputs_.size()), threads_,
                 [&](RolloutWorker* worker, long i) {
                   if (statuses_[i] != RolloutStatus::kDone) {
                     constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
                     results[i].parameters.setConstant(function_.num_parameters(), kNan);
                     results[i].state.setConstant(function_.num_states(), kNan);
                     results[i].controls.setConstant(inputs_[i].controls.rows(),
                                                     inputs_[i].controls.cols(), kNan);
                     return;
                   }
                   if (tapes_[i] == nullptr) worker->Record(inputs_[i]);
                   RolloutWorker* const recorded = tapes_[i] == nullptr ? worker : tapes_[i].get();
                   results[i] = recorded->Adjoint({bars[i]})[0];
                 });
  return results;
}

std::vector<Certificate> RolloutBatch::Certify(const std::vector<RolloutInput>& inputs) const {
  std::vector<Certificate> certificates(inputs.size());
  ForEachRollout(
      function_, static_cast<long>(inputs.size()), threads_,
      [&](RolloutWorker* worker, long i) { certificates[i] = worker->Certify(inputs[i]); });
  return certificates;
}

}  // namespace tangible
