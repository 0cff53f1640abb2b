// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/rollout_directional.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace tangible {

bool JustTouches(const StepRecord& record, size_t i) {
  constexpr double kRoundings = 64.0;
  const ActiveContact& contact = record.contacts[i];
  const ContactBlock<double>& block = record.problem.contacts[i];
  const double slack =
      RowDot(block.a, block.normal_a, block.b, block.normal_b, record.solution.v.data()) +
      block.c_n;
  double coordinate = 0.0;
  for (const int body : {contact.a, contact.b}) {
    if (body >= 0) {
      coordinate = std::max({coordinate, std::abs(record.before.pose[3 * body]),
                             std::abs(record.before.pose[3 * body + 1])});
    }
  }
  return slack <= kRoundings * std::numeric_limits<double>::epsilon() * coordinate / record.h;
}

// Whether there are any.
bool StepDirectional::FindKinks(const Model<double>& model, const StepRecord& record,
                                const RowMatrixXd& w_dot) {
  const size_t count = record.contacts.size();
  std::vector<bool> touching(count);
  friction_.setZero(static_cast<Eigen::Index>(count), w_dot.cols());
  for (size_t i = 0; i < count; ++i) {
    touching[i] = record.solution.modes[i] == ContactMode::kOpen && JustTouches(record, i);
    for (int k = 0; k < 2 && record.contacts[i].joint < 0; ++k) {
      if (const int number = record.friction[i].numbers[k]; number >= 0) {
        friction_.row(static_cast<Eigen::Index>(i)) +=
            record.friction[i].derivatives[k] * w_dot.row(model.structure->NumberVariable(number));
      }
    }
  }
  tangible::FindKinks(record.problem, record.solution, touching, kDegenerateTolerance, &kinks_);
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

bool StepDirectional::Solve(const Model<double>& model, const StepRecord& record,
                            const RowMatrixXd& w_dot, std::string* message) {
  if (!directional_.Factor(record.problem, record.solution, kinks_)) {
    *message = "the contacts that are not at a kink have a singular system";
    return false;
  }
  // The equations of all rows that the directions may need.
  ContactSolution<double> solution = record.solution;
  solution.modes = directional_.modes();
  SolvedStep view = record.View(directional_.blocks());
  view.solution = &solution;
  const int columns = static_cast<int>(w_dot.cols());
  const size_t rows = 3 * static_cast<size_t>(directional_.num_blocks());
  std::vector<double> rhs(rows * columns, 0.0);
  VisitStepJacobian(model, view, JointRoute::kByHand, &scratch_,
                    TangentSink{w_dot.data(), rhs.data(), columns});
  const size_t bodies = 3 * static_cast<size_t>(record.problem.num_bodies);
  rates_.assign(bodies * columns, 0.0);
  std::vector<double> r(rows), friction(record.contacts.size()), v_dot;
  for (int c = 0; c < columns; ++c) {
    for (size_t i = 0; i < rows; ++i) {
      r[i] = rhs[i * columns + c];
    }
    for (size_t i = 0; i < friction.size(); ++i) {
      friction[i] = friction_(static_cast<Eigen::Index>(i), c);
    }
    const ContactDirectional::Status status = directional_.Solve(r, friction, &v_dot);
    if (status != ContactDirectional::Status::kSolved) {
      *message = status == ContactDirectional::Status::kContradiction
                     ? "the direction contradicts redundant contacts"
                     : "the contacts at a kink have no rates along the direction";
      return false;
    }
    for (size_t i = 0; i < bodies; ++i) {
      rates_[i * columns + c] = v_dot[i];
    }
  }
  return true;
}

bool StepDirectional::Apply(const Model<double>& model, Stepper* stepper, RowMatrixXd* w_dot,
                            std::string* message) {
  const StepRecord& record = stepper->record();
  if (!FindKinks(model, record, *w_dot)) {
    tangent_.Apply(model, stepper, w_dot);
    return true;
  }
  if (!Solve(model, record, *w_dot, message)) {
    return false;
  }
  AdvanceTangent(model, stepper, rates_.data(), w_dot);
  return true;
}

RolloutReport RolloutDirectional(const Model<double>& model, const State<double>& initial,
                                 RowMatrixXd* w_dot, State<double>* final) {
  StepDirectional directional;
  std::ostringstream failure;
  const StateObserver each = [&](long, double t, const State<double>&, Stepper* stepper) {
    std::string message;
    if (stepper != nullptr && failure.str().empty() &&
        !directional.Apply(model, stepper, w_dot, &message)) {
      failure << "t = " << t << " s: no one-sided derivative: " << message;
    }
  };
  RolloutReport report = Rollout(model, initial, each, final);
  if (report.status == StepStatus::kDone && !failure.str().empty()) {
    report.status = StepStatus::kUnsolved;
    report.message = failure.str();
  }
  return report;
}

}  // namespace tangible
