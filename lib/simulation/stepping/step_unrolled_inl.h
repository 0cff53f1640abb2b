// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The unrolled step (step.h) for any scalar; included by step_jets.cc, and by verification's file
// for another scalar.

#include "tangible/lcp/contact/contact_interior_point.h"
#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/tolerances.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace internal {

template <typename T>
void AssembleAll(const Model<T>& model, const StepRecord& record, const State<T>& state,
                 ContactProblem<T>* problem) {
  AssemblyScratch<T> scratch;
  AssembleWithoutContacts(model, state, record.time, record.h, problem, &scratch);
  AssembleContacts(model, state, record.h, record.contacts, record.friction, record.restitution,
                   &scratch, problem);
}

// q := q + h v, including the derivative parts.
template <typename T>
void MovePoses(const ModelStructure& structure, double h, State<T>* state) {
  for (int body = 0; body < structure.num_bodies(); ++body) {
    for (int i = 0; i < 3 && structure.bodies[body].motion != Motion::kStatic; ++i) {
      state->pose[3 * body + i] += h * state->twist[3 * body + i];
    }
  }
}

}  // namespace internal

/// The step without the projection onto joints: the twist from the unrolled interior point, and the
/// poses after moving with it; false where it does not converge.
template <typename T>
bool SolveUnrolled(const Model<T>& model, const StepRecord& record, State<T>* state) {
  const ModelStructure& s = *model.structure;
  ContactProblem<T> problem;
  internal::AssembleAll(model, record, *state, &problem);
  InteriorPointWorkspace<T> workspace;
  ContactSolution<T> solution;
  ContactInteriorPointOptions options;
  options.complementarity = kUnrolledComplementarity;
  const InteriorPointOutcome outcome =
      SolveContactsByInteriorPoint(problem, options, &workspace, &solution);
  SpreadTwists(s, solution.motion, &state->twist);
  internal::MovePoses(s, record.h, state);
  return outcome.converged;
}

}  // namespace tangible
