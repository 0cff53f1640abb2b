// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Mehrotra's predictor-corrector interior-point method for the mixed LCP (problem.h).
//
// The central path, κ > 0:  (1), (2), s = G v + F z + c, zᵢ sᵢ = κ. Each iteration takes a Newton
// step towards κ = 0 (predictor), reads from it how far κ can fall, σ = (κ_aff / κ)³, and steps
// towards σ κ with the second-order term dz ds of the predictor (corrector). Both steps use one LU
// of
//
//   [ M            −Aᵀ   −Gᵀ              ]
//   [ A             0     0               ]         rows of (3) divided by zᵢ + sᵢ
//   [ D(z) G        0     D(s) + D(z) F   ]
//
// of the equilibrated problem (scaling.h). v and y are not eliminated, because with redundant
// contacts rounding can make G M⁻¹ Gᵀ indefinite. Blocks that may be singular (A redundant, M
// semidefinite) get 1e-12 on their diagonal, which changes the step but not the point it converges
// to.
//
// With Jets every operation runs in Jets ("unrolled"), to a complementarity of 1e-14: the
// derivatives are those of the central path at κ, off by about max(1e-7, 10 κ / margin²).
// For problems that are not monotone (friction) convergence is not guaranteed; the caller checks
// the residual.
//
// S. Mehrotra, SIAM J. Optim. 2 (1992) 575; S. J. Wright, Primal-Dual Interior-Point Methods
// (1997).

#include "tangible/lcp/dense/problem.h"
#include "tangible/lcp/dense/tolerances.h"

namespace tangible {

struct InteriorPointOptions {
  int max_iterations = 100;
  /// Stop when κ is below this, dimensionless. Modes with a margin m can be distinguished at κ <
  /// m²; the default suits derivatives by unrolled Jets.
  double complementarity = kUnpolishedGoal;
  /// ... and the largest residual of the scaled equations, whose data have size 1, below this.
  double residual = kEquationGoal;
};

template <typename T>
struct InteriorPointResult {
  VectorX<T> v;
  VectorX<T> y;
  VectorX<T> z;  ///< ≥ 0
  int iterations = 0;
  bool converged = false;  ///< to the options' limits; if not, the best iterate
};

/// Cost: an LU of nv + ny + nz unknowns an iteration. `problem` must be valid, with its empty
/// blocks conformed. Never returns NaN: the best iterate, at worst the start.
template <typename T>
InteriorPointResult<T> SolveInteriorPoint(const MixedLcp<T>& problem,
                                          const InteriorPointOptions& options = {});

}  // namespace tangible
