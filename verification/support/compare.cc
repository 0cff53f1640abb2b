// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/compare.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <tuple>

#include "tangible/dynamics/parameter_map.h"
#include "tangible/simulation/rollout_adjoint.h"
#include "tangible/simulation/rollout_tangent.h"

namespace tangible {
namespace {

constexpr double kDegenerate = 1e-7;

// Calls visit(output, variable) in the order of the outputs.
template <typename Visit>
void ForEachOutput(const ModelStructure& structure, const Visit& visit) {
  int output = 0;
  for (const int body : structure.moving) {
    for (int i = 0; i < 6; ++i) {
      visit(output++,
            i < 3 ? structure.PoseVariable(body, i) : structure.TwistVariable(body, i - 3));
    }
  }
}

template <typename T>
const T& VariableOf(const State<T>& state, int variable) {
  const int poses = static_cast<int>(state.pose.size());
  return variable < poses ? state.pose[variable] : state.twist[variable - poses];
}

VectorX<double> OutputsOf(const ModelStructure& structure, const State<double>& state) {
  VectorX<double> values(6 * structure.num_blocks());
  ForEachOutput(structure,
                [&](int output, int variable) { values[output] = VariableOf(state, variable); });
  return values;
}

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
    VisitStepJacobian(model_, t_.record.View(t_.system.contact_block()), JointRoute::kByHand,
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
  // The entries of masses and dampings hold v⁺ − v − h g and h v⁺, in which v⁺ is itself what
  // impulses leave: their terms.
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
        const double gravity = i < 2 ? t_.record.h * model_.numbers[kGravityX + i] : 0.0;
        const double sum = std::abs(t_.record.new_twist[3 * body + i]) + speed[3 * k + i] +
                           std::abs(t_.record.before.twist[3 * body + i]) + std::abs(gravity);
        const int mass = s_.NumberVariable(i < 2 ? index.mass : index.inertia);
        const int damping = s_.NumberVariable(i < 2 ? index.linear_damping : index.angular_damping);
        t_.rows.row(3 * k + i) +=
            sum * (w_dot.row(mass).cwiseAbs() + t_.record.h * w_dot.row(damping).cwiseAbs());
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
  if (s.settings.joint_correction == JointCorrection::kProjection && !s.joints.empty()) {
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

auto KeyOf(const ContactTrace& trace) {
  const ActiveContact& c = trace.contact;
  return std::tuple(c.a, c.b, c.joint, c.side, c.feature.kind, c.feature.a, c.feature.b);
}

bool SameChoice(const ContactTrace& x, const ContactTrace& y, FrictionAtZero friction) {
  if (KeyOf(x) != KeyOf(y) || x.contact.law != y.contact.law || x.friction_tie != y.friction_tie ||
      x.restitution_tie != y.restitution_tie) {
    return false;
  }
  // From friction 0 a contact goes on sliding; one that would stick has a kink there.
  const auto slides = [](ContactMode mode) {
    return mode == ContactMode::kClosed || SlidingSign(mode) != 0.0;
  };
  const bool one_closed = x.mode == ContactMode::kClosed || y.mode == ContactMode::kClosed;
  return x.mode == y.mode ||
         (friction == FrictionAtZero::kMaySlide && one_closed && slides(x.mode) && slides(y.mode));
}

void TraceStep(const StepRecord& record, RunTrace* trace) {
  std::vector<ContactTrace>& step = trace->steps.emplace_back();
  for (size_t i = 0; i < record.contacts.size(); ++i) {
    const ContactMode mode = record.solution.modes[i];
    if (mode == ContactMode::kOpen) {
      continue;
    }
    const ContactLaw law = record.contacts[i].law;
    const bool friction_tie = record.friction[i].tie;
    const bool restitution_tie = record.restitution[i].tie;
    step.push_back({record.contacts[i], mode, friction_tie, restitution_tie});
    ++trace->closed;
    trace->sliding += SlidingSign(mode) != 0.0 ? 1 : 0;
    trace->sticking += mode == ContactMode::kSticking ? 1 : 0;
    trace->limits += record.contacts[i].joint >= 0 ? 1 : 0;
    trace->impacts += law == ContactLaw::kRestitution ? 1 : 0;
    trace->recoveries += law == ContactLaw::kRecovery ? 1 : 0;
    trace->friction_tie = trace->friction_tie || friction_tie;
    trace->restitution_tie = trace->restitution_tie || restitution_tie;
  }
  // The order in which contacts of a pair are listed depends on which gap is smaller.
  std::sort(step.begin(), step.end(),
            [](const ContactTrace& x, const ContactTrace& y) { return KeyOf(x) < KeyOf(y); });
  std::vector<int> degenerate;
  FindDegenerateContacts(record.problem, record.solution, kDegenerate, &degenerate);
  trace->degenerate += static_cast<int>(degenerate.size());
}

// Runs with one number changed by several steps, and the extrapolation of their differences.
class Differences {
 public:
  Differences(const Scene& scene, const RunTrace& at, const VectorX<double>& noise,
              const ParameterPath& parameter)
      : scene_(scene), at_(at), noise_(noise), parameter_(parameter) {
    const double value = parameter.value;
    // Scenes are of the size of 1 in SI units, which the scale of a large floor is not.
    first_ = kLargest * std::max(std::abs(value), std::min(parameter.scale, 1.0));
    if (value == 0.0 && parameter.kind != NumberKind::kFree) {
      side_ = 1.0;
    } else if (value == 1.0 && parameter.kind == NumberKind::kFraction) {
      side_ = -1.0;
    }
    if (parameter.kind != NumberKind::kFree && side_ == 0.0) {
      first_ = std::min(first_, 0.1 * value);
      if (parameter.kind == NumberKind::kFraction) {
        first_ = std::min(first_, 0.1 * (1.0 - value));
      }
    }
  }

  DifferenceColumn Compute() {
    DifferenceColumn column;
    for (double h = first_; h > kSmallest * first_; h *= 0.125) {
      column.step = h;
      column.status = Table(h, &column);
      if (column.status == DifferenceStatus::kJudged) {
        break;
      }
    }
    return column;
  }

 private:
  static constexpr double kLargest = 1e-3;
  static constexpr double kSmallest = 1e-5;  // of the largest
  static constexpr int kSteps = 4;
  static constexpr double kRatio = 2.0;

  DifferenceStatus RunAt(double change, VectorX<double>* values) {
    Scene scene = scene_;
    const std::vector<SceneNumber<double>> numbers = EnumerateNumbers(&scene);
    for (const int number : parameter_.numbers) {
      *numbers[number].value += change;
    }
    const RunTrace trace = TraceRun(scene);
    if (!trace.done) {
      return DifferenceStatus::kRunFailed;
    }
    const FrictionAtZero friction =
        side_ != 0.0 ? FrictionAtZero::kMaySlide : FrictionAtZero::kDistinct;
    *values = trace.values;
    return SameChoices(at_, trace, friction) ? DifferenceStatus::kJudged
                                             : DifferenceStatus::kChoicesDiffer;
  }

  DifferenceStatus Quotient(double h, VectorX<double>* quotient) {
    VectorX<double> high = at_.values;
    VectorX<double> low = at_.values;
    if (side_ >= 0.0) {
      const DifferenceStatus status = RunAt(h, &high);
      if (status != DifferenceStatus::kJudged) {
        return status;
      }
    }
    if (side_ <= 0.0) {
      const DifferenceStatus status = RunAt(-h, &low);
      if (status != DifferenceStatus::kJudged) {
        return status;
      }
    }
    *quotient = (high - low) / (side_ == 0.0 ? 2.0 * h : h);
    return DifferenceStatus::kJudged;
  }

  // Ridders' table; errors of central quotients are even in h, of one-sided ones of all orders.
  DifferenceStatus Table(double h, DifferenceColumn* column) {
    VectorX<double> table[kSteps][kSteps];
    const double factor = side_ == 0.0 ? kRatio * kRatio : kRatio;
    for (int k = 0; k < kSteps; ++k) {
      const double step = h / std::pow(kRatio, k);
      const DifferenceStatus status = Quotient(step, &table[0][k]);
      if (status != DifferenceStatus::kJudged) {
        return status;
      }
      // Of both values, extrapolated; the table itself need not show it.
      const VectorX<double> rounding = (4.0 / step) * noise_;
      if (k == 0) {
        column->values = table[0][0];
        column->errors.setConstant(noise_.size(), HUGE_VAL);
      }
      double power = factor;
      for (int j = 1; j <= k; ++j, power *= factor) {
        table[j][k] = (power * table[j - 1][k] - table[j - 1][k - 1]) / (power - 1.0);
        const VectorX<double> error =
            (table[j][k] - table[j - 1][k])
                .cwiseAbs()
                .cwiseMax((table[j][k] - table[j - 1][k - 1]).cwiseAbs()) +
            rounding;
        for (Eigen::Index i = 0; i < error.size(); ++i) {
          if (error[i] < column->errors[i]) {
            column->errors[i] = error[i];
            column->values[i] = table[j][k][i];
          }
        }
      }
    }
    return DifferenceStatus::kJudged;
  }

  const Scene& scene_;
  const RunTrace& at_;
  const VectorX<double>& noise_;
  const ParameterPath& parameter_;
  double first_ = 0.0;
  double side_ = 0.0;  // 0: central; else the only side that is allowed
};

}  // namespace

MatrixX<double> ContributionMagnitudes(const Scene& scene,
                                       const std::vector<ParameterPath>& parameters) {
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
  std::vector<std::unique_ptr<StepTerms>> steps;
  StepTangent tangent;
  const StateObserver observe = [&](long, double, const State<double>&, Stepper* stepper) {
    if (stepper != nullptr) {
      steps.push_back(std::make_unique<StepTerms>());
      TermsOfStep(model, stepper, steps.back().get()).Fill(w_dot);
      tangent.Apply(model, stepper, &w_dot);
    }
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
    if (k > 0) {
      sum += AdjointOfStep(model, *w_bar, steps[k - 1].get()).transpose() * steps[k - 1]->rows;
    }
  };
  RowMatrixXd w_bar;
  tape.Adjoint(model, num_outputs, seed, &w_bar);
  constexpr double kShareOfColumn = 0.1;
  return sum.cwiseMax((kShareOfColumn * sum.colwise().maxCoeff()).replicate(num_outputs, 1));
}

bool Agree(double a, double b, double tolerance, double contributions, double rounding) {
  // Scenes are of the size of 1 in SI units; a speed at rest, rounded at 1e-16, has parts in local
  // derivatives that a step's inverse inertia and 1/h enlarge.
  constexpr double kUnderflow = 1e-14;
  return std::abs(a - b) <= tolerance * std::abs(b) + rounding * contributions + kUnderflow;
}

RunTrace TraceRun(const Scene& scene) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  RunTrace trace;
  const StateObserver observe = [&](long, double, const State<double>&, Stepper* stepper) {
    if (stepper != nullptr) {
      TraceStep(stepper->record(), &trace);
    }
  };
  const RolloutReport report = Rollout(model, state, observe, &state);
  trace.done = report.status == StepStatus::kDone;
  trace.message = report.message;
  trace.values = OutputsOf(*model.structure, state);
  return trace;
}

bool SameChoices(const RunTrace& x, const RunTrace& y, FrictionAtZero friction) {
  return std::equal(x.steps.begin(), x.steps.end(), y.steps.begin(), y.steps.end(),
                    [&](const std::vector<ContactTrace>& a, const std::vector<ContactTrace>& b) {
                      return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                                        [&](const ContactTrace& p, const ContactTrace& q) {
                                          return SameChoice(p, q, friction);
                                        });
                    });
}

VectorX<double> RoundingNoise(const Scene& scene, const RunTrace& at) {
  constexpr int kSamples = 4;
  const double epsilon = std::numeric_limits<double>::epsilon();
  VectorX<double> noise = epsilon * at.values.cwiseAbs().cwiseMax(0.5);
  for (int sample = 0; sample < kSamples; ++sample) {
    Scene changed = scene;
    int digit = sample;
    const auto change = [&](double* x) {
      // Up, down or not at all, in patterns that differ from sample to sample.
      *x += epsilon * std::max(1.0, std::abs(*x)) * (digit++ % 3 - 1) * (sample % 2 == 0 ? 1 : -1);
    };
    for (BasicBody<double>& body : changed.bodies) {
      for (double* x : {&body.position.x(), &body.position.y(), &body.angle, &body.velocity.x(),
                        &body.velocity.y(), &body.angular_velocity}) {
        change(x);
      }
      ++digit;
    }
    const RunTrace trace = TraceRun(changed);
    if (trace.done && SameChoices(at, trace, FrictionAtZero::kDistinct)) {
      noise = noise.cwiseMax((trace.values - at.values).cwiseAbs());
    }
  }
  return noise;
}

DifferenceColumn FiniteDifferences(const Scene& scene, const RunTrace& at,
                                   const VectorX<double>& noise, const ParameterPath& parameter) {
  return Differences(scene, at, noise, parameter).Compute();
}

}  // namespace tangible
