// SPDX-License-Identifier: Apache-2.0
//
// Tangent, adjoint and tape of a step, of either stepping: a solve, the motion with the new twists,
// and the projection onto the joints; or the parts of a step by events.
#include <algorithm>

#include "tangible/dynamics/model/driven_bodies.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {

size_t StepTape::bytes() const {
  return sizeof(StepTape) + record.bytes() + system.bytes() + parts.bytes() +
         (projection ? sizeof(JointProjection) + projection->bytes() : 0);
}

void StepTape::DropFactors() {
  has_factors = false;
  system = ContactSystem();
  record.problem = ContactProblem<double>();
}

double Stepper::Tangent(const Model<double>& model, const std::vector<char>& fixed,
                        RowMatrixXd* w_dot, const SolveObserver& observer) {
  if (events_) {
    event_derivative_.of_island().Observe(observer ? &observer : nullptr);
    const double left = event_derivative_.Tangent(model, &mutable_parts(), w_dot);
    event_derivative_.of_island().Observe(nullptr);
    return left;
  }
  FollowStepTangent(model, record_.time, record_.h, w_dot);
  ChooseImpulses();
  ContactSystem& solved = system();
  solve_derivative_.Assemble(model, record_, solved, fixed, *w_dot);
  if (observer)
    observer(SolveStage::kAssembled, record_.problem, solved, solve_derivative_.rates());
  const double left = solve_derivative_.Solve(record_, &solved);
  if (observer) observer(SolveStage::kSolved, record_.problem, solved, solve_derivative_.rates());
  AdvanceTangent(model, solve_derivative_.rates().data(), w_dot);
  return left;
}

void Stepper::AdvanceTangent(const Model<double>& model, const double* twists, RowMatrixXd* w_dot) {
  const ModelStructure& s = *model.structure;
  const int columns = static_cast<int>(w_dot->cols());
  for (int k = 0; k < s.num_blocks(); ++k) {
    std::copy_n(twists + 3 * static_cast<size_t>(k) * columns, 3 * columns,
                w_dot->data() + static_cast<size_t>(s.TwistVariable(s.moving[k], 0)) * columns);
  }
  for (int body = 0; body < s.num_bodies(); ++body) {
    for (int i = 0; i < 3 && s.bodies[body].motion != Motion::kStatic; ++i) {
      w_dot->row(s.PoseVariable(body, i)) += record_.h * w_dot->row(s.TwistVariable(body, i));
    }
  }
  if (ProjectsOntoJoints(s)) projection_.Tangent(model, w_dot->data(), columns);
}

void Stepper::Take(const Model<double>& model, bool keep_factors, StepTape* tape) {
  tape->has_factors = keep_factors && !events_;
  if (events_) {
    std::swap(tape->parts, mutable_parts());
    return;
  }
  ChooseImpulses();
  if (keep_factors) system().MoveFactorsTo(&tape->system);
  factored_ = true;
  std::swap(tape->record, record_);
  if (!keep_factors || !tape->system.needs_problem()) {
    std::swap(tape->record.problem, record_.problem);
    tape->record.problem.Clear();  // its content belongs to another step
  }
  if (!ProjectsOntoJoints(*model.structure)) return;
  if (!tape->projection) tape->projection = std::make_unique<JointProjection>();
  *tape->projection = projection_;
}

void Stepper::Adjoint(const Model<double>& model, StepTape* tape, RowMatrixXd* w_bar) {
  if (events_) {
    event_derivative_.Adjoint(model, &tape->parts, w_bar);
  } else if (tape->has_factors) {
    SolveAdjoint(model, tape, &tape->system, w_bar);
  } else {
    std::swap(tape->record.problem, refactored_);
    Refactor(model, &tape->record);
    SolveAdjoint(model, tape, &solver_.system(), w_bar);
    std::swap(tape->record.problem, refactored_);
  }
}

void Stepper::SolveAdjoint(const Model<double>& model, StepTape* tape, ContactSystem* system,
                           RowMatrixXd* w_bar) {
  const ModelStructure& s = *model.structure;
  const int columns = static_cast<int>(w_bar->cols());
  if (ProjectsOntoJoints(s)) tape->projection->Adjoint(model, w_bar->data(), columns);
  for (int body = 0; body < s.num_bodies(); ++body) {
    if (s.bodies[body].motion == Motion::kStatic) continue;
    const double* pose = w_bar->data() + static_cast<size_t>(s.PoseVariable(body, 0)) * columns;
    double* twist = w_bar->data() + static_cast<size_t>(s.TwistVariable(body, 0)) * columns;
    for (int i = 0; i < 3 * columns; ++i) twist[i] += tape->record.h * pose[i];
  }
  solve_derivative_.GatherRates(s, *system, w_bar);
  solve_derivative_.Apply(model, tape->record, system, w_bar);
  FollowStepAdjoint(model, tape->record.time, tape->record.h, w_bar);
}

}  // namespace tangible
