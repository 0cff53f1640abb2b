// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The dot-product test of a rollout's derivative J: for a weight u of the final state and a
// direction d
//
//   (uᵀ J) d  by the adjoint  =  uᵀ (J d)  by the tangent
//
// Both use the same factorisations, but sum in opposite order: what they differ by is what rounding
// has left of the derivative, however small each residual is.

#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

/// The largest difference over the directions (num_variables x columns), relative to the sum of the
/// magnitudes of the products that make it. Every entry of the final state weighs alike. Infinite
/// where the rollout fails; 0 without directions.
double DualityGap(const Model<double>& model, const State<double>& initial,
                  const RowMatrixXd& directions);

/// Whether a model's masses (or inertias) are so far apart that the test is worth its time: by 1e3.
bool HasWideMasses(const Model<double>& model);

}  // namespace tangible
