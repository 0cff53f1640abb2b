// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The nearest poses that satisfy the joints (projection_newton.h), for cases in which Newton's
// method from poses that violate the joints finds none: drifts of the length of a link, with very
// different masses.
//
// From poses on the joints a step d along them, by the matrix (2) with a convex weight, lowers
// ½|q − q̃|²_M; it is halved until it does so after the way back onto the joints (Newton's method on
// C alone). Every few steps Newton's method for all of (1) is tried from there.

#include <vector>

#include "tangible/simulation/stepping/projection_newton.h"

namespace tangible {

/// Number of Newton steps in each trial.
inline constexpr int kMostOfDescent = 12;

/// After an IterateProjection that has failed; `start` has poses of all bodies, near the joints.
/// False where no poses that satisfy the joints are found from there, or no minimum is reached.
bool DescendToProjection(const Model<double>& model, const std::vector<double>& start,
                         ProjectionIterate<double>* iterate);

}  // namespace tangible
