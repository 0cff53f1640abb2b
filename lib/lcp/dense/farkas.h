// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Proof that a mixed LCP has no feasible point. Multiply (1), (2), (3) of problem.h by u, t, w:
//
//   M u + Aᵀ t + Gᵀ w = 0,  A u = 0,  w ≥ 0,  Fᵀ w ≤ G u,      uᵀ p + tᵀ b − wᵀ c = δ > 0
//
// leave wᵀ s + (G u − Fᵀ w)ᵀ z = −δ, which no s ≥ 0, z ≥ 0 satisfies. For the plain LCP:
// w ≥ 0, Fᵀ w ≤ 0, cᵀ w < 0.

#include "tangible/lcp/dense/problem.h"

namespace tangible {

/// Whether (u, t, w) proves infeasibility: each condition holds to 1e-10 of the sizes of its terms,
/// and δ is at least 1e-6 of the sizes of its terms.
bool CheckFarkas(const MixedLcp<double>& problem, const VectorX<double>& farkas);

/// Returns a checked vector (u, t, w), largest entry 1; empty if the constraints can be satisfied
/// or nothing could be proved. Method: non-negative least squares, up to 3 (2 nz) QRs, of equations
/// that are scaled in two ways, as rows may be in any units; the check is of the problem as it is.
VectorX<double> FindFarkas(const MixedLcp<double>& problem);

}  // namespace tangible
