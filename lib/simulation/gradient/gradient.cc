// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/gradient/gradient.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "tangible/dynamics/model/settings.h"
#include "tangible/math/cpu_time.h"
#include "tangible/scene/scene_names.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/gradient/gradient_methods.h"
#include "tangible/simulation/stepping/joint_opening.h"

namespace tangible {
namespace {

// The message, with the scene's file in front if it has one.
std::string InFile(const Scene& scene, const std::string& message) {
  return (scene.path.empty() ? "" : scene.path + ": ") + message;
}

}  // namespace

namespace internal {

std::string FailureOf(const GradientProblem& problem, const RolloutOutput& output) {
  const bool ran =
      output.status == RolloutStatus::kUnsolved || output.status == RolloutStatus::kDiverged;
  return ran ? InFile(problem.scene(), output.message) : output.message;
}

bool Take(const GradientProblem& problem, const RolloutOutput& output, GradientResult* result) {
  result->message = FailureOf(problem, output);
  if (output.status != RolloutStatus::kDone) return false;
  result->values = output.states.row(0).transpose();
  result->fallbacks = output.fallbacks;
  result->notes.insert(result->notes.end(), output.notes.begin(), output.notes.end());
  if (output.fallbacks > 0) {
    result->notes.push_back(
        std::to_string(output.fallbacks) +
        " steps by the implicit derivative: the unrolled interior point failed, as at kinks");
  }
  return true;
}

}  // namespace internal

namespace {

using internal::GradientProblem;
using internal::Take;

// Empty, or one line: the first number of the scene that is not finite. A program, for example an
// optimiser, can set values that a file may not contain.
std::string CheckFinite(Scene scene) {
  for (const SceneNumber<double>& number : EnumerateNumbers(&scene)) {
    if (!std::isfinite(*number.value)) {
      return InFile(
          scene, number.path + ": expected a finite number, got " + std::to_string(*number.value));
    }
  }
  return "";
}

// Derivatives of the losses with respect to the outputs (outputs x losses), given the outputs.
using OutputSeed = std::function<MatrixX<double>(const VectorX<double>& values)>;

GradientProblem MakeProblem(const Scene& scene, const std::vector<ParameterPath>& parameters) {
  GradientProblem problem{RolloutFunction::OfFinalState(scene, parameters), {}};
  problem.input.parameters = problem.function.OwnParameters();
  return problem;
}

// Reports the memory of the tape; false, with a message, where it exceeds the budget.
bool ReportTape(const Checkpointing& checkpointing, const RolloutTape& tape,
                GradientResult* result) {
  result->tape_bytes = tape.peak_bytes();
  result->steps_again = tape.steps_again();
  if (checkpointing.kind == Checkpointing::Kind::kBudget &&
      result->tape_bytes > checkpointing.budget) {
    result->message = "the adjoint of " + std::to_string(tape.steps()) +
                      " steps needs more memory than its budget of " +
                      std::to_string(checkpointing.budget) +
                      " bytes: " + std::to_string(result->tape_bytes);
    return false;
  }
  return true;
}

// Derivatives of the losses with respect to the parameters: losses x parameters.
bool ByAdjoint(const GradientProblem& problem, const TapeOptions& options,
               const OutputSeed& output_seed, RolloutWorker* worker, GradientResult* result,
               RowMatrixXd* derivative) {
  if (!Take(problem, worker->Record(problem.input, options), result)) return false;
  const MatrixX<double> at_outputs = output_seed(result->values);
  std::vector<RowMatrixXd> bars;
  for (const auto& bar : at_outputs.colwise()) bars.emplace_back(bar.transpose());
  const std::vector<InputDirection> adjoints = worker->Adjoint(bars);
  derivative->resize(static_cast<Eigen::Index>(bars.size()), problem.input.parameters.size());
  for (size_t i = 0; i < bars.size(); ++i) {
    derivative->row(static_cast<Eigen::Index>(i)) = adjoints[i].parameters.transpose();
  }
  return ReportTape(options.checkpointing, worker->tape(), result);
}

// All methods except the adjoint: they compute the whole Jacobian, with which the gradient of a
// loss is multiplied.
bool ByRollouts(const GradientProblem& problem, const GradientOptions& options,
                RolloutWorker* worker, GradientResult* result) {
  GradientMethod used = options.method;
  return Take(problem,
              worker->Jacobian(problem.input, options.method, RolloutWorker::Inputs::kParameters,
                               &result->jacobian, &used, options.step),
              result);
}

bool IsByEvents(const GradientProblem& problem) {
  return problem.settings().stepping == Stepping::kEvent;
}

// Whether all that makes the derivative of fixed steps one-sided is contacts at a kink.
bool AreKinksResolved(const Certificate& certificate) {
  const bool contradicts = certificate.one_sided == kContradictingRows;
  return (certificate.degenerate_rows > 0 || contradicts) && certificate.discontinuous.empty() &&
         (certificate.one_sided.empty() || contradicts);
}

bool BySide(const GradientProblem& problem, DerivativeSide side, RolloutWorker* worker,
            GradientResult* result) {
  const bool by_events = IsByEvents(problem);
  if (by_events && !IsTrustworthyMap(result->certificate)) {
    return internal::JacobianBySides(problem, side, worker, result);
  }
  if (by_events) {
    return ByRollouts(problem, {.method = GradientMethod::kTangent}, worker, result);
  }
  const bool done =
      Take(problem,
           worker->OneSidedJacobian(problem.input, side == DerivativeSide::kPlus ? 1.0 : -1.0,
                                    &result->jacobian),
           result) &&
      internal::EdgesBySides(problem, side, worker, result);
  // The directional derivative solves a small LCP of contacts, not what supports and servos do
  // next, nor which corner takes over; the limits of the derivatives beside have these too.
  const ModelStructure& structure = problem.function.structure();
  if ((done && AreKinksResolved(result->certificate) && structure.supports.empty() &&
       structure.servos.empty()) ||
      IsTrustworthyMap(result->certificate)) {
    return done;
  }
  GradientResult beside = *result;
  if (!internal::JacobianBySides(problem, side, worker, &beside)) {
    if (done && AreKinksResolved(result->certificate)) return true;
    result->message = beside.message;
    return false;
  }
  *result = std::move(beside);
  return true;
}

bool RunMethod(const GradientProblem& problem, const GradientOptions& options,
               const OutputSeed& output_seed, RolloutWorker* worker, GradientResult* result,
               RowMatrixXd* derivative) {
  if (options.method == GradientMethod::kAdjoint) {
    return ByAdjoint(problem, {options.factorisations, options.checkpointing}, output_seed, worker,
                     result, derivative);
  }
  result->notes.clear();
  const bool done = options.side == DerivativeSide::kBoth
                        ? ByRollouts(problem, options, worker, result)
                        : BySide(problem, options.side, worker, result);
  if (!done) return false;
  *derivative = output_seed(result->values).transpose() * result->jacobian;
  return true;
}

bool TimeRollout(const GradientProblem& problem, RolloutWorker* worker, GradientResult* result) {
  const double start = ThreadCpuSeconds();
  const RolloutOutput output = worker->Run(problem.input);
  result->all_rollout_seconds.push_back(ThreadCpuSeconds() - start);
  result->message = internal::FailureOf(problem, output);
  result->open_joint = OpenJointOf(worker->model(), output.final, output.report.time);
  return result->message.empty();
}

Certificate CertificateOf(const GradientProblem& problem, RolloutWorker* worker) {
  std::vector<double> sizes;
  for (const ParameterPath& parameter : problem.function.parameters()) {
    sizes.push_back(std::max(std::abs(parameter.value), parameter.scale));
  }
  return worker->Certify(problem.input, sizes);
}

// Empty, or one line: why the derivative has no such side.
std::string CheckSide(const GradientProblem& problem, const GradientOptions& options) {
  if (options.side == DerivativeSide::kBoth) {
    return "";
  }
  if (options.method != GradientMethod::kTangent) {
    return "one-sided derivatives: expected the method tangent";
  }
  Scene scene = problem.scene();
  const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene);
  const bool plus = options.side == DerivativeSide::kPlus;
  const double towards = plus ? HUGE_VAL : -HUGE_VAL;
  for (const ParameterPath& parameter : problem.function.parameters()) {
    for (const int number : parameter.numbers) {
      if (!IsAllowed(numbers[number].kind, std::nextafter(*numbers[number].value, towards))) {
        return "parameter " + parameter.path + ": it has no derivative from " +
               (plus ? "above" : "below") + " at the end of its range, expected " +
               Describe(parameter.kind);
      }
    }
  }
  return "";
}

// Adds notes on what one-sided derivatives of fixed steps do not resolve.
void JudgeSide(const GradientProblem& problem, const GradientOptions& options,
               GradientResult* result) {
  const Certificate& certificate = result->certificate;
  if (options.side == DerivativeSide::kBoth || IsTrustworthyMap(certificate) ||
      IsByEvents(problem)) {
    return;
  }
  if (!result->notes.empty()) {
    return;  // of ends of force windows
  }
  if (!AreKinksResolved(certificate)) {
    result->notes.push_back("one-sided derivatives resolve contacts at a kink alone, not: " +
                            WithoutDiscreteMap(certificate.verdict));
  }
}

GradientResult Differentiate(const GradientProblem& problem, const GradientOptions& asked,
                             Differentiated what, const OutputSeed& output_seed,
                             RowMatrixXd* derivative) {
  GradientOptions options = asked;
  options.method = MethodOf(asked, what, problem.num_parameters(), problem.function.num_states());
  GradientResult result;
  result.outputs = OutputNames(problem.function.structure());
  result.method = options.method;
  std::string error;
  if (!CheckSettings(problem.scene(), &error)) {
    result.message = InFile(problem.scene(), error);
    return result;
  }
  result.message = CheckFinite(problem.scene());
  if (result.message.empty()) {
    result.message = CheckSide(problem, options);
  }
  if (!result.message.empty()) {
    return result;
  }
  // Event stepping needs the certificate to find out whether the two sides differ.
  const bool sides = options.side != DerivativeSide::kBoth;
  RolloutWorker worker(problem.function);
  if (sides) {
    result.certificate = CertificateOf(problem, &worker);
  }
  for (int i = 0; i < std::max(1, options.repeat); ++i) {
    if (!TimeRollout(problem, &worker, &result)) {
      return result;
    }
    const double start = ThreadCpuSeconds();
    if (!RunMethod(problem, options, output_seed, &worker, &result, derivative)) {
      return result;
    }
    result.all_seconds.push_back(ThreadCpuSeconds() - start);
  }
  const auto best = [](const std::vector<double>& times) {
    return *std::min_element(times.begin(), times.end());
  };
  if (!result.values.allFinite() || !derivative->allFinite()) {
    result.message =
        InFile(problem.scene(),
               "the derivative is not finite: it overflows, or the scene is too badly scaled");
    return result;
  }
  result.seconds = best(result.all_seconds);
  result.rollout_seconds = best(result.all_rollout_seconds);
  if (!sides && options.certificate == CertificatePass::kRun) {
    result.certificate = CertificateOf(problem, &worker);
  }
  if (options.radius == RadiusPass::kRun) {
    result.certificate.radius = worker.Radii(problem.input);
    result.certificate.growth = worker.Growth(problem.input);
  }
  JudgeSide(problem, options, &result);
  if (!result.open_joint.empty()) result.notes.push_back(result.open_joint);
  result.done = true;
  return result;
}

}  // namespace

std::vector<std::string> OutputNames(const ModelStructure& structure) {
  std::vector<std::string> names;
  for (const int body : structure.moving) {
    for (const char* component : {"x", "y", "angle", "vx", "vy", "omega"}) {
      names.push_back(structure.bodies[body].name + "/" + component);
    }
  }
  return names;
}

std::vector<int> OutputVariables(const ModelStructure& structure) {
  std::vector<int> variables;
  for (const int body : structure.moving) {
    for (int i = 0; i < 3; ++i) variables.push_back(structure.PoseVariable(body, i));
    for (int i = 0; i < 3; ++i) variables.push_back(structure.TwistVariable(body, i));
  }
  return variables;
}

GradientMethod MethodOf(const GradientOptions& options, Differentiated what, long parameters,
                        long outputs) {
  if (options.method != GradientMethod::kAuto) {
    return options.method;
  }
  if (options.side != DerivativeSide::kBoth) {
    return GradientMethod::kTangent;
  }
  const bool limits_memory = options.factorisations != Factorisations::kKeep ||
                             options.checkpointing.kind != Checkpointing::Kind::kAll;
  if (limits_memory || what == Differentiated::kLoss || parameters > outputs) {
    return GradientMethod::kAdjoint;
  }
  return GradientMethod::kTangent;
}

GradientResult FinalStateJacobian(const Scene& scene, const std::vector<ParameterPath>& parameters,
                                  const GradientOptions& options) {
  const GradientProblem problem = MakeProblem(scene, parameters);
  const auto all = [](const VectorX<double>& values) {
    return MatrixX<double>(MatrixX<double>::Identity(values.size(), values.size()));
  };
  RowMatrixXd jacobian;
  GradientResult result =
      Differentiate(problem, options, Differentiated::kFinalState, all, &jacobian);
  result.jacobian = std::move(jacobian);
  return result;
}

std::string OutputLoss::Create(const ModelStructure& structure,
                               const std::vector<LossTerm>& terms) {
  const std::vector<std::string> outputs = OutputNames(structure);
  terms_ = terms;
  places_.clear();
  for (const LossTerm& term : terms) {
    const auto found = std::find(outputs.begin(), outputs.end(), term.output);
    if (found == outputs.end()) return "output " + term.output + ": no such output of the scene";
    places_.push_back(found - outputs.begin());
  }
  return "";
}

double OutputLoss::Value(const VectorX<double>& outputs) const {
  double loss = 0.0;
  for (size_t i = 0; i < terms_.size(); ++i) {
    const double error = outputs[places_[i]] - terms_[i].target;
    loss += terms_[i].weight * error * error;
  }
  return loss;
}

VectorX<double> OutputLoss::Derivative(const VectorX<double>& outputs) const {
  VectorX<double> derivative = VectorX<double>::Zero(outputs.size());
  for (size_t i = 0; i < terms_.size(); ++i) {
    derivative[places_[i]] += 2.0 * terms_[i].weight * (outputs[places_[i]] - terms_[i].target);
  }
  return derivative;
}

GradientResult LossGradient(const Scene& scene, const std::vector<ParameterPath>& parameters,
                            const std::vector<LossTerm>& terms, const GradientOptions& options) {
  const GradientProblem problem = MakeProblem(scene, parameters);
  GradientResult result;
  OutputLoss loss;
  result.message = loss.Create(problem.function.structure(), terms);
  if (!result.message.empty()) return result;
  const auto seed = [&](const VectorX<double>& values) {
    return MatrixX<double>(loss.Derivative(values));
  };
  RowMatrixXd derivative;
  result = Differentiate(problem, options, Differentiated::kLoss, seed, &derivative);
  if (!result.done) return result;
  result.jacobian.resize(0, 0);
  result.gradient = derivative.row(0).transpose();
  result.loss = loss.Value(result.values);
  return result;
}

}  // namespace tangible
