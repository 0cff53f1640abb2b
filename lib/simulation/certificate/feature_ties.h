// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How near a pair's closed contacts are to a change of features at which a derivative jumps.
//
// The vertices, edges or planes that form a contact are a discrete choice (collide.h). Where it
// changes the gap is continuous, but its derivatives need not be: a ball above a box's corner has a
// turning normal on one side and a fixed one on the other. The pair's relative pose is moved by
// ±kFeatureMargin along x, y and angle. Where a closed contact then has other features, the two
// choices' equations R and R' differ by (∂R'/∂q − ∂R/∂q) dq, and with the step's matrix K
//
//   δv⁺ = K⁻¹ (R − R') / |dq|
//
// is the jump of the derivative of the new twist. Equivalent choices without such a jump (equal
// boxes at rest on each other) do not count. Where no contact of the new choice continues a closed
// one, or the normal turns within the move, the geometry itself is not smooth: this always counts.

#include "tangible/simulation/stepping/step.h"

namespace tangible {

/// The relative distance, at most kFeatureMargin, at which the pair of the contacts [first, last)
/// of the record changes features with a jump of the derivative; infinite where it does not.
/// `system` holds the step's factorisation. Cost: six searches of the pair, and a solve where
/// features change.
double FeatureChangeMargin(const Model<double>& model, const StepRecord& record, size_t first,
                           size_t last, ContactSystem* system);

/// Whether two corners meet where two shapes touch at `state`: beside the contact, by
/// kFeatureMargin of the smaller body's size to either side along its tangent, none of the pair's
/// contacts has its normal. A small shift to one side makes the bodies collide, to the other pass
/// or collide differently.
bool MeetsACorner(const Model<double>& model, const State<double>& state,
                  const ActiveContact& contact);

/// Whether a disc's contact is handed over from a face to its end, or back, within `time`, s,
/// before or after a state, as the bodies move with their twists: there the disc begins to turn
/// about a corner, or ends to. False where neither shape is a disc.
bool IsHandedOver(const Model<double>& model, const State<double>& state,
                  const ActiveContact& contact, double time);

/// Whether a disc touches exactly where a face ends: a little to one side of it, by kFeatureMargin
/// of the smaller body's size, it touches the face and to the other the end. False where neither
/// shape is a disc.
bool IsAtEndOfFace(const Model<double>& model, const State<double>& state,
                   const ActiveContact& contact);

}  // namespace tangible
