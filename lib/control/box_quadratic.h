// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A convex quadratic over a box, by projected Newton steps (Tassa, Mansard, Todorov,
// "Control-limited differential dynamic programming", ICRA 2014, algorithm 1; Bertsekas 1982):
//
//   min ½ xᵀ H x + gᵀ x,   low <= x <= high
//
// A step is a Newton step in the free variables (those not at a bound); its line search follows the
// projection onto the box. From a good start the set of variables at bounds is found in a few
// steps.

#include <vector>

#include "tangible/math/decompositions.h"
#include "tangible/math/scalar.h"

namespace tangible {

enum class BoxQuadraticStatus { kSolved, kIndefinite, kIterationLimit };

struct BoxQuadraticSolution {
  /// kIndefinite: H is not positive definite in the variables that are free.
  BoxQuadraticStatus status = BoxQuadraticStatus::kIterationLimit;
  VectorX<double> x;
  std::vector<int> free;  ///< variables not at a bound, ascending
  Cholesky factor{};      ///< of H over them
  int iterations = 0;
};

/// H symmetric, m x m; low <= high, either of them infinite where there is no bound; `start` need
/// not be within them.
BoxQuadraticSolution SolveBoxQuadratic(const MatrixX<double>& h, const VectorX<double>& g,
                                       const VectorX<double>& low, const VectorX<double>& high,
                                       const VectorX<double>& start);

}  // namespace tangible
