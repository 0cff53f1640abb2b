// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which rows count as active when a solution of the mixed LCP is differentiated.
//
// Rows with zᵢ > 0 are active (dsᵢ = 0), with sᵢ > 0 inactive (dzᵢ = 0). A degenerate row,
// zᵢ = sᵢ = 0, may move either way, dzᵢ ≥ 0, dsᵢ ≥ 0; but often the other rows leave it no choice.
// On the cone of directions (dv, dy, dz) with
//
//   M dv − Aᵀ dy − Gᵀ dz = 0,  A dv = 0,  ds = 0 on active, dz = 0 on inactive rows,
//   dz ≥ 0 and ds ≥ 0 on degenerate ones
//
// a functional dzᵢ or dsᵢ that is zero everywhere is zero because of the structure of the rows, for
// every perturbation (it is part of a non-negative combination that vanishes). Therefore
//
//   dsᵢ ≡ 0            active     a box at rest: both friction rows, ds₊ + ds₋ = 2 dγ = 0
//   dzᵢ ≡ 0            inactive   friction rows of an open contact: dλ₊ + dλ₋ ≤ μ dλₙ = 0
//   neither            a kink     a contact that just touches
//
// A kink row gets the equation ds + κ dz = …, where κ = Wᵢᵢ is the rate at which its own slack
// rises with zᵢ. This is the limit of the central path z s → 0: for a single kink the mean of the
// two one-sided derivatives.
//
// A. J. Goldman, A. W. Tucker (1956), on strictly complementary pairs of inequalities.

#include <vector>

#include "tangible/lcp/dense/mode_system.h"
#include "tangible/lcp/dense/problem.h"

namespace tangible {

struct RowModes {
  std::vector<RowMode> modes;   ///< nz
  VectorX<double> kink_weight;  ///< nz, κ; 0 where there is no kink
  LcpVector point;              ///< the solution they were read at
  int num_kinks = 0;
  double margin_min = 0.0;       ///< as in certificate.h; 0 at a kink
  Eigen::Index margin_row = -1;  ///< -1: no row has a margin
};

/// Reads the modes at a solution. Variables zᵢ that act only on the slack of rows without force
/// (the sliding speed γ of an open contact) are not unique; they are first lowered to their least
/// value, at which kinks of the rows around them become visible. `point` differs from the solution
/// only by that. Cost: for n degenerate rows a null space and up to 2 n small non-negative least
/// squares.
RowModes ClassifyRows(const MixedLcp<double>& problem, const LcpVector& solution);

}  // namespace tangible
