// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A rollout as a pure function, with products of its derivatives, and batches of rollouts:
//
//   f(p, x₀, u) = [x(t_k) for the recorded steps k]
//
//   p    parameters of the scene                                  (num_parameters)
//   x₀   poses and twists of the moving bodies at the start: x, y, angle, vx, vy, omega of each,
//        in the order of OutputNames; absent: the scene's own     (num_states)
//   u    controls: forces, torques or efforts of joints that have a separate value in each
//        step                                                     (steps x num_controls)
//   f    a row for each recorded step                             (num_records x num_states)
//
//   tangent  ḟ = ∂f/∂p ṗ + ∂f/∂x₀ ẋ₀ + ∂f/∂u u̇                    (rollout_tangent.h)
//   adjoint  (p̄, x̄₀, ū) = (∂f/∂(p, x₀, u))ᵀ f̄                     (rollout_adjoint.h)
//
// Only memory is kept between calls, so that calls can be nested, chained and run on several
// threads; an evaluation has the same bits whatever ran before it, and a batch whatever the number
// of threads.

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/certificate/choices.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/simulation/gradient/state_samples.h"
#include "tangible/simulation/stepping/run_warnings.h"

namespace tangible {

struct RolloutInput {
  VectorX<double> parameters;
  VectorX<double> state;  ///< empty: that of the scene with its parameters
  RowMatrixXd controls;
};

/// One direction in the input, or the adjoint of one, with the members of RolloutInput; `state` is
/// filled in either case.
using InputDirection = RolloutInput;

using RolloutStatus = StepStatus;

struct RolloutOutput {
  RolloutStatus status = RolloutStatus::kDone;
  std::string message;  ///< empty unless it failed: when, where, what
  RowMatrixXd states;   ///< rows of steps that were not reached are NaN
  State<double> final;  ///< of all bodies: the last good state; the start's where nothing was run
  RolloutReport report;
  long fallbacks = 0;  ///< of unrolled Jets: steps that took the implicit derivative
  /// Of finite differences: which are one-sided, and within which contacts or modes change.
  std::vector<std::string> notes;

  /// Sets the report, and status and message from it.
  void SetReport(RolloutReport run);
};

/// The definition of the function, which does not change with the input.
class RolloutFunction {
 public:
  /// Resolves paths. `records` are the steps whose states are returned, ascending, 0 the start and
  /// num_steps() the end; empty: the end. Returns empty or one line: a path that matches nothing, a
  /// number that two parameters set, a control that is not a force, torque or effort or comes from
  /// a file, settings that the engine does not support, a step beyond the run.
  std::string Create(const Scene& scene, const std::vector<std::string>& parameters,
                     const std::vector<std::string>& controls, const std::vector<long>& records);
  /// The final state as a function of resolved parameters, of which two may set the same number.
  /// Nothing is checked.
  static RolloutFunction OfFinalState(const Scene& scene,
                                      const std::vector<ParameterPath>& parameters);

  const Scene& scene() const { return scene_; }
  const ModelStructure& structure() const { return *structure_; }
  int num_parameters() const { return static_cast<int>(parameters_.size()); }
  int num_controls() const { return static_cast<int>(controls_.size()); }
  int num_states() const { return static_cast<int>(outputs_.size()); }
  int num_records() const { return static_cast<int>(records_.size()); }
  /// The entries of all recorded states, those of one record after those of another.
  Eigen::Index num_outputs() const {
    return static_cast<Eigen::Index>(num_records()) * num_states();
  }
  long num_steps() const { return NumSteps(structure_->settings); }
  const std::vector<long>& records() const { return records_; }
  std::vector<double> record_times() const;
  const std::vector<ParameterPath>& parameters() const { return parameters_; }
  const std::vector<ParameterPath>& controls() const { return controls_; }
  /// The controls' numbers in the model, those of one control after those of another, and the
  /// control to which each belongs.
  const std::vector<int>& control_numbers() const { return control_numbers_; }
  const std::vector<int>& control_of_number() const { return control_of_number_; }
  /// The pose or twist variable of each entry of a state.
  const std::vector<int>& output_variables() const { return outputs_; }
  /// The part of a state that belongs to moving bodies, and its inverse.
  VectorX<double> StateOf(const State<double>& state) const;
  void SetState(const VectorX<double>& values, State<double>* state) const;
  /// The scene's own values of the parameters; NaN where those of a path's numbers differ, which as
  /// an input leaves them as they are.
  const VectorX<double>& OwnParameters() const { return own_parameters_; }
  /// Sets the parameters in a scene that has the function's own numbers where a value leaves them.
  /// Returns what tangible::SetParameters does.
  std::string SetOn(const VectorX<double>& values, Scene* scene) const;
  /// Whether the scene's own values of a control's numbers differ: NaN leaves them as they are.
  bool LeavesControl(int control) const {
    return std::isnan(own_controls_[static_cast<Eigen::Index>(control)]);
  }
  /// The scene's own values: parameters, the initial state, and controls that are the same in all
  /// steps; NaN as in OwnParameters.
  RolloutInput Defaults() const;
  /// Empty, or how an input's sizes are wrong.
  std::string CheckSizes(const RolloutInput& input) const;

 private:
  friend class RolloutWorker;
  std::string AddControl(const std::string& path);
  void ReadRecords();
  void ReadOwnValues();

  Scene scene_;
  std::shared_ptr<const ModelStructure> structure_;
  std::vector<ParameterPath> parameters_, controls_;
  std::vector<ParameterDirection> directions_;
  std::vector<int> control_numbers_;  ///< of the model: each control's, one after another
  std::vector<int> control_of_number_;
  VectorX<double> own_parameters_, own_controls_;
  std::vector<long> records_;
  std::vector<int> outputs_;  ///< pose and twist variables
  StateSamples samples_;      ///< a row for each output of each record
};

/// Evaluates one function on one thread; keeps memory from call to call. The function must outlive
/// it.
class RolloutWorker {
 public:
  explicit RolloutWorker(const RolloutFunction& function);

  /// Runs the rollout; the input's sizes must be right (CheckSizes).
  RolloutOutput Run(const RolloutInput& input);
  /// The same with products of derivatives along directions. `tangents[d]`: num_records x
  /// num_states.
  RolloutOutput Tangent(const RolloutInput& input, const std::vector<InputDirection>& directions,
                        std::vector<RowMatrixXd>* tangents);
  /// Record records a run; Adjoint may then be called repeatedly until the next call of any other
  /// member, and returns one adjoint for each of `bars` (num_records x num_states).
  RolloutOutput Record(const RolloutInput& input, const TapeOptions& options = {});
  /// What Record keeps.
  const RolloutTape& tape() const { return tape_; }
  std::vector<InputDirection> Adjoint(const std::vector<RowMatrixXd>& bars);
  enum class Inputs { kParameters, kAll };
  /// The Jacobian has a row for each output, num_records num_states in all; columns for parameters
  /// or, if all inputs are asked for, for parameters, initial state, controls (step by step). Auto
  /// selects tangent or adjoint, whichever needs fewer columns. `step` is that of finite
  /// differences, in the unit of the input; 0: kRelativeStep of it.
  RolloutOutput Jacobian(const RolloutInput& input, GradientMethod method, Inputs inputs,
                         RowMatrixXd* jacobian, GradientMethod* used, double step = 0.0);
  /// The derivatives for growing (sign 1) or shrinking (−1) parameters, each alone, by fixed steps
  /// (rollout_directional.h).
  RolloutOutput OneSidedJacobian(const RolloutInput& input, double sign, RowMatrixXd* jacobian);
  /// The tangent with respect to one parameter where all its numbers are moved by `shift`; refused
  /// where they may not be there.
  RolloutOutput TangentBeside(const RolloutInput& input, int parameter, double shift,
                              VectorX<double>* tangent);
  /// Warnings about joints, coordinates and energy at the end of the last run (run_warnings.h).
  std::vector<std::string> Warnings(const RolloutReport& report, const State<double>& final) const {
    RunWarnings warnings(model_, initial_);
    return warnings.Finish(model_, report, final);
  }
  /// The certificate of the derivatives with respect to parameters, controls and, where the input
  /// has one, the initial state; empty where the input is refused. `sizes` of parameters, without
  /// controls or initial state, as in DualityGap.
  Certificate Certify(const RolloutInput& input, const std::vector<double>& sizes = {});
  /// How far each parameter may be changed until another discrete choice is made
  /// (validity_radius.h): two runs a parameter, by events up to kBehindEnd beyond the end. Empty
  /// where the input is refused or the run fails.
  std::vector<ValidityRadius> Radii(const RolloutInput& input);
  /// The choices of the run with all numbers of a parameter moved by `shift`; false where they may
  /// not be there or the run fails.
  bool Choices(const RolloutInput& input, int parameter, double shift, ChoiceList* choices);
  /// Certificate::growth, by a tangent with a column for each entry of the state.
  double Growth(const RolloutInput& input);
  /// The model of the last input.
  const Model<double>& model() const { return model_; }

 private:
  class Beside;
  /// Sets the input; false and a refused output where a value is not allowed.
  bool Set(const RolloutInput& input, RolloutOutput* output);
  /// The same for derivatives other than differences, which edges at one instant may not have.
  bool SetForDerivatives(const RolloutInput& input, RolloutOutput* output);
  bool SetParameters(const VectorX<double>& values, RolloutOutput* output);
  void UseOwnScene();
  /// The model of the input, for one run.
  ControlledModel<double> Controlled() const {
    return f_.num_controls() == 0 ? ControlledModel<double>(model_)
                                  : ControlledModel<double>(model_, controls_);
  }
  /// Runs with an observer that keeps the recorded states; `run` is a rollout of some kind.
  using Runner = std::function<RolloutReport(const ControlledModel<double>&, const StateObserver&)>;
  void RunAs(const Runner& run, RolloutOutput* output);
  const Eigen::SparseMatrix<double>& ParameterJacobian();
  /// Directions of [poses | twists | parameters] from those of parameters and initial states, one
  /// in each column.
  RowMatrixXd VariableDirections(const RowMatrixXd& parameters, const RowMatrixXd& states);
  /// Rows, of outputs or of their derivatives, to which the samples are added: −0 + x is x, for −0
  /// too. Afterwards those of steps that were not reached become NaN.
  void StartRows(RowMatrixXd* rows) const { rows->setConstant(-0.0); }
  void FinishRows(const RolloutReport& report, RowMatrixXd* rows) const;
  TangentObserver KeepTangents(const StateObserver& keep, RowMatrixXd* rows) const;
  /// Runs with tangents; `rows` has a row for each output, a column for each direction.
  void RunTangent(const ControlDirections& directions, RowMatrixXd w_dot, RowMatrixXd* rows,
                  RolloutOutput* output);
  /// Runs the reverse sweep over the tape; `bars(row, column)` is the derivative of the column's
  /// loss with respect to an output.
  using Bars = std::function<double(int row, int column)>;
  RowMatrixXd Sweep(int columns, const Bars& bars, const RolloutTape::ControlSink& sink);
  RowMatrixXd ParameterBars(const RowMatrixXd& w_bar);
  void JacobianByTangent(RowMatrixXd* jacobian, RolloutOutput* output);
  void JacobianByAdjoint(RowMatrixXd* jacobian, RolloutOutput* output);
  void JacobianByJets(JetRoute route, RowMatrixXd* jacobian, RolloutOutput* output);
  /// Columns [first, first + N); false where the run fails.
  template <int N>
  bool JetPass(JetRoute route, Eigen::Index first, RowMatrixXd* jacobian, RolloutOutput* output);
  void JacobianByDifferences(double step, RowMatrixXd* jacobian, RolloutOutput* output);
  /// Whether the derivatives of all outputs by each parameter are those beside it on both sides.
  /// False where that is not looked at: beside an initial state or controls, for many parameters.
  bool BothSidesAgree(const RolloutInput& input);
  /// The certificate without kinks that do not matter (rollout_kinks.cc).
  Certificate WithoutIdleKinks(const RolloutInput& input, Certificate certificate);
  /// The choices of the input that is set; false where the run fails before its end.
  bool RunChoices(ChoiceList* choices);

  const RolloutFunction& f_;
  Scene scene_;
  VectorX<double> parameters_;  ///< those set in the scene; empty: set incompletely
  Model<double> model_;
  State<double> scene_state_, initial_;
  Controls controls_;
  bool own_state_ = false;  ///< the input has an initial state
  std::optional<Eigen::SparseMatrix<double>> parameter_jacobian_;
  std::optional<Stepper> stepper_;
  RolloutTape tape_;
};

/// Runs `work(worker, i)` for i in [0, count) on `threads` threads (0: one for each core) including
/// the caller's, each with a separate worker. An exception ends the work and is passed on
/// (worker_pool.h); one of the caller's interrupt check (interrupt.h) ends the runs too.
void ForEachRollout(const RolloutFunction& function, long count, int threads,
                    const std::function<void(RolloutWorker* worker, long i)>& work);

/// Many evaluations of one function at once: a row for each input.
class RolloutBatch {
 public:
  /// `threads` 0: one for each core. The function must outlive this object.
  RolloutBatch(const RolloutFunction& function, int threads)
      : function_(function), threads_(threads) {}

  std::vector<RolloutOutput> Run(const std::vector<RolloutInput>& inputs) const;
  /// One direction for each row.
  std::vector<RolloutOutput> Tangent(const std::vector<RolloutInput>& inputs,
                                     const std::vector<InputDirection>& directions,
                                     std::vector<RowMatrixXd>* tangents) const;
  /// Runs all rows, and keeps tapes of as many first rows as fit into `kTapeBudget`; the others are
  /// run again by Adjoint, which may be called repeatedly. A further Record replaces the tapes and
  /// reuses their memory.
  std::vector<RolloutOutput> Record(std::vector<RolloutInput> inputs);
  /// One bar for each row; for a row that failed all derivatives are NaN.
  std::vector<InputDirection> Adjoint(const std::vector<RowMatrixXd>& bars);
  std::vector<Certificate> Certify(const std::vector<RolloutInput>& inputs) const;

  static constexpr size_t kTapeBudget = size_t{512} << 20;  ///< bytes

 private:
  const RolloutFunction& function_;
  int threads_;
  std::vector<RolloutInput> inputs_;
  std::vector<RolloutStatus> statuses_;
  std::vector<std::unique_ptr<RolloutWorker>> tapes_;  ///< null: to be run again
};

}  // namespace tangible
