// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The linear system of a mixed LCP whose rows of (3) have been assigned modes:
//
//   [ M    −Aᵀ   −G_Rᵀ         ] [dv  ]   [r_v]
//   [ A     0     0            ] [dy  ] = [r_y]       R: the rows that are active or at a kink
//   [ G_R   0     F_RR + D(κ)  ] [dz_R]   [r_z]
//
//   active    ds = r_z (κ = 0)      inactive   dz = 0, no row      kink   ds + κ dz = r_z, κ > 0
//
// Solved by LU with refinement, or, where it is singular (redundant rows), by a complete orthogonal
// decomposition of the equilibrated matrix: the solution of least norm, least squares if there is
// none. The same factorisation serves the transposed system, so that tangent and adjoint agree to
// rounding also where the solution is not unique.

#include <vector>

#include "tangible/lcp/dense/problem.h"
#include "tangible/lcp/dense/scaling.h"
#include "tangible/math/decompositions.h"

namespace tangible {

enum class RowMode : char { kInactive, kActive, kKink };

/// A vector over (v, y, z); z of inactive rows is 0.
struct LcpVector {
  VectorX<double> v;
  VectorX<double> y;
  VectorX<double> z;
};

class ModeSystem {
 public:
  /// `kink_weight` (nz) is κ, read for rows at a kink. `problem` is not kept.
  ModeSystem(const MixedLcp<double>& problem, const std::vector<RowMode>& modes,
             const VectorX<double>& kink_weight);

  /// The solution for r; r.z of inactive rows is not read. `relative_error`: the largest |K x − r|
  /// over the largest |r| of the equilibrated system, about 1e-16 unless r is inconsistent.
  LcpVector Solve(const LcpVector& r, double* relative_error = nullptr) const;
  /// The solution of the transposed system.
  LcpVector SolveTransposed(const LcpVector& g, double* relative_error = nullptr) const;

  /// How many unknowns the equations leave undetermined.
  int rank_deficiency() const { return rank_deficiency_; }
  /// Estimate of the condition of the equilibrated matrix (of its regular part if singular).
  double condition() const { return condition_; }

 private:
  VectorX<double> Gather(const LcpVector& x) const;
  LcpVector Scatter(const VectorX<double>& x) const;

  Eigen::Index nv_;
  Eigen::Index ny_;
  Eigen::Index nz_;
  std::vector<Eigen::Index> rows_;  // R
  Equilibration scaling_;
  MatrixX<double> K_;  // equilibrated
  PartialLu lu_;
  OrthogonalDecomposition orthogonal_;
  int rank_deficiency_ = 0;
  double condition_ = 1.0;
  bool singular_ = false;
};

}  // namespace tangible
