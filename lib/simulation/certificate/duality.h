// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The test of a rollout's derivative J by its two sweeps: for output i, an entry of the final
// state, and direction d
//
//   a = (eᵢᵀ J) d  by the adjoint,   b = eᵢᵀ (J d)  by the tangent
//
// Both use the same factorisations, but sum in opposite order: what they differ by is what rounding
// has left of the derivative, however small each residual is. An entry's difference is relative to
// the entry, and to what of the state is rounding whatever the parameter does:
//
//   gap = |a − b| / (|b| + 1e-4 S)                                                    (1)
//
// S, per unit of the parameter, in m or m/s, at the radius of gyration for an angle:
// the largest change of a pose (of a twist) of any body that the direction causes during the run,
// or, if that is more, the largest coordinate (speed) of any body during the run, over the
// parameter's size. A speed is also that of the free motion: what gravity would add in a step to a
// body at rest, and contacts take.
//
// So gap ≤ 1e-10 is |a − b| ≤ 1e-10 |b| + 1e-14 S: a change of the parameter by all of its size
// changes the output by 1e-14 of what it is. The magnitudes of an adjoint's terms, |w̄|ᵀ |d|, are
// not part of S: where they cancel (a chain that is turned as a whole, a heavy load) the adjoint
// loses the digits that the tangent keeps.
//
// Of up to kMostDualityColumns outputs each has its column of the adjoint. Of more, up to half of
// the columns are of single outputs that have an entry at rounding, and outputs whose |b| + 1e-4 S
// are alike along every direction share the others, with weights 1 / (that) and signs that
// alternate; the denominator of (1) is then the root of the sum of squares.

#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

inline constexpr int kMostDualityColumns = 64;

/// The largest gap (1), at most 1, over outputs and directions (num_variables x columns); `sizes`:
/// how large each direction's parameter is, > 0, in its own unit; empty: 1 each. Infinite where the
/// rollout fails or a derivative is not finite; 0 without directions. Cost: a tangent, and an
/// adjoint of up to kMostDualityColumns columns.
double DualityGap(const Model<double>& model, const State<double>& initial,
                  const RowMatrixXd& directions, const std::vector<double>& sizes = {});

/// Whether a model's masses (or inertias) are so far apart that the test is worth its time: by 1e3.
bool HasWideMasses(const Model<double>& model);

}  // namespace tangible
