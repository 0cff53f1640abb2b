// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The seams of a model: which of its bodies that do not move by forces lie next to each other and
// keep their places relative to each other, and what they hide of each other's surface
// (geometry/seams.h). These are static bodies, and kinematic ones with equal velocities that do not
// turn. Their shapes and poses are numbers of the model, so that each model has its own seams.

#include "tangible/dynamics/model/model.h"

namespace tangible {

/// Sets the model's seams; `state` is that at time 0. O(bodies) where at most one body has a shape
/// and does not move by forces, else O(n log n) of those bodies.
void FindModelSeams(const State<double>& state, Model<double>* model);

}  // namespace tangible
