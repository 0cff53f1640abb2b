// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Mehrotra's predictor-corrector interior point method on the three-row form of a contact problem
// (contact_problem.h), templated on the scalar: with Jets every operation carries derivatives,
// which gives the unrolled reference, independent of the formulas of the implicit derivative.
//
//   M v − Aᵀ y − Bᵀ z = p,  A v = b,  G v + F z + c = s,  z ∘ s = τ κ → 0
//   per contact   G = [n; t; 0],  B = [n − μ t; t; 0],  F = [0 0 0; 0 0 1; 2μ −1 0]
//
// κ is the natural unit of z s: V² / (r M⁻¹ rᵀ) with V the largest speed of the data. Each
// iteration solves this system:
//   [M −Aᵀ −Bᵀ; A 0 0; G 0 F + D(s/z)] twice with one block LU.
// Source: S. Mehrotra, SIAM J. Optim. 2 (1992) 575; Nocedal & Wright, Numerical Optimization, 14.2.

#include <vector>

#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/system/block_lu.h"
#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// Scratch that keeps its memory. z and s have three entries for each contact.
template <typename T>
struct InteriorPointWorkspace {
  BlockLu<T> lu;
  std::vector<std::pair<int, int>> edges;
  std::vector<T> v, y, z, s;
  std::vector<T> step;  ///< of (v, y, z): three for each block
  std::vector<T> affine;
  std::vector<T> rhs, correction;  ///< of the refined solve
  std::vector<T> ds, ds_affine, target, residual;
  std::vector<double> unit_z, unit_s;  ///< scales of z and s
};

struct InteriorPointOutcome {
  bool converged = false;
  int iterations = 0;
  double complementarity = 0.0;  ///< mean of z s / κ at the end
};

struct ContactInteriorPointOptions {
  double complementarity = kContactComplementarity;  ///< goal: mean of z s / κ
  int max_iterations = 100;
  bool resume = false;  ///< goes on from where the workspace's last call on the same problem ended
  /// Size of the term on the change of impulses that keeps the system of redundant contacts regular
  /// (contact_interior_point_inl.h).
  double proximal = kProximal;
};

/// Solves from a neutral start until the mean of z s / κ is at most `complementarity` (1e-14 for
/// unrolled derivatives). Fills v, impulses and modes of `solution`. Never returns NaN: a step that
/// is not finite ends the iteration, unconverged.
template <typename T>
InteriorPointOutcome SolveContactsByInteriorPoint(const ContactProblem<T>& problem,
                                                  const ContactInteriorPointOptions& options,
                                                  InteriorPointWorkspace<T>* workspace,
                                                  ContactSolution<T>* solution);

}  // namespace tangible
