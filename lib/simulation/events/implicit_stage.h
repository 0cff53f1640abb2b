// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The implicit stage of an integrator whose fixed-point iteration does not contract.
//
// The stage's accelerations A solve  A = N(Q, V),  Q = … + â τ² A,  V = … + a τ A. With
// B = â τ² ∂N/∂q + a τ ∂N/∂v  the iteration A ← N contracts if the eigenvalues of B are below 1,
// that is, if dt resolves the fastest oscillation of joints and contacts under load (transverse
// waves of a taut chain: B ≈ T τ² / (m l)). Otherwise Newton's method converges:
//
//   A ← A + (I − B)⁻¹ (N − A)
//
// The same holds for the derivatives Ȧ, whose equation is linear with the same B, and, transposed,
// for those of the adjoint. B is dense, with 3 columns for each moving body. IterateStage is the
// common iteration for values, tangents, adjoints and Jets.

#include <functional>

#include "tangible/dynamics/jacobian/equation_jacobian.h"
#include "tangible/math/decompositions.h"
#include "tangible/simulation/events/event_record.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {

/// Number of fixed-point iterations after which Newton's method replaces an iteration that has not
/// converged.
inline constexpr int kMostFixedPoints = 20;

/// Maximum number of iterations of both together.
inline constexpr int kMostStageIterations = 60;

enum class StageOutcome { kSolved, kSingular, kNotConverged };

/// Solves x = N(x) by iteration and, where that does not contract or N fails, by Newton's method
/// from the start again. `evaluate(x, &next)`: next = N(x), false where it fails;
/// `arrived(next, x, iteration)`: whether next is the solution; `newton(next, iteration, &x)`: adds
/// (I − B)⁻¹ (next − x) to x.
template <typename X, typename Evaluate, typename Arrived, typename Newton>
StageOutcome IterateStage(const Evaluate& evaluate, const Arrived& arrived, const Newton& newton,
                          X* x) {
  const X start = *x;
  X next;
  for (int iteration = 0; iteration <= kMostStageIterations; ++iteration) {
    const bool contracts = iteration < kMostFixedPoints;
    if (iteration == kMostFixedPoints) {
      *x = start;
    }
    if (!evaluate(*x, &next)) {
      if (!contracts) {
        return StageOutcome::kSingular;
      }
      iteration = kMostFixedPoints - 1;  // it has diverged
    } else if (arrived(next, *x, iteration)) {
      x->swap(next);
      return StageOutcome::kSolved;
    } else if (contracts) {
      x->swap(next);
    } else {
      newton(next, iteration, x);
    }
  }
  return StageOutcome::kNotConverged;
}

class ImplicitStage {
 public:
  enum class Direction { kForward, kTransposed };

  /// The derivative part of N at a given point: next = N(x), 3 rows for each moving body.
  using Map = std::function<void(const RowMatrixXd& x, RowMatrixXd* next)>;

  /// Solves x = map(x) from a first guess. The equation is linear with B of the segment's last
  /// stage, or its transposed matrix, except for columns of values that are nearly solved. The
  /// iteration ends at rounding of the largest entry, or, where all entries are rounding (of bodies
  /// at rest), when changes by Newton's method no longer fall. Returns the remaining change as a
  /// fraction of the largest entry where it does not converge, else 0.
  double SolveDerivative(const Model<double>& model, Segment* segment, Direction direction,
                         const Map& map, RowMatrixXd* x);

  /// Computes B at the segment's last stage, which must have been solved.
  void Factor(const Model<double>& model, Segment* segment);
  /// x ← (I − B)⁻¹ x, 3 rows for each moving body; or with the transposed matrix.
  void Solve(Direction direction, RowMatrixXd* x) const;

 private:
  LocalJacobianScratch scratch_;
  RowMatrixXd place_, solved_;
  PartialLu lu_;
};

}  // namespace tangible
