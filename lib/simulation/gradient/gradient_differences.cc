// SPDX-License-Identifier: Apache-2.0
//
// Jacobians by finite differences.
#include <cmath>
#include <cstdint>

#include "tangible/simulation/gradient/gradient_methods.h"
#include "tangible/simulation/gradient/tolerances.h"

namespace tangible::internal {
namespace {

// A hash of the contacts and modes of a run (FNV-1a), to find out whether those of two runs differ.
class Signature {
 public:
  void Add(const StepRecord& record, long step) {
    for (size_t i = 0; i < record.contacts.size(); ++i) {
      const ActiveContact& c = record.contacts[i];
      const ContactMode mode = record.solution.modes[i];
      if (mode == ContactMode::kOpen) {
        continue;
      }
      for (const long x :
           {step, static_cast<long>(c.a), static_cast<long>(c.b), static_cast<long>(c.feature.kind),
            static_cast<long>(c.feature.a), static_cast<long>(c.feature.b),
            static_cast<long>(c.feature.part_a), static_cast<long>(c.feature.part_b),
            static_cast<long>(c.joint), static_cast<long>(c.side), static_cast<long>(c.law),
            static_cast<long>(mode)}) {
        hash_ = (hash_ ^ static_cast<std::uint64_t>(x)) * 1099511628211ULL;
      }
    }
  }
  friend bool operator==(const Signature&, const Signature&) = default;

 private:
  std::uint64_t hash_ = 14695981039346656037ULL;
};

struct Sample {
  VectorX<double> outputs;
  Signature signature;
};

class Differences {
 public:
  Differences(const GradientProblem& problem, GradientResult* result)
      : problem_(problem), result_(*result), stepper_(problem.model) {}

  // Computes the outputs with all numbers of a parameter changed by `shift`.
  bool Evaluate(const ParameterPath& parameter, double shift, Sample* sample) {
    Scene scene = problem_.scene;
    const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene);
    for (const int number : parameter.numbers) {
      *numbers[number].value += shift;
    }
    Model<double> model;
    State<double> initial;
    BuildModelWithStructure(scene, problem_.structure, &model, &initial);
    State<double> final;
    const RolloutReport report = Rollout(
        model, initial,
        [&](long k, double, const State<double>&, Stepper* stepper) {
          if (stepper != nullptr) {
            sample->signature.Add(stepper->record(), k);
          }
        },
        &stepper_, &final);
    sample->outputs = problem_.Outputs(final);
    result_.message = FailureOf(problem_, report);
    if (!result_.message.empty()) {
      result_.message += ", with " + parameter.path + " changed by " + std::to_string(shift);
    }
    return result_.message.empty();
  }

  bool Allowed(const ParameterPath& parameter, double shift) {
    Scene scene = problem_.scene;
    const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene);
    for (const int number : parameter.numbers) {
      if (!IsAllowed(numbers[number].kind, *numbers[number].value + shift)) {
        return false;
      }
    }
    return true;
  }

  bool Column(const ParameterPath& parameter, double h, const Sample& centre,
              VectorX<double>* column) {
    Sample plus, minus;
    if (Allowed(parameter, h) && Allowed(parameter, -h)) {
      if (!Evaluate(parameter, h, &plus) || !Evaluate(parameter, -h, &minus)) {
        return false;
      }
      *column = (plus.outputs - minus.outputs) / (2.0 * h);
    } else {
      const double s = Allowed(parameter, h) ? h : -h;
      if (!Allowed(parameter, s) || !Allowed(parameter, 2.0 * s)) {
        result_.message = "parameter " + parameter.path +
                          ": no finite difference fits into its range, expected " +
                          Describe(parameter.kind);
        return false;
      }
      if (!Evaluate(parameter, s, &plus) || !Evaluate(parameter, 2.0 * s, &minus)) {
        return false;
      }
      *column = (-3.0 * centre.outputs + 4.0 * plus.outputs - minus.outputs) / (2.0 * s);
      result_.notes.push_back("one-sided difference " + std::string(s > 0.0 ? "above " : "below ") +
                              parameter.path + ": the other side is outside its range");
    }
    if (!(plus.signature == centre.signature) || !(minus.signature == centre.signature)) {
      result_.notes.push_back("contacts or modes change within the difference in " +
                              parameter.path);
    }
    return true;
  }

 private:
  const GradientProblem& problem_;
  GradientResult& result_;
  Stepper stepper_;
};

}  // namespace

bool JacobianByDifferences(const GradientProblem& problem, double step, GradientResult* result) {
  Differences differences(problem, result);
  Sample centre;
  static const ParameterPath kNothing;
  if (!differences.Evaluate(kNothing, 0.0, &centre)) {
    return false;
  }
  result->values = centre.outputs;
  result->jacobian.resize(centre.outputs.size(),
                          static_cast<Eigen::Index>(problem.parameters.size()));
  for (size_t k = 0; k < problem.parameters.size(); ++k) {
    const ParameterPath& parameter = problem.parameters[k];
    double h =
        step > 0.0 ? step : kRelativeStep * std::max(std::abs(parameter.value), parameter.scale);
    // The value is exactly representable, so that the distance of p + h and p − h equals the
    // divisor.
    const volatile double moved = parameter.value + h;
    h = moved - parameter.value;
    VectorX<double> column;
    if (!differences.Column(parameter, h, centre, &column)) {
      return false;
    }
    result->jacobian.col(static_cast<Eigen::Index>(k)) = column;
  }
  return true;
}

}  // namespace tangible::internal
