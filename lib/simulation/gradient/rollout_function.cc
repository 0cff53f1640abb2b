// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/rollout_function.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/dynamics/model/settings.h"
#include "tangible/dynamics/model/state_variable.h"
#include "tangible/scene/set_parameters.h"

namespace tangible {
namespace {

bool EndsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// Whether a canonical path is that of a force, a torque, an effort, or the target of a servo.
bool MayBeControlled(const std::string& path) {
  const bool of_force = path.rfind("forces/", 0) == 0;
  const bool of_joint = path.rfind("joints/", 0) == 0;
  const auto is_drive = [&](const std::string& end) {
    return (of_force && (EndsWith(path, "/force/x" + end) || EndsWith(path, "/force/y" + end) ||
                         EndsWith(path, "/torque" + end))) ||
           (of_joint && EndsWith(path, "/effort" + end));
  };
  return is_drive("") || is_drive("/target");
}

std::string SizeError(const char* what, const std::string& expected, const std::string& got) {
  return std::string(what) + ": expected " + expected + ", got " + got;
}

}  // namespace

void RolloutOutput::SetReport(RolloutReport run) {
  report = std::move(run);
  status = report.status;
  message = report.message;
}

std::string RolloutFunction::AddControl(const std::string& path) {
  ParameterPath control;
  std::string error;
  if (!ResolveParameter(scene_, path, &control, &error)) return error;
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene_);
  for (const int number : control.numbers) {
    if (!MayBeControlled(numbers[number].path)) {
      return "control " + path + ": expected forces/NAME/force/x, forces/NAME/force/y, " +
             "forces/NAME/torque or joints/NAME/effort (or its /target), got " +
             numbers[number].path;
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
  structure_ = WithFreePoints(scene_, structure_, directions_);
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
  ReadRecords();
  ReadOwnValues();
  return "";
}

void RolloutFunction::ReadOwnValues() {
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene_);
  const auto values = [&](const std::vector<ParameterPath>& paths) {
    VectorX<double> own(static_cast<Eigen::Index>(paths.size()));
    for (size_t k = 0; k < paths.size(); ++k) {
      const double first = paths[k].value;
      const bool are_equal = std::all_of(paths[k].numbers.begin(), paths[k].numbers.end(),
                                         [&](int i) { return *numbers[i].value == first; });
      own[static_cast<Eigen::Index>(k)] = are_equal ? first : kNaN;
    }
    return own;
  };
  own_parameters_ = values(parameters_);
  own_controls_ = values(controls_);
}

std::string RolloutFunction::SetOn(const VectorX<double>& values, Scene* scene) const {
  if (own_parameters_.allFinite()) return SetParameters(parameters_, values.data(), scene);
  std::vector<ParameterPath> set;
  std::vector<double> to;
  for (size_t k = 0; k < parameters_.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    if (std::isnan(values[i]) && std::isnan(own_parameters_[i])) continue;
    set.push_back(parameters_[k]);
    to.push_back(values[i]);
  }
  return SetParameters(set, to.data(), scene);
}

void RolloutFunction::ReadRecords() {
  samples_ = StateSamples([this](const auto& use) {
    int row = 0;
    for (const long k : records_) {
      for (const int body : structure_->moving) {
        use(k, StateShare{row, body, StatePart::kPose});
        use(k, StateShare{row + 3, body, StatePart::kTwist});
        row += 6;
      }
    }
  });
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
  function.structure_ = WithFreePoints(scene, function.structure_, function.directions_);
  function.records_ = {function.num_steps()};
  function.ReadRecords();
  function.ReadOwnValues();
  return function;
}

std::vector<double> RolloutFunction::record_times() const {
  std::vector<double> times;
  for (const long k : records_) times.push_back(StepTime(structure_->settings, k));
  return times;
}

VectorX<double> RolloutFunction::StateOf(const State<double>& state) const {
  VectorX<double> values(num_states());
  for (int i = 0; i < num_states(); ++i) values[i] = StateNumber(state, outputs_[i]);
  return values;
}

void RolloutFunction::SetState(const VectorX<double>& values, State<double>* state) const {
  for (int i = 0; i < num_states(); ++i) StateNumber(state, outputs_[i]) = values[i];
}

RolloutInput RolloutFunction::Defaults() const {
  RolloutInput input;
  input.parameters = OwnParameters();
  input.controls.resize(num_controls() == 0 ? 0 : num_steps(), num_controls());
  for (int i = 0; i < num_controls(); ++i) input.controls.col(i).setConstant(own_controls_[i]);
  Model<double> model;
  State<double> state;
  BuildModelWithStructure(scene_, structure_, &model, &state);
  input.state = StateOf(state);
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

}  // namespace tangible
