// SPDX-License-Identifier: Apache-2.0
//
// Finite differences (difference_column.h).
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tangible/simulation/gradient/difference_column.h"
#include "tangible/simulation/gradient/rollout_beside.h"
#include "tangible/simulation/gradient/tolerances.h"

namespace tangible {
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
            static_cast<long>(c.feature.FixedA()), static_cast<long>(c.feature.FixedB()),
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

VectorX<double> Flat(const RowMatrixXd& states) {
  return Eigen::Map<const VectorX<double>>(states.data(), states.size());
}

// A column of the Jacobian of all inputs.
struct Input {
  std::string name;
  double value = 0.0;
  double scale = 1.0;
  NumberKind kind = NumberKind::kFree;
};

Input InputOf(const RolloutFunction& f, Eigen::Index column, const VectorX<double>& parameters,
              const VectorX<double>& state, const Controls& controls) {
  if (column < f.num_parameters()) {
    const ParameterPath& parameter = f.parameters()[static_cast<size_t>(column)];
    const double value = std::isnan(parameters[column]) ? parameter.value : parameters[column];
    return {parameter.path, value, parameter.scale, parameter.kind};
  }
  column -= f.num_parameters();
  if (column < f.num_states()) {
    return {OutputNames(f.structure())[static_cast<size_t>(column)], state[column]};
  }
  column -= f.num_states();
  const auto control = static_cast<int>(column % f.num_controls());
  const std::vector<int>& of_number = f.control_of_number();
  const auto number = std::find(of_number.begin(), of_number.end(), control) - of_number.begin();
  return {f.controls()[static_cast<size_t>(control)].path,
          controls.values(column / f.num_controls(), number)};
}

// A step that is exactly representable, so that the distance of p + h and p − h equals the divisor.
double StepOf(const Input& input, double wanted) {
  const double h =
      wanted > 0.0 ? wanted : kRelativeStep * std::max(std::abs(input.value), input.scale);
  const volatile double moved = input.value + h;
  return moved - input.value;
}

}  // namespace

void RolloutWorker::JacobianByDifferences(double step, RowMatrixXd* jacobian,
                                          RolloutOutput* output) {
  const auto run = [this](RolloutOutput* result) {
    Signature signature;
    RunAs(
        [&](const ControlledModel<double>& model, const StateObserver& keep) {
          const StateObserver sign = [&](long k, double t, const State<double>& state,
                                         Stepper* stepper) {
            keep(k, t, state, stepper);
            if (stepper != nullptr) signature.Add(stepper->record(), k);
          };
          return Rollout(model, initial_, sign, &*stepper_, &result->final);
        },
        result);
    return signature;
  };
  const Signature at_centre = run(output);
  if (output->status != RolloutStatus::kDone) return;
  const VectorX<double> centre = Flat(output->states);
  for (Eigen::Index column = 0; column < jacobian->cols(); ++column) {
    const Input input = InputOf(f_, column, parameters_, f_.StateOf(initial_), controls_);
    bool same_contacts = true;
    const auto evaluate = [&](double shift, VectorX<double>* values) {
      const Beside beside(this, column, shift);
      if (beside.is_refused()) return Evaluated::kRefused;
      RolloutOutput moved;
      same_contacts = run(&moved) == at_centre && same_contacts;
      if (moved.status == RolloutStatus::kDone) {
        *values = Flat(moved.states);
        return Evaluated::kDone;
      }
      moved.message += ", with " + input.name + " changed by " + std::to_string(shift);
      *output = std::move(moved);
      return Evaluated::kFailed;
    };
    const DifferenceColumn difference = Difference(StepOf(input, step), centre, evaluate);
    if (difference.status == Evaluated::kRefused) {
      output->status = RolloutStatus::kRefused;
      output->message = "parameter " + input.name +
                        ": no finite difference fits into its range, expected " +
                        Describe(input.kind);
    }
    if (difference.status != Evaluated::kDone) return;
    if (difference.side != 0.0) {
      output->notes.push_back("one-sided difference " +
                              std::string(difference.side > 0.0 ? "above " : "below ") +
                              input.name + ": the other side is outside its range");
    }
    if (!same_contacts) {
      output->notes.push_back("contacts or modes change within the difference in " + input.name);
    }
    jacobian->col(column) = difference.values;
  }
}

}  // namespace tangible
