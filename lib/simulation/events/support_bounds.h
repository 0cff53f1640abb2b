// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The instants at which a support brings a body to rest, or lets it go, as events.
//
//   stops     Σ v_i·v̂_i = 0   over the points that slow down, with the velocities v̂_i as the last
//                             motion began (of a disc v·v̂ + R² ω ω̂)
//   lets go   Ψ(u) + λ·u = 0  of a support that holds a body with the wrench λ
//
// A support can hold a body as long as Ψ(u) + λ·u ≥ 0 for all twists u. The u for which it first
// fails is the motion that begins; because it is where that function of u is least, it counts as
// constant in the derivative of the time.

#include "tangible/simulation/events/segment_flow.h"

namespace tangible {

/// The progress of what slows down: the function above. `at`: what the support does in the motion.
template <typename T>
T SupportProgress(const Model<T>& model, const State<T>& state, int k, const SupportState& at);

/// What is left of what support k can hold against a motion at the twist u, W: `holds` is the body
/// or its point; `wrench` holds the forces of its rows, three or two.
template <typename T>
T SupportReserve(const Model<T>& model, const State<T>& state, int k, int holds,
                 const std::array<double, 3>& u, const T* wrench);

/// The contact by which the event of a support is named and counted.
ActiveContact ContactOfSupport(const ModelStructure& structure, int support);

}  // namespace tangible
