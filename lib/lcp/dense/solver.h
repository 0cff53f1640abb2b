// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The portfolio tries its methods in turn: a few changes of modes starting from z = 0 (a step
// without impulses: where friction admits several solutions, as for a box between two walls, the
// one without squeezing is chosen); then interior point, then Lemke, each followed by the
// active-set polish; then a checked proof of infeasibility; then a few deterministic further
// attempts (proximal steps, other covering vectors, enumeration of small problems). The result
// names the method that solved the problem. Success is decided only by the scaled residual
// recomputed from the data (problem.h).

#include "tangible/lcp/dense/problem.h"
#include "tangible/lcp/dense/solver_choice.h"
#include "tangible/lcp/dense/tolerances.h"

namespace tangible {

struct LcpOptions {
  SolverChoice solver = SolverChoice::kAuto;
  double tolerance = kLcpTolerance;  ///< largest scaled residual of a solution
  int max_iterations = 100;          ///< of each interior-point run
  /// Whether proximal steps, other covering vectors and enumeration follow the first attempts. They
  /// cost a hundred times as much.
  bool further_attempts = true;
};

/// Solves the problem, or reports why not. Data of wrong shape or not finite are refused: status
/// kUnsolved with a message and empty vectors. Never returns NaN.
LcpSolution<double> SolveLcp(const MixedLcp<double>& problem, const LcpOptions& options = {});

/// Implicit: solves in double, then pushes the derivatives through the factorised equations at the
/// solution (derivative.h). Exact to rounding; at a kink one element of the generalised Jacobian.
template <typename T>
LcpSolution<T> SolveImplicit(const MixedLcp<T>& problem, const LcpOptions& options = {});

/// Unrolled: every operation of the interior-point solver in Jets; where that fails, the modes
/// found by the portfolio, solved in Jets. Independent of the formulas of derivative.h.
template <typename T>
LcpSolution<T> SolveUnrolled(const MixedLcp<T>& problem, const LcpOptions& options = {});

}  // namespace tangible
