// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The differential of a solution of the mixed LCP with respect to all its data.
//
// With the rows' modes (row_modes.h), R the active rows and those at a kink:
//
//   [ M    −Aᵀ   −G_Rᵀ        ] [dv  ]   [dp − dM v + dGᵀ z + dAᵀ y ]
//   [ A     0     0           ] [dy  ] = [db − dA v                 ]      dz = 0 elsewhere   (1)
//   [ G_R   0     F_RR + D(κ) ] [dz_R]   [−(dG v + dF z + dc)_R     ]
//
// The tangent solves (1); the adjoint solves its transpose once, Kᵀ (u, t, w) = (ℓ_v, ℓ_y, ℓ_z),
// and
//
//   ℓ_p = u     ℓ_b = t      ℓ_c = −w      ℓ_M = −sym(u vᵀ)     ℓ_F = −w zᵀ
//   ℓ_G = z uᵀ − w vᵀ        ℓ_A = y uᵀ − t vᵀ
//
// (F is not symmetric, so the transposed system differs from (1).) This is the differential of the
// interior-point equations with D(z), D(s) in the limit of exact complementarity, where a row is
// either divided by z or drops out.
//
// Where rows are redundant z and y are not unique; dv is right for perturbations that keep the rows
// consistent (all physical ones), and single entries of ℓ_G, ℓ_F, ℓ_c, ℓ_A are meaningful only
// contracted with such perturbations. At a kink the derivative is the element of the generalised
// Jacobian that the central path selects. The certificate reports both cases.

#include "tangible/lcp/certificate/certificate.h"
#include "tangible/lcp/dense/mode_system.h"
#include "tangible/lcp/dense/problem.h"
#include "tangible/lcp/dense/row_modes.h"

namespace tangible {

class LcpDerivative {
 public:
  /// `problem` valid and conformed, `solution` solved. Both are copied. Cost: one factorisation,
  /// and the cost of ClassifyRows where rows are degenerate.
  LcpDerivative(const MixedLcp<double>& problem, const LcpVector& solution);

  /// The change of the solution for a change of the data, which has the shape of the problem.
  LcpVector Tangent(const MixedLcp<double>& perturbation) const;

  /// The one-sided derivative along `perturbation`, exact also at kinks: dz ≥ 0, ds ≥ 0 and
  /// complementary on the kink rows, a small LCP. False if that LCP has no solution (the perturbed
  /// problem has none, or its solution jumps). The derivative from the other side is
  /// −OneSidedTangent(−perturbation).
  bool OneSidedTangent(const MixedLcp<double>& perturbation, LcpVector& change) const;

  /// The gradient of a loss with respect to the data, in the shape of the problem, given its
  /// gradient with respect to v, y and z.
  MixedLcp<double> Adjoint(const LcpVector& loss_gradient) const;

  const RowModes& row_modes() const { return rows_; }

  /// Its linear_residual covers the derivatives computed so far.
  Certificate certificate() const;

 private:
  LcpVector RightHandSide(const MixedLcp<double>& perturbation) const;

  MixedLcp<double> problem_;
  RowModes rows_;
  ModeSystem system_;
  mutable double linear_residual_ = 0.0;
};

}  // namespace tangible
