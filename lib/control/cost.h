// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The cost of a plan: a sum of squares over the steps and at the end,
//
//   J = h Σ_k Σ_i ½ wᵢ rᵢ(x_k, u_k)² + Σ_j ½ wⱼ rⱼ(x_N)²
//
// with residuals r of states, controls, points of bodies. Its Gauss-Newton approximation leaves out
// r ∂²r, which is 0 except for angles that wrap and points.

#include <string>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

/// The cost of one step, or of the end, to second order. The Hessian is symmetric.
struct CostExpansion {
  double value = 0.0;
  VectorX<double> x, u;        ///< gradients
  MatrixX<double> xx, ux, uu;  ///< n x n, m x n, m x m
  void SetZero(int num_states, int num_controls);
};

struct CostTerm {
  enum class Kind {
    kState,    ///< r = x[index] − target
    kAngle,    ///< r = 2 sin((x[index] − target) / 2): whole turns do not count
    kPoint,    ///< r = (position of a point fixed in a body)[axis] − target
    kControl,  ///< r = u[index] − target
  };
  Kind kind = Kind::kState;
  /// Index of the state or control; for a point, of the body's x, which y and the angle follow.
  int index = 0;
  int axis = 0;                  ///< for a point: 0 x, 1 y
  Vector2<double> at{0.0, 0.0};  ///< for a point: in the body's frame, m
  double target = 0.0;           ///< in the unit of the compared quantity
  double weight = 1.0;           ///< >= 0
  bool at_end = false;           ///< only at the end; else in each step
};

/// The term's residual at a state and controls (of a term of the end: no controls).
double ResidualOf(const CostTerm& term, const VectorX<double>& x, const VectorX<double>& u);
/// The changes of what a term compares with its target along changes of the state, its columns;
/// of an angle that wraps those of the angle, which the residual does not show half a turn away.
/// A term of a control has none.
VectorX<double> ChangesOf(const CostTerm& term, const VectorX<double>& x,
                          const MatrixX<double>& changes);

class Cost {
 public:
  Cost(int num_states, int num_controls, double step_length, std::vector<CostTerm> terms);

  int num_states() const { return n_; }
  int num_controls() const { return m_; }
  const std::vector<CostTerm>& terms() const { return terms_; }

  /// The cost of one step.
  double Value(const VectorX<double>& x, const VectorX<double>& u) const;
  /// The cost of the end.
  double EndValue(const VectorX<double>& x) const;
  /// The cost of so many steps and the end where each residual is as large as its target, and at
  /// least 1: the scale of the cost's rounding.
  double ValueOfUnits(long steps) const;
  /// Whether an angle that wraps is half a turn from its target, where its cost is largest and has
  /// no gradient, at one of these states (a row each: of the steps, then the end).
  bool HasAngleAtMaximum(const RowMatrixXd& states) const;
  /// The same to second order; `exact` adds r ∂²r to the Gauss-Newton terms.
  void Expand(const VectorX<double>& x, const VectorX<double>& u, bool exact,
              CostExpansion* expansion) const;
  void ExpandEnd(const VectorX<double>& x, bool exact, CostExpansion* expansion) const;

 private:
  void Add(const CostTerm& term, double factor, const VectorX<double>& x, const VectorX<double>& u,
           bool exact, CostExpansion* expansion) const;

  int n_, m_;
  double h_;
  std::vector<CostTerm> terms_;
};

}  // namespace tangible
