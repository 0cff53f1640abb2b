// SPDX-License-Identifier: Apache-2.0
//
// Steps in Jets: implicit (through K of the double step) and unrolled (through every operation).
#include <cmath>

#include "tangible/simulation/events/implicit_residual_inl.h"
#include "tangible/simulation/stepping/step_unrolled_inl.h"

namespace tangible {
namespace {

template <typename T>
void ProjectImplicit(const Model<T>& model, JointProjection* projection, const State<double>& after,
                     State<T>* state) {
  constexpr int kWidth = NumDerivatives<T>::value;
  const ModelStructure& s = *model.structure;
  Model<double> values{model.structure, {}};
  std::vector<double> w_dot(static_cast<size_t>(s.num_variables()) * kWidth, 0.0);
  for (size_t i = 0; i < state->pose.size(); ++i) {
    for (int k = 0; k < kWidth; ++k) {
      w_dot[i * kWidth + k] = state->pose[i].v[k];
    }
  }
  for (int i = 0; i < s.num_parameters; ++i) {
    values.parameters.push_back(ValueOf(model.parameters[i]));
    for (int k = 0; k < kWidth; ++k) {
      w_dot[static_cast<size_t>(s.ParameterVariable(i)) * kWidth + k] = model.parameters[i].v[k];
    }
  }
  projection->Tangent(values, w_dot.data(), kWidth);
  for (size_t i = 0; i < state->pose.size(); ++i) {
    state->pose[i].a = after.pose[i];
    for (int k = 0; k < kWidth; ++k) {
      state->pose[i].v[k] = w_dot[i * kWidth + k];
    }
  }
}

}  // namespace

template <typename T>
void StepImplicit(const Model<T>& model, Stepper* stepper, const State<double>& after,
                  State<T>* state) {
  constexpr int kWidth = NumDerivatives<T>::value;
  stepper->ChooseImpulses();
  const StepRecord& record = stepper->record();
  const ModelStructure& s = *model.structure;
  ContactProblem<T> problem;
  internal::AssembleAll(model, record, *state, &problem);
  ContactSystem& system = stepper->system();
  std::vector<double> rhs(3 * static_cast<size_t>(system.num_blocks()) * kWidth, 0.0);
  ImplicitResidual<T>(problem, record.solution, SlidingSigns(record.problem, record.solution),
                      system.contact_block(), &rhs)
      .Fill();
  system.Solve(record.problem, record.solution.modes, rhs.data(), kWidth);
  for (int k = 0; k < s.num_blocks(); ++k) {
    for (int i = 0; i < 3; ++i) {
      T& twist = state->twist[3 * s.moving[k] + i];
      twist.a = record.solution.motion[3 * k + i];
      for (int d = 0; d < kWidth; ++d) {
        twist.v[d] = rhs[(3 * k + i) * kWidth + d];
      }
    }
  }
  internal::MovePoses(s, record.h, state);
  if (ProjectsOntoJoints(s)) {
    ProjectImplicit(model, &stepper->projection(), after, state);
  }
}

template <typename T>
bool StepUnrolled(const Model<T>& model, const StepRecord& record, State<T>* state) {
  const ModelStructure& s = *model.structure;
  const bool converged = SolveUnrolled(model, record, state);
  if (ProjectsOntoJoints(s)) {
    JointProjection::ProjectUnrolled(model, record.before.pose, state);
  }
  return converged;
}

#define TANGIBLE_INSTANTIATE_JET(N)                                                        \
  template void StepImplicit<Jet<N>>(const Model<Jet<N>>&, Stepper*, const State<double>&, \
                                     State<Jet<N>>*);                                      \
  template bool StepUnrolled<Jet<N>>(const Model<Jet<N>>&, const StepRecord&, State<Jet<N>>*);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
