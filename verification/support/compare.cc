// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/compare.h"

#include <cmath>
#include <memory>
#include <utility>

#include "tangible/dynamics/model/parameter_map.h"
#include "tangible/simulation/derivatives/rollout_adjoint.h"
#include "tangible/simulation/derivatives/rollout_tangent.h"
#include "tangible/verification/support/outputs.h"

namespace tangible {
namespace {

// Sets the seeds of all outputs at the last state.
void SeedOutputs(const ModelStructure& structure, RowMatrixXd* w_bar) {
  ForEachOutput(structure, [&](int output, int variable) { (*w_bar)(variable, output) += 1.0; });
}

// One step of the sum S: its terms by rows of the step's system, and what the adjoint needs.
struct StepTerms {
  RowMatrixXd rows;     // |∂R/∂w| |ẇ| + |K| |ẋ|
  RowMatrixXd tangent;  // ⌈ẇ⌉ after the step
  StepRecord record;
  ContactSystem system;
  JointProjection projection;
};

class TermsOfStep {
 public:
  TermsOfStep(const Model<double>& model, Stepper* stepper, StepTerms* terms)
      : s_(*model.structure), model_(model), t_(*terms) {
    t_.record = stepper->record();
    t_.system = stepper->system();
    t_.projection = stepper->projection();
  }

  void Fill(const RowMatrixXd& w_dot) {
    const ContactProblem<double>& problem = t_.record.problem;
    std::vector<JacobianEntry> entries;
    LocalJacobianScratch scratch;
    VisitJacobian(model_, t_.record.View(t_.system.contact_block()), JacobianRoute::kByHand,
                  &scratch, EntryListSink{&entries});
    x_.setZero(3 * t_.system.num_blocks(), w_dot.cols());
    t_.rows.setZero(x_.rows(), x_.cols());
    for (const JacobianEntry& e : entries) {
      x_.row(e.row) -= e.value * w_dot.row(e.variable);
      t_.rows.row(e.row) += std::abs(e.value) * w_dot.row(e.variable).cwiseAbs();
    }
    AddInertia(w_dot);
    t_.system.Solve(problem, t_.record.solution.modes, x_.data(), static_cast<int>(x_.cols()));
    x_ = x_.cwiseAbs().eval();
    AddSystem();
    t_.tangent = w_dot.cwiseAbs();
    for (int k = 0; k < s_.num_blocks(); ++k) {
      for (int i = 0; i < 3; ++i) {
        const int twist = s_.TwistVariable(s_.moving[k], i);
        t_.tangent.row(twist) = t_.rows.row(3 * k + i) / problem.mass[3 * k + i];
        t_.tangent.row(s_.PoseVariable(s_.moving[k], i)) += t_.record.h * t_.tangent.row(twist);
      }
    }
  }

 private:
  // The entries of masses and dampings contain v⁺ − v − h g and h v⁺, in which v⁺ is itself a
  // remainder after impulses cancel: this adds the terms of v⁺.
  void AddInertia(const RowMatrixXd& w_dot) {
    const ContactProblem<double>& problem = t_.record.problem;
    const ContactSolution<double>& solution = t_.record.solution;
    std::vector<double> speed(3 * problem.num_bodies, 0.0);
    const auto push = [&](int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b,
                          double impulse) {
      for (int i = 0; i < 3; ++i) {
        if (a >= 0) {
          speed[3 * a + i] += std::abs(row_a[i] * impulse) / problem.mass[3 * a + i];
        }
        if (b >= 0) {
          speed[3 * b + i] += std::abs(row_b[i] * impulse) / problem.mass[3 * b + i];
        }
      }
    };
    for (size_t j = 0; j < problem.joints.size(); ++j) {
      const JointBlock<double>& joint = problem.joints[j];
      for (int k = 0; k < joint.rows; ++k) {
        push(joint.a, joint.row_a[k], joint.b, joint.row_b[k], solution.joint_impulse[3 * j + k]);
      }
    }
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      const ContactBlock<double>& c = problem.contacts[i];
      push(c.a, c.normal_a, c.b, c.normal_b, solution.normal_impulse[i]);
      push(c.a, c.tangent_a, c.b, c.tangent_b, solution.tangent_impulse[i]);
    }
    for (int k = 0; k < s_.num_blocks(); ++k) {
      const int body = s_.moving[k];
      const BodyIndex& index = s_.bodies[body];
      for (int i = 0; i < 3; ++i) {
        const double gravity = i < 2 ? t_.record.h * model_.parameters[kGravityX + i] : 0.0;
        const double sum = std::abs(t_.record.new_twist[3 * body + i]) + speed[3 * k + i] +
                           std::abs(t_.record.before.twist[3 * body + i]) + std::abs(gravity);
        const int mass = s_.ParameterVariable(i < 2 ? index.mass : index.inertia);
        const int damping =
            s_.ParameterVariable(i < 2 ? index.linear_damping : index.angular_damping);
        t_.rows.row(3 * k + i) +=
            sum * (w_dot.row(mass).cwiseAbs() + t_.record.h * w_dot.row(damping).cwiseAbs());
        if (i < 2 && index.quadratic_drag >= 0) {
          const double* before = &t_.record.before.twist[3 * body];
          const int drag = s_.ParameterVariable(index.quadratic_drag);
          t_.rows.row(3 * k + i) +=
              t_.record.h * sum * std::hypot(before[0], before[1]) * w_dot.row(drag).cwiseAbs();
        }
      }
    }
  }

  // rows += |K| |ẋ|.
  void AddSystem() {
    const ContactProblem<double>& problem = t_.record.problem;
    for (int i = 0; i < 3 * problem.num_bodies; ++i) {
      t_.rows.row(i) += problem.mass[i] * x_.row(i);
    }
    for (const DamperBlock<double>& d : problem.dampers) {
      Push(d.a, d.row_a, d.b, d.row_b, d.weight * Speed(d.a, d.row_a, d.b, d.row_b));
    }
    for (size_t j = 0; j < problem.joints.size(); ++j) {
      const JointBlock<double>& joint = problem.joints[j];
      for (int k = 0; k < joint.rows; ++k) {
        Constrain(3 * (problem.num_bodies + static_cast<int>(j)) + k, joint.a, joint.row_a[k],
                  joint.b, joint.row_b[k]);
      }
    }
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      const int block = t_.system.contact_block()[i];
      if (block < 0) {
        continue;
      }
      const ContactBlock<double>& c = problem.contacts[i];
      Constrain(3 * block, c.a, c.normal_a, c.b, c.normal_b);
      if (t_.record.solution.modes[i] == ContactMode::kSticking) {
        Constrain(3 * block + 1, c.a, c.tangent_a, c.b, c.tangent_b);
      } else {
        Push(c.a, c.tangent_a, c.b, c.tangent_b, c.friction * x_.row(3 * block));
      }
    }
  }

  void Constrain(int row, int a, const RowPart<double>& row_a, int b,
                 const RowPart<double>& row_b) {
    t_.rows.row(row) += Speed(a, row_a, b, row_b);
    Push(a, row_a, b, row_b, x_.row(row));
  }

  Eigen::RowVectorXd Speed(int a, const RowPart<double>& row_a, int b,
                           const RowPart<double>& row_b) const {
    Eigen::RowVectorXd speed = Eigen::RowVectorXd::Zero(x_.cols());
    for (int i = 0; i < 3; ++i) {
      if (a >= 0) {
        speed += std::abs(row_a[i]) * x_.row(3 * a + i);
      }
      if (b >= 0) {
        speed += std::abs(row_b[i]) * x_.row(3 * b + i);
      }
    }
    return speed;
  }

  void Push(int a, const RowPart<double>& row_a, int b, const RowPart<double>& row_b,
            const Eigen::RowVectorXd& impulse) {
    for (int i = 0; i < 3; ++i) {
      if (a >= 0) {
        t_.rows.row(3 * a + i) += std::abs(row_a[i]) * impulse;
      }
      if (b >= 0) {
        t_.rows.row(3 * b + i) += std::abs(row_b[i]) * impulse;
      }
    }
  }

  const ModelStructure& s_;
  const Model<double>& model_;
  StepTerms& t_;
  RowMatrixXd x_;
};

// |u| of a step, from the adjoint of the state after it.
RowMatrixXd AdjointOfStep(const Model<double>& model, RowMatrixXd w_bar, StepTerms* terms) {
  const ModelStructure& s = *model.structure;
  const int columns = static_cast<int>(w_bar.cols());
  if (JointCorrectionOf(s.settings) == JointCorrection::kProjection && !s.joints.empty()) {
    terms->projection.Adjoint(model, w_bar.data(), columns);
  }
  RowMatrixXd u = RowMatrixXd::Zero(3 * terms->system.num_blocks(), columns);
  for (int k = 0; k < s.num_blocks(); ++k) {
    for (int i = 0; i < 3; ++i) {
      u.row(3 * k + i) = w_bar.row(s.TwistVariable(s.moving[k], i)) +
                         terms->record.h * w_bar.row(s.PoseVariable(s.moving[k], i));
    }
  }
  terms->system.SolveTransposed(terms->record.problem, terms->record.solution.modes, u.data(),
                                columns);
  return u.cwiseAbs();
}

}  // namespace

Contributions ContributionsOf(const Scene& scene, const std::vector<ParameterPath>& parameters) {
  Model<double> model;
  State<double> start;
  BuildModel(scene, &model, &start);
  std::vector<ParameterDirection> directions;
  directions.reserve(parameters.size());
  for (const ParameterPath& path : parameters) {
    directions.push_back(DirectionOf(path));
  }
  RowMatrixXd w_dot = VariableJacobian(scene, model.structure, directions);
  const RowMatrixXd initial = w_dot.cwiseAbs();
  // Only for poses and twists, because a number's own derivative is always 1.
  const int num_state = 6 * model.structure->num_bodies();
  VectorX<double> largest = initial.topRows(num_state).colwise().maxCoeff().transpose();
  std::vector<std::unique_ptr<StepTerms>> steps;
  StepTangent tangent;
  const StateObserver observe = [&](long, double, const State<double>&, Stepper* stepper) {
    if (stepper == nullptr) {
      return;
    }
    steps.push_back(std::make_unique<StepTerms>());
    if (stepper->by_events()) {
      tangent.Apply(model, stepper, &w_dot);
      steps.back()->tangent = w_dot.cwiseAbs();
    } else {
      TermsOfStep(model, stepper, steps.back().get()).Fill(w_dot);
      tangent.Apply(model, stepper, &w_dot);
    }
    largest =
        largest.cwiseMax(steps.back()->tangent.topRows(num_state).colwise().maxCoeff().transpose());
  };
  State<double> final;
  Rollout(model, start, observe, &final);
  RolloutTape tape;
  tape.Record(model, start, Factorisations::kKeep, {}, &final);
  const int num_outputs = 6 * model.structure->num_blocks();
  MatrixX<double> sum = MatrixX<double>::Zero(num_outputs, w_dot.cols());
  const auto seed = [&](long k, RowMatrixXd* w_bar) {
    if (k == tape.steps()) {
      SeedOutputs(*model.structure, w_bar);
    }
    sum += w_bar->cwiseAbs().transpose() * (k == 0 ? initial : steps[k - 1]->tangent);
    if (k > 0 && steps[k - 1]->rows.size() > 0) {
      sum += AdjointOfStep(model, *w_bar, steps[k - 1].get()).transpose() * steps[k - 1]->rows;
    }
  };
  RowMatrixXd w_bar;
  tape.Adjoint(model, num_outputs, seed, &w_bar);
  constexpr double kShareOfColumn = 0.1;
  largest = largest.cwiseMax(sum.colwise().maxCoeff().transpose());
  sum = sum.cwiseMax((kShareOfColumn * largest.transpose()).replicate(num_outputs, 1)).eval();
  return {std::move(sum), std::move(largest)};
}

MatrixX<double> ContributionMagnitudes(const Scene& scene,
                                       const std::vector<ParameterPath>& parameters) {
  return ContributionsOf(scene, parameters).sum;
}

bool Agree(double a, double b, double tolerance, double contributions, double rounding) {
  return std::abs(a - b) <= tolerance * std::abs(b) + rounding * contributions;
}

}  // namespace tangible
