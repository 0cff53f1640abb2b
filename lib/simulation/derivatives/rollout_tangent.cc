// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/derivatives/rollout_tangent.h"

#include <algorithm>
#include <cmath>

#include "tangible/simulation/derivatives/tolerances.h"

namespace tangible {

void AdvanceTangent(const Model<double>& model, Stepper* stepper, const double* twists,
                    RowMatrixXd* w_dot) {
  const ModelStructure& s = *model.structure;
  const int columns = static_cast<int>(w_dot->cols());
  for (int k = 0; k < s.num_blocks(); ++k) {
    std::copy_n(twists + 3 * static_cast<size_t>(k) * columns, 3 * columns,
                w_dot->data() + static_cast<size_t>(s.TwistVariable(s.moving[k], 0)) * columns);
  }
  for (int body = 0; body < s.num_bodies(); ++body) {
    for (int i = 0; i < 3 && s.bodies[body].motion != Motion::kStatic; ++i) {
      w_dot->row(s.PoseVariable(body, i)) +=
          stepper->record().h * w_dot->row(s.TwistVariable(body, i));
    }
  }
  if (ProjectsOntoJoints(s)) {
    stepper->projection().Tangent(model, w_dot->data(), columns);
  }
}

double DrivenSpeeds::Of(int column, const ContactProblem<double>& problem, const double* rhs,
                        int rows, int stride) {
  double driven = 0.0;
  for (int row = 0; row < rows; ++row) {
    const double value = std::abs(rhs[static_cast<size_t>(row) * stride]);
    const bool is_body = static_cast<size_t>(row) < problem.mass.size();
    driven = std::max(driven, is_body ? value / problem.mass[row] : value);
  }
  most_.resize(std::max(most_.size(), static_cast<size_t>(column) + 1), 0.0);
  most_[column] = std::max(most_[column], driven);
  return driven <= kAbsorbed * most_[column] ? 0.0 : driven;
}

void StepTangent::Vary(const ModelStructure& structure, const std::vector<int>& numbers) {
  for (const int number : numbers) {
    fixed_[structure.ParameterVariable(number)] = 0;
  }
}

int StepTangent::FixNumbers(const ModelStructure& s, const RowMatrixXd& w_dot) {
  fixed_.assign(s.num_variables(), 0);
  int count = 0;
  for (int variable = s.ParameterVariable(0); variable < s.num_variables(); ++variable) {
    const bool fixed = (w_dot.row(variable).array() == 0.0).all();
    fixed_[variable] = fixed ? 1 : 0;
    count += fixed ? 1 : 0;
  }
  return count;
}

void StepTangent::Assemble(const Model<double>& model, Stepper* stepper, const RowMatrixXd& w_dot) {
  stepper->ChooseImpulses();
  const StepRecord& record = stepper->record();
  ContactSystem& system = stepper->system();
  const int columns = static_cast<int>(w_dot.cols());
  rhs_.assign(3 * static_cast<size_t>(system.num_blocks()) * columns, 0.0);
  VisitJacobian(
      model, record.View(system.contact_block()), JacobianRoute::kByHand, &scratch_,
      TangentSink{w_dot.data(), rhs_.data(), columns, fixed_.empty() ? nullptr : fixed_.data()});
}

double StepTangent::Apply(const Model<double>& model, Stepper* stepper, RowMatrixXd* w_dot) {
  if (stepper->by_events()) {
    return stepper->event_derivative().Tangent(model, &stepper->events().mutable_record(), w_dot);
  }
  Assemble(model, stepper, *w_dot);
  return Finish(model, stepper, w_dot);
}

double StepTangent::ApplyAndMeasure(const Model<double>& model, Stepper* stepper,
                                    RowMatrixXd* w_dot) {
  if (stepper->by_events()) {
    Apply(model, stepper, w_dot);
    return 0.0;
  }
  const ContactProblem<double>& problem = stepper->record().problem;
  const int columns = static_cast<int>(w_dot->cols());
  Assemble(model, stepper, *w_dot);
  const int rows = static_cast<int>(rhs_.size()) / std::max(1, columns);
  std::vector<double> driven(columns, 0.0);
  for (int c = 0; c < columns; ++c) {
    driven[c] = driven_.Of(c, problem, rhs_.data() + c, rows, columns);
  }
  Finish(model, stepper, w_dot);
  double worst = 0.0;
  const std::vector<int>& block_of = stepper->system().contact_block();
  for (int c = 0; c < columns; ++c) {
    if (driven[c] == 0.0) continue;
    double impulse = 0.0;
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      if (block_of[i] >= 0) {
        const ContactBlock<double>& contact = problem.contacts[i];
        const double mobility =
            RowMobility(problem.mass, contact.a, contact.normal_a, contact.b, contact.normal_b);
        const size_t row = 3 * static_cast<size_t>(block_of[i]);
        impulse = std::max({impulse, mobility * std::abs(rhs_[row * columns + c]),
                            mobility * std::abs(rhs_[(row + 1) * columns + c])});
      }
    }
    for (size_t row = 0; row < problem.mass.size(); ++row) {
      driven[c] = std::max(driven[c], std::abs(rhs_[row * columns + c]));
    }
    worst = std::max(worst, impulse / driven[c]);
  }
  return worst;
}

double StepTangent::Finish(const Model<double>& model, Stepper* stepper, RowMatrixXd* w_dot) {
  const StepRecord& record = stepper->record();
  const double left = stepper->system().Solve(record.problem, record.solution.modes, rhs_.data(),
                                              static_cast<int>(w_dot->cols()));
  AdvanceTangent(model, stepper, rhs_.data(), w_dot);
  return left;
}

RolloutReport RolloutTangent(ControlledModel<double> model, const State<double>& initial,
                             const ControlDirections& directions, const TangentObserver& observer,
                             Stepper* stepper, RowMatrixXd* w_dot, State<double>* final,
                             const StepRange& range) {
  StepTangent tangent;
  const int fixed_numbers = tangent.FixNumbers(model.structure(), *w_dot);
  if (model.is_controlled()) {
    tangent.Vary(model.structure(), model.controls()->numbers);
  }
  const StateObserver each = [&](long k, double t, const State<double>& state, Stepper* done) {
    if (done != nullptr) {
      tangent.Apply(model.At(k - 1), done, w_dot);
    }
    if (observer) {
      observer(k, t, state, *w_dot);
    }
    if (directions) {
      directions(k, w_dot);
    }
  };
  RolloutReport report = Rollout(model, initial, each, stepper, final, range);
  report.fixed_numbers = fixed_numbers;
  return report;
}

RolloutReport RolloutTangent(const Model<double>& model, const State<double>& initial,
                             const TangentObserver& observer, RowMatrixXd* w_dot,
                             State<double>* final) {
  Stepper stepper(model);
  return RolloutTangent(model, initial, {}, observer, &stepper, w_dot, final);
}

}  // namespace tangible
