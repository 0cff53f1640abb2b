// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/tape_gradient.h"

#include <adolc/adolc.h>

// The functions that the engine's templates require of a scalar. They are in the global namespace
// like ADOL-C's own names: there the templates, which were declared earlier, find them by their
// argument.
inline double ValueOf(const adouble& x) { return x.value(); }

namespace tangible {

// One derivative direction is enough, because the reverse sweep computes all derivatives.
template <>
struct NumDerivatives<adouble> {
  static constexpr int value = 1;
};

}  // namespace tangible

template <>
struct Eigen::NumTraits<adouble> : Eigen::NumTraits<double> {
  using Real = adouble;
  using NonInteger = adouble;
  using Nested = adouble;
  // NOLINTNEXTLINE(readability-identifier-naming): Eigen's name
  enum { RequireInitialization = 1 };
};

#include <algorithm>
#include <new>

#include "tangible/dynamics/assembly/assembly_inl.h"
#include "tangible/dynamics/elements/force_inl.h"
#include "tangible/dynamics/elements/joint_inl.h"
#include "tangible/dynamics/model/state_variable.h"
#include "tangible/geometry/contact_geometry_inl.h"
#include "tangible/lcp/contact/contact_interior_point_iteration_inl.h"
#include "tangible/lcp/system/block_lu_inl.h"
#include "tangible/math/cpu_time.h"
#include "tangible/simulation/stepping/step_unrolled_inl.h"

namespace tangible::cost {
namespace {

constexpr short kTape = 1;
// Buffers of operations, locations, values and Taylor coefficients, entries. The excess would be
// written to files, which would hide the memory of a tape.
constexpr unsigned kOperations = 64u << 20;
constexpr unsigned kLocations = 112u << 20;
constexpr unsigned kValues = 16u << 20;
constexpr unsigned kCoefficients = 32u << 20;

// The indices of the terms' outputs among the state's poses and twists; empty if one has none.
std::vector<int> PlacesOf(const ModelStructure& structure, const std::vector<LossTerm>& terms) {
  const std::vector<std::string> outputs = OutputNames(structure);
  std::vector<int> places;
  for (const LossTerm& term : terms) {
    const auto found = std::find(outputs.begin(), outputs.end(), term.output);
    if (found == outputs.end()) {
      return {};
    }
    const int index = static_cast<int>(found - outputs.begin());
    const int body = structure.moving[index / 6];
    const int component = index % 6;
    places.push_back(component < 3 ? structure.PoseVariable(body, component)
                                   : structure.TwistVariable(body, component - 3));
  }
  return places;
}

class TapedRollout {
 public:
  TapedRollout(const Model<double>& model, const State<double>& initial,
               const std::vector<LossTerm>& terms, const std::vector<int>& places)
      : model_(model), initial_(initial), terms_(terms), places_(places) {}

  // Derivatives of the loss with respect to all variables; empty with a message where it fails.
  std::vector<double> Gradient(double* loss, std::string* message) {
    variables_.assign(initial_.pose.begin(), initial_.pose.end());
    variables_.insert(variables_.end(), initial_.twist.begin(), initial_.twist.end());
    variables_.insert(variables_.end(), model_.parameters.begin(), model_.parameters.end());
    trace_on(kTape, 1, kOperations, kLocations, kValues, kCoefficients, 0);
    const bool recorded = Record(loss, message);
    trace_off();
    CheckThatItFitted();
    std::vector<double> bar(variables_.size());
    double one = 1.0;
    if (!recorded || fos_reverse(kTape, 1, static_cast<int>(bar.size()), &one, bar.data()) < 0) {
      *message = message->empty() ? "ADOL-C: the reverse sweep failed" : *message;
      return {};
    }
    return bar;
  }

 private:
  bool Record(double* loss, std::string* message) {
    Model<adouble> model{model_.structure, std::vector<adouble>(model_.parameters.size())};
    State<adouble> state;
    state.pose.resize(initial_.pose.size());
    state.twist.resize(initial_.twist.size());
    size_t next = 0;
    for (std::vector<adouble>* part : {&state.pose, &state.twist, &model.parameters}) {
      for (adouble& x : *part) {
        x <<= variables_[next++];
      }
    }
    const RolloutReport report = Steps(model, &state, message);
    if (report.status != StepStatus::kDone) {
      *message = report.message;
    }
    adouble sum = 0.0;
    for (size_t i = 0; i < terms_.size(); ++i) {
      const adouble error = StateNumber(state, places_[i]) - terms_[i].target;
      sum += terms_[i].weight * error * error;
    }
    sum >>= *loss;
    return message->empty();
  }

  // Runs each step in double, which makes the choices, then unrolled; values remain those of the
  // double run, as with Jets.
  RolloutReport Steps(const Model<adouble>& model, State<adouble>* state, std::string* message) {
    Stepper stepper(model_);
    State<double> final;
    return Rollout(
        model_, initial_,
        [&](long k, double, const State<double>& values, Stepper* done) {
          if (done == nullptr || !message->empty()) {
            return;
          }
          if (!SolveUnrolled(model, done->record(), state)) {
            *message = "step " + std::to_string(k - 1) + ": the unrolled interior point failed";
          }
          SetValues(values.pose, &state->pose);
          SetValues(values.twist, &state->twist);
        },
        &stepper, &final);
  }

  static void SetValues(const std::vector<double>& values, std::vector<adouble>* x) {
    for (size_t i = 0; i < values.size(); ++i) {
      (*x)[i] += values[i] - (*x)[i].value();
    }
  }

  static void CheckThatItFitted() {
    size_t counts[STAT_SIZE];
    tapestats(kTape, counts);
    if (counts[OP_FILE_ACCESS] + counts[LOC_FILE_ACCESS] + counts[VAL_FILE_ACCESS] != 0) {
      throw std::bad_alloc();
    }
  }

  const Model<double>& model_;
  const State<double>& initial_;
  const std::vector<LossTerm>& terms_;
  const std::vector<int>& places_;
  std::vector<double> variables_;
};

}  // namespace

bool TapeIsBuilt() { return true; }

GradientResult TapeLossGradient(const Scene& scene, const std::vector<ParameterPath>& parameters,
                                const std::vector<LossTerm>& terms, int repeat) {
  GradientResult result;
  const SimulationSettings& settings = scene.simulation;
  if (settings.stepping != Stepping::kFixed ||
      JointCorrectionOf(settings) == JointCorrection::kProjection) {
    result.message = "the tape records fixed steps without projection, and no others";
    return result;
  }
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  const std::vector<int> places = PlacesOf(*model.structure, terms);
  if (places.empty()) {
    result.message = "a term names no output of the scene";
    return result;
  }
  std::vector<ParameterDirection> directions;
  directions.reserve(parameters.size());
  for (const ParameterPath& parameter : parameters) {
    directions.push_back(DirectionOf(parameter));
  }
  Stepper stepper(model);
  for (int i = 0; i < std::max(1, repeat); ++i) {
    double start = ThreadCpuSeconds();
    result.message = Rollout(model, initial, {}, &stepper, &final).message;
    result.all_rollout_seconds.push_back(ThreadCpuSeconds() - start);
    start = ThreadCpuSeconds();
    const std::vector<double> bar =
        TapedRollout(model, initial, terms, places).Gradient(&result.loss, &result.message);
    if (bar.empty()) {
      return result;
    }
    const Eigen::SparseMatrix<double> map = VariableJacobian(scene, model.structure, directions);
    result.gradient = map.transpose() * Eigen::Map<const VectorX<double>>(
                                            bar.data(), static_cast<Eigen::Index>(bar.size()));
    result.all_seconds.push_back(ThreadCpuSeconds() - start);
  }
  const auto best = [](const std::vector<double>& times) {
    return *std::min_element(times.begin(), times.end());
  };
  result.seconds = best(result.all_seconds);
  result.rollout_seconds = best(result.all_rollout_seconds);
  result.done = true;
  return result;
}

}  // namespace tangible::cost
