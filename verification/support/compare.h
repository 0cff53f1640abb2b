// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The comparison of the Jacobians of a rollout by two methods (simulation/gradient.h).
//
// The outputs are the final poses and twists of the moving bodies, (x, y, angle, vx, vy, omega) a
// body. Two entries agree where
//
//   |a − b| ≤ tolerance |b| + 1e-13 S,
//
// with S the sum of the magnitudes of the contributions to the entry, o an output and p a
// parameter. After any number k of steps ∂o/∂p = Σᵢ w̄ₖ(i, o) ẇₖ(i, p) over all variables i, and the
// step after it passes on uᵀ (∂R/∂w) ẇ, with Kᵀ u = x̄ and K ẋ = −(∂R/∂w) ẇ (equation_jacobian.h).
// Rounding in step k changes the entry by some ε of the magnitudes of the terms of these products,
// those of the linear solve included:
//
//   S(o, p) = Σₖ |w̄ₖ|ᵀ ⌈ẇₖ⌉ + |uₖ|ᵀ (|∂R/∂w| |ẇₖ₋₁| + |K| |ẋₖ|)
//   ⌈ẇₖ⌉ = |ẇₖ| but for  ⌈v̇⁺⌉ = M⁻¹ (the rows of (|∂R/∂w| |ẇ| + |K| |ẋ|) of momentum),
//                        ⌈q̇⁺⌉ = |q̇| + h ⌈v̇⁺⌉.
//
// The parts of event steps are not included: S = Σₖ |w̄ₖ|ᵀ |ẇₖ|.
//
// S is large where large terms cancel (a body at rest, whose impulses cancel all that acts on it; a
// landing, which has ∂v/∂y of order 1/h). It is at least a tenth of the column's largest, ⌈ẇₖ⌉ at
// any step included, because rounding inside an element's derivatives, which is not measured here,
// is a fraction of those, and because the terms that cancel in a landing cancel again in each step
// at rest: an entry below 1e-14 of its column is rounding. 1e-13 is 450 ε: roundings of some steps.

#include <string>
#include <vector>

#include "tangible/scene/parameter.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {

struct Contributions {
  MatrixX<double> sum;     ///< S above, outputs x parameters
  VectorX<double> column;  ///< the largest of each parameter's column, and of ⌈ẇₖ⌉ at any step
};
Contributions ContributionsOf(const Scene& scene, const std::vector<ParameterPath>& parameters);

/// Only S.
MatrixX<double> ContributionMagnitudes(const Scene& scene,
                                       const std::vector<ParameterPath>& parameters);

/// |a − b| ≤ tolerance |b| + rounding S for one entry.
bool Agree(double a, double b, double tolerance, double contributions, double rounding = 1e-13);

}  // namespace tangible
