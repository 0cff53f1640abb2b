// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/derivatives/rollout_directional.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/dynamics/model/lengths.h"
#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/system/contact_residual.h"
#include "tangible/simulation/derivatives/tolerances.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {

bool JustTouches(const StepRecord& record, size_t i) {
  const ActiveContact& contact = record.contacts[i];
  const ContactBlock<double>& block = record.problem.contacts[i];
  const double rounding =
      kCoordinateRounding * PlaceOf(record.before, contact.a, contact.b) / record.h;
  const double slack =
      RowDot(block.a, block.normal_a, block.b, block.normal_b, record.solution.motion.data()) +
      block.c_n;
  if (record.solution.modes[i] == ContactMode::kOpen) return slack <= rounding;
  // A closed one also carries no more than what stops a speed that is rounding.
  const double mobility =
      RowMobility(record.problem.mass, block.a, block.normal_a, block.b, block.normal_b);
  return !block.limit_given && !block.driven && std::abs(slack) <= rounding &&
         mobility * (record.solution.normal_impulse[i] - block.offset) <= rounding;
}

// Finds the kinks of the step; returns whether there are any.
bool StepDirectional::FindKinks(const Model<double>& model, const StepRecord& record,
                                const ContactSolution<double>& solution, const RowMatrixXd& w_dot) {
  const size_t count = record.contacts.size();
  std::vector<bool> touching(count);
  friction_.setZero(static_cast<Eigen::Index>(count), w_dot.cols());
  for (size_t i = 0; i < count; ++i) {
    // The share of redundant impulses that is looked at may have other modes than the record.
    touching[i] = JustTouches(record, i) && (solution.modes[i] == ContactMode::kOpen ||
                                             record.solution.modes[i] != ContactMode::kOpen);
    for (int k = 0; k < 2; ++k) {
      if (const int number = record.friction[i].numbers[k]; number >= 0) {
        friction_.row(static_cast<Eigen::Index>(i)) +=
            record.friction[i].derivatives[k] *
            w_dot.row(model.structure->ParameterVariable(number));
      }
    }
  }
  tangible::FindKinks(record.problem, solution, touching, kDegenerateTolerance, &kinks_);
  bool any = false;
  for (size_t i = 0; i < count; ++i) {
    if (kinks_[i].kind == ContactKink::Kind::kFrictionFromZero &&
        friction_.row(static_cast<Eigen::Index>(i)).isZero(0.0)) {
      kinks_[i].kind = ContactKink::Kind::kNone;
    }
    any = any || kinks_[i].kind != ContactKink::Kind::kNone;
  }
  return any;
}

// v̇ of every column, with the kinks found at `solution`.
StepDirectional::Status StepDirectional::SolveColumns(const Model<double>& model,
                                                      const StepRecord& record,
                                                      const ContactSolution<double>& solution,
                                                      const RowMatrixXd& w_dot,
                                                      RowMatrixXd* v_dot) {
  if (!directional_.Factor(record.problem, solution, kinks_)) {
    return Status::kUnsolved;
  }
  // The equations of all rows that the directions may need.
  ContactSolution<double> with_rows = solution;
  with_rows.modes = directional_.modes();
  SolvedEquations view = record.View(directional_.blocks());
  view.solution = &with_rows;
  const int columns = static_cast<int>(w_dot.cols());
  RowMatrixXd rhs = RowMatrixXd::Zero(3 * directional_.num_blocks(), columns);
  VisitJacobian(model, view, JacobianRoute::kByHand, &scratch_,
                TangentSink{w_dot.data(), rhs.data(), columns});
  v_dot->resize(3 * record.problem.num_bodies, columns);
  std::vector<double> found;
  for (int c = 0; c < columns; ++c) {
    const double driven = driven_.Of(first_column_ + c, record.problem, rhs.data() + c,
                                     static_cast<int>(rhs.rows()), columns);
    if (driven == 0.0 && friction_.col(c).isZero(0.0)) {
      v_dot->col(c).setZero();
      continue;
    }
    const VectorX<double> r = rhs.col(c);
    const VectorX<double> friction = friction_.col(c);
    const Status status = directional_.Solve(std::vector<double>(r.begin(), r.end()),
                                             {friction.begin(), friction.end()}, &found);
    if (status != Status::kSolved) {
      return status;
    }
    v_dot->col(c) = Eigen::Map<const VectorX<double>>(found.data(), v_dot->rows());
  }
  return Status::kSolved;
}

// Moves the linearised problem of the step a small way along a direction.
void StepDirectional::MoveAlong(const Model<double>& model, const StepRecord& record,
                                const RowMatrixXd& w_dot, ContactProblem<double>* problem) {
  ContactSolution<double> with_rows = record.solution;
  std::vector<int> blocks(record.contacts.size(), -1);
  int num_blocks = problem->num_bodies + static_cast<int>(problem->joints.size());
  for (size_t i = 0; i < blocks.size(); ++i) {
    const ContactBlock<double>& c = problem->contacts[i];
    with_rows.modes[i] = c.has_friction ? ContactMode::kSticking : ContactMode::kClosed;
    blocks[i] = num_blocks++;
  }
  SolvedEquations view = record.View(blocks);
  view.solution = &with_rows;
  VectorX<double> r = VectorX<double>::Zero(3 * num_blocks);
  VisitJacobian(model, view, JacobianRoute::kByHand, &scratch_,
                TangentSink{w_dot.data(), r.data(), 1});
  double speed = 0.0;
  double rate = 0.0;
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const bool body = i < static_cast<Eigen::Index>(problem->mass.size());
    const double mass = body ? problem->mass[i] : 1.0;
    rate = std::max(rate, std::abs(r[i]) / mass);
    speed = body ? std::max(speed, std::abs(problem->load[i]) / mass) : speed;
  }
  const double way = rate > 0.0 ? kLinearisedWay * (speed > 0.0 ? speed : 1.0) / rate : 0.0;
  for (size_t i = 0; i < problem->load.size(); ++i) {
    problem->load[i] += way * r[static_cast<Eigen::Index>(i)];
  }
  int block = problem->num_bodies;
  for (JointBlock<double>& joint : problem->joints) {
    for (int k = 0; k < joint.rows; ++k) {
      joint.rhs[k] += way * r[3 * block + k];
    }
    ++block;
  }
  for (size_t i = 0; i < blocks.size(); ++i) {
    ContactBlock<double>& c = problem->contacts[i];
    c.c_n -= way * r[3 * blocks[i]];
    c.c_t -= way * r[3 * blocks[i] + 1];
    c.friction += c.has_friction ? way * friction_(static_cast<Eigen::Index>(i), 0) : 0.0;
  }
}

// Finds impulses that also solve the step and whose modes agree with the direction; false where
// there are none.
bool StepDirectional::ChooseImpulses(const Model<double>& model, const StepRecord& record,
                                     const RowMatrixXd& w_dot, ContactSolution<double>* solution) {
  ContactProblem<double> moved = record.problem;
  MoveAlong(model, record, w_dot, &moved);
  ContactSolution<double> along = record.solution;
  if (!solver_.Solve(moved, ContactSolverOptions(), &along).solved) {
    return false;
  }
  const ContactProblem<double>& problem = record.problem;
  ContactSystem& system = solver_.system();
  if (!system.Factor(problem, along.modes)) {
    return false;
  }
  std::vector<double> x(3 * static_cast<size_t>(system.num_blocks()), 0.0);
  std::copy(problem.load.begin(), problem.load.end(), x.begin());
  const size_t joints = problem.mass.size();
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    std::copy_n(problem.joints[j].rhs, problem.joints[j].rows, &x[joints + 3 * j]);
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (const int block = system.contact_block()[i]; block >= 0) {
      x[3 * block] = -problem.contacts[i].c_n;
      x[3 * block + 1] = along.modes[i] == ContactMode::kSticking ? -problem.contacts[i].c_t : 0.0;
    }
  }
  system.Solve(problem, along.modes, x.data(), 1);
  *solution = record.solution;
  solution->modes = along.modes;
  std::copy_n(x.begin() + static_cast<std::ptrdiff_t>(joints), solution->joint_impulse.size(),
              solution->joint_impulse.begin());
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const int block = system.contact_block()[i];
    const double sign = SlidingSign(along.modes[i]);
    const bool rolls = problem.contacts[i].rolls;
    const double normal = block < 0 ? 0.0 : rolls ? solution->normal_impulse[i - 1] : x[3 * block];
    solution->normal_impulse[i] = normal;
    solution->tangent_impulse[i] = block < 0     ? 0.0
                                   : sign != 0.0 ? -sign * problem.contacts[i].friction * normal
                                                 : x[3 * block + 1];
  }
  int worst;
  return NaturalResidual(problem, *solution, &worst) <= kHoldsAsWell;
}

// Handles a single direction that contradicts the impulses of the solution.
StepDirectional::Status StepDirectional::SolveOne(const Model<double>& model,
                                                  const StepRecord& record,
                                                  const RowMatrixXd& w_dot, RowMatrixXd* v_dot) {
  FindKinks(model, record, record.solution, w_dot);
  const Status status = SolveColumns(model, record, record.solution, w_dot, v_dot);
  ContactSolution<double> chosen;
  if (status != Status::kContradiction || !ChooseImpulses(model, record, w_dot, &chosen)) {
    return status;
  }
  FindKinks(model, record, chosen, w_dot);
  return SolveColumns(model, record, chosen, w_dot, v_dot);
}

bool StepDirectional::Apply(const Model<double>& model, Stepper* stepper, RowMatrixXd* w_dot,
                            std::string* message) {
  stepper->ChooseImpulses();
  const StepRecord& record = stepper->record();
  FollowStepTangent(model, record.time, record.h, w_dot);
  if (!FindKinks(model, record, record.solution, *w_dot)) {
    RowMatrixXd smooth = *w_dot;
    if (tangent_.ApplyAndMeasure(model, stepper, &smooth) < kContradictingRate) {
      *w_dot = smooth;
      return true;
    }
  }
  RowMatrixXd v_dot;
  first_column_ = 0;
  Status status = SolveColumns(model, record, record.solution, *w_dot, &v_dot);
  if (status == Status::kContradiction) {
    for (Eigen::Index c = 0; c < w_dot->cols(); ++c) {
      RowMatrixXd one;
      first_column_ = static_cast<int>(c);
      status = SolveOne(model, record, w_dot->col(c), &one);
      if (status != Status::kSolved) {
        break;
      }
      v_dot.col(c) = one;
    }
  }
  if (status != Status::kSolved) {
    *message = status == Status::kContradiction
                   ? "the direction contradicts redundant contacts"
                   : "the contacts at a kink have no rates along the direction";
    return false;
  }
  stepper->AdvanceTangent(model, v_dot.data(), w_dot);
  return true;
}

RolloutReport RolloutDirectional(ControlledModel<double> model, const State<double>& initial,
                                 const TangentObserver& observer, Stepper* stepper,
                                 RowMatrixXd* w_dot, State<double>* final) {
  StepDirectional directional;
  std::ostringstream failure;
  const StateObserver each = [&](long k, double t, const State<double>& state, Stepper* done) {
    std::string message;
    if (done != nullptr && failure.str().empty() &&
        !directional.Apply(model.At(k - 1), done, w_dot, &message)) {
      failure << "t = " << t << " s: no one-sided derivative: " << message;
    }
    if (observer) observer(k, t, state, *w_dot);
  };
  RolloutReport report = Rollout(model, initial, each, stepper, final);
  if (report.status == StepStatus::kDone && !failure.str().empty()) {
    report.status = StepStatus::kUnsolved;
    report.message = failure.str();
  }
  return report;
}

}  // namespace tangible
