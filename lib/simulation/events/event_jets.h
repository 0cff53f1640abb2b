// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// An event step in Jets, beside the same step in double, which makes the discrete choices: its
// parts are run again with every state, number and time a Jet.
//
//   implicit   each linear system by K⁻¹ of the double step applied to the Jets' residual
//   unrolled   impacts by the interior point in Jets, systems of given modes by elimination in Jets
//
// The length τ of a segment that an event ends is where the event's equation holds in Jets:
//
//   g(S(τ), t + τ) = 0,   τ ← τ − g / (dg/dτ)
//
// by Newton's iteration from the length that the double step found, with the map S and the equation
// g (gap, speed or force) evaluated in Jets in each iteration. dg/dτ is evaluated in Jets too, with
// τ as the only variable: the derivatives of the tangent (event_derivative.h) are not used.

#include "tangible/simulation/events/event_record.h"

namespace tangible {

enum class JetRoute { kImplicit, kUnrolled };

/// `record` is that of the double step from the state's values.
template <typename T>
void EventStepInJets(const Model<T>& model, const Model<double>& values, JetRoute route,
                     EventRecord* record, State<T>* state);

}  // namespace tangible
