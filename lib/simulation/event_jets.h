// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// An event step in Jets, beside the same step in double, which makes the discrete choices: its
// parts are run again with every state, number and time a Jet.
//
//   implicit   each linear system by K⁻¹ of the double step applied to the Jets' residual
//   unrolled   impacts by the interior point in Jets, systems of given modes by elimination in Jets
//
// The length of a segment that an event ends is τ − g / (dg/dτ) in Jets: one Newton step from the
// time that the double step found, exact in the derivatives.

#include "tangible/simulation/rollout.h"

namespace tangible {

/// `record` is that of the double step from the state's values; `derivative` tells the events'
/// rates.
template <typename T>
void EventStepInJets(const Model<T>& model, const Model<double>& values, JetRoute route,
                     EventRecord* record, EventDerivative* derivative, State<T>* state);

}  // namespace tangible
