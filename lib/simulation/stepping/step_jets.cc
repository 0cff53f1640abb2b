// SPDX-License-Identifier: Apache-2.0
//
// Steps in Jets: implicit (through K of the double step) and unrolled (through every operation).
#include <cmath>

#include "tangible/dynamics/model/driven_bodies.h"
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

template <typename T>
void StepImplicit(const Model<T>& model, Stepper* stepper, const State<double>& after,
                  State<T>* state) {
  stepper->ChooseImpulses();
  const StepRecord& record = stepper->record();
  ContactProblem<T> problem;
  AssembleInJets(model, record, *state, &problem);
  ContactSolution<T> solution;
  SolveImplicitly(problem, record.problem, record.solution,
                  SlidingSigns(record.problem, record.solution), &stepper->system(), &solution);
  SpreadTwists(*model.structure, solution.motion, &state->twist);
  MovePoses(*model.structure, record.h, state);
  if (ProjectsOntoJoints(*model.structure)) {
    ProjectImplicit(model, &stepper->projection(), after, state);
  }
}

template <typename T>
bool StepUnrolled(const Model<T>& model, const StepRecord& record, State<T>* state) {
  const bool converged = SolveUnrolled(model, record, state);
  if (ProjectsOntoJoints(*model.structure)) {
    JointProjection::ProjectUnrolled(model, record.before.pose, state);
  }
  return converged;
}

}  // namespace

template <typename T>
bool StepInJets(const Model<T>& model, const Model<double>& values, JetRoute route,
                const State<double>& after, Stepper* stepper, State<T>* state) {
  if (stepper->by_events()) {
    IslandStepInJets(model, values, route, &stepper->mutable_parts(), state);
    return true;
  }
  FollowPathsOverStep(model, stepper->record().time, stepper->record().h, state);
  state->released = stepper->record().before.released;
  if (route == JetRoute::kUnrolled) {
    const State<T> before = *state;
    if (StepUnrolled(model, stepper->record(), state)) return true;
    *state = before;
  }
  StepImplicit(model, stepper, after, state);
  return route == JetRoute::kImplicit;
}

#define TANGIBLE_INSTANTIATE_JET(N)                                                      \
  template bool StepInJets<Jet<N>>(const Model<Jet<N>>&, const Model<double>&, JetRoute, \
                                   const State<double>&, Stepper*, State<Jet<N>>*);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)

}  // namespace tangible
