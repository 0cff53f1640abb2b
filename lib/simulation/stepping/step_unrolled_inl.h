// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The unrolled step (step.h) for any scalar; included by step_jets.cc, and by verification's file
// for another scalar.

#include "tangible/simulation/events/segment_flow.h"
#include "tangible/simulation/events/solve_jets_inl.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {

/// The step without the projection onto joints: the twist from the unrolled interior point, and the
/// poses after moving with it; false where it does not converge.
template <typename T>
bool SolveUnrolled(const Model<T>& model, const StepRecord& record, State<T>* state) {
  ContactProblem<T> problem;
  AssembleInJets(model, record, *state, &problem);
  ContactSolution<T> solution;
  const bool converged = SolveUnrolled(problem, record.solution, &solution);
  SpreadTwists(*model.structure, solution.motion, &state->twist);
  MovePoses(*model.structure, record.h, state);
  return converged;
}

}  // namespace tangible
