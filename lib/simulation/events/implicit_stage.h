// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The implicit stage of an integrator whose fixed-point iteration does not contract.
//
// The stage's accelerations A solve  A = N(Q, V),  Q = … + â τ² A,  V = … + a τ A. With
// B = â τ² ∂N/∂q + a τ ∂N/∂v  the iteration A ← N contracts while the eigenvalues of B are below 1:
// while dt resolves the fastest oscillation that joints and contacts under load have (transverse
// waves of a taut chain: B ≈ T τ² / (m l)). Beyond, Newton's method does what it does not:
//
//   A ← A + (I − B)⁻¹ (N − A)
//
// and the same for the derivatives Ȧ, whose equation is linear with the same B, and, transposed,
// for the adjoint's. B is dense, of 3 columns a moving body.

#include <Eigen/LU>
#include <cmath>

#include "tangible/dynamics/jacobian/equation_jacobian.h"
#include "tangible/simulation/events/event_record.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {

/// Iterations after which one that has not converged is left for Newton's method.
inline constexpr int kMostFixedPoints = 20;

/// Whether the derivative of an implicit stage has arrived: to rounding of its largest entry, or,
/// where all entries are rounding (of bodies at rest), when Newton's method changes it no less.
class FixedPoint {
 public:
  bool Arrived(double change, double size) {
    const bool falls = change < last_;
    last_ = change;
    ++iterations_;
    return change <= kStageDerivative * size ||
           (!falls && change <= kStageDerivativeRounding * size) ||
           (iterations_ > kMostFixedPoints && change <= kStageDerivativeLate * size) ||
           (iterations_ > kMostFixedPoints + 2 && !falls);
  }

 private:
  double last_ = HUGE_VAL;
  int iterations_ = 0;
};

class ImplicitStage {
 public:
  /// Takes B at the stage's node, which has been solved; a τ and â τ² as above.
  void Factor(const Model<double>& model, const Segment& segment, SolvedNode* node, double a_tau,
              double a_hat_tau2);
  /// x ← (I − B)⁻¹ x, 3 a moving body; or with the transposed matrix.
  void Solve(RowMatrixXd* x) const;
  void SolveTransposed(RowMatrixXd* x) const;

 private:
  LocalJacobianScratch scratch_;
  RowMatrixXd place_, solved_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
};

}  // namespace tangible
