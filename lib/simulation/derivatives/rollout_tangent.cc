// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/derivatives/rollout_tangent.h"

#include <algorithm>
#include <cmath>

#include "tangible/dynamics/model/tolerances.h"
#include "tangible/simulation/derivatives/tolerances.h"

namespace tangible {

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

double StepTangent::Apply(const Model<double>& model, Stepper* stepper, RowMatrixXd* w_dot) {
  return stepper->Tangent(model, fixed_, w_dot);
}

double StepTangent::ApplyAndMeasure(const Model<double>& model, Stepper* stepper,
                                    RowMatrixXd* w_dot) {
  std::vector<double> driven(static_cast<size_t>(w_dot->cols()), 0.0);
  double worst = 0.0;
  const auto measure = [&](int c, const ContactProblem<double>& problem,
                           const std::vector<int>& block_of, const SolveDerivative::Rates& rates) {
    double impulse = 0.0;
    const auto add = [&](Eigen::Index row, double mobility) {
      impulse = std::max(impulse, mobility * std::abs(rates(row, c)));
    };
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      if (block_of[i] < 0) continue;
      const ContactBlock<double>& contact = problem.contacts[i];
      const Eigen::Index row = 3 * static_cast<Eigen::Index>(block_of[i]);
      const double normal =
          RowMobility(problem.mass, contact.a, contact.normal_a, contact.b, contact.normal_b);
      const double tangent =
          RowMobility(problem.mass, contact.a, contact.tangent_a, contact.b, contact.tangent_b);
      add(row, normal);
      // Friction in a joint, and a motor, have no normal row.
      add(row + 1, normal > 0.0 ? normal : tangent);
    }
    // Of supports, whose larger proximal terms keep the impulses of a contradiction smaller.
    for (size_t j = 0; j < problem.joints.size(); ++j) {
      const JointBlock<double>& joint = problem.joints[j];
      for (int k = 0; k < joint.rows && joint.give[0] == kSupportGive; ++k) {
        const double mobility =
            RowMobility(problem.mass, joint.a, joint.row_a[k], joint.b, joint.row_b[k]);
        add(3 * (problem.num_bodies + static_cast<Eigen::Index>(j)) + k,
            kOfSupportGive * joint.give[k] * mobility);
      }
    }
    for (size_t row = 0; row < problem.mass.size(); ++row) {
      driven[c] = std::max(driven[c], std::abs(rates(static_cast<Eigen::Index>(row), c)));
    }
    worst = std::max(worst, impulse / driven[c]);
  };
  const SolveObserver observer = [&](SolveStage stage, const ContactProblem<double>& problem,
                                     const ContactSystem& system,
                                     const SolveDerivative::Rates& rates) {
    // By events one more column is the derivative by the length of a motion.
    const int all = static_cast<int>(rates.cols());
    const int columns = std::min(all, static_cast<int>(driven.size()));
    for (int c = 0; c < columns; ++c) {
      if (stage == SolveStage::kAssembled) {
        driven[c] = driven_.Of(c, problem, rates.data() + c, static_cast<int>(rates.rows()), all);
      } else if (driven[c] != 0.0) {
        measure(c, problem, system.contact_block(), rates);
      }
    }
  };
  stepper->Tangent(model, fixed_, w_dot, observer);
  return worst;
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
