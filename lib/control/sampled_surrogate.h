// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A surrogate of the steps' Jacobians, for plans that do not make a contact yet: where the hammer
// misses the ball, what it does has no effect on the ball, and the exact gradient is zero. Means
// over motions around the plan's know of contacts that nearly happen (randomised smoothing: Suh,
// Pang, Tedrake, "Bundled gradients through contact via randomized smoothing", arXiv 2109.05143):
//
//   A_k ≈ 1/S Σ_s ∂f/∂x(x_k^s, u_k^s),   B_k ≈ 1/S Σ_s ∂f/∂u(x_k^s, u_k^s)
//
// There the samples (x^s, u^s) are normal around (x_k, u_k). Here they are motions of the system
// under the plan's controls with an offset each, so that joints stay closed and nothing penetrates:
//
//   u_k^s = clamp(ū_k + d r ε^s),   ε^s normal, in pairs of opposite sign, the same for all k
//
// with the deviation d as a share of each control's range r. The means are not the derivative of
// the motion: results say where they were used, and end with exact Jacobians.

#include <string>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

struct ControlProblem;
struct Plan;

struct SampledSurrogate {
  int samples = 0;         ///< even; 0: exact Jacobians alone
  double deviation = 0.1;  ///< > 0
  unsigned seed = 0;
};

/// What a control's changes are shares of: high − low, or without bounds the largest |u| of the
/// plan, at least 1.
VectorX<double> ControlSizes(const ControlProblem& problem, const RowMatrixXd& controls);

/// Empty, or one line: a control without bounds has no range of which the deviation is a share.
std::string CheckSurrogate(const ControlProblem& problem);

/// Replaces the exact A_k and B_k of the plan's steps by means over the samples. A sample whose
/// step cannot be made counts up to there; steps that no sample reaches keep theirs.
void AverageJacobians(const ControlProblem& problem, const Plan& plan,
                      const SampledSurrogate& options, std::vector<MatrixX<double>>* a,
                      std::vector<MatrixX<double>>* b);

}  // namespace tangible
