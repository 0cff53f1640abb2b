// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Iterative linear-quadratic regulation: finds the controls, each within its bounds, that minimise
// a cost over a horizon for a system whose steps have exact Jacobians A_k, B_k.
//
//   backward  Q_x  = ℓ_x + Aᵀ V_x',          Q_u  = ℓ_u + Bᵀ V_x'
//             Q_xx = ℓ_xx + Aᵀ V_xx' A,      Q_ux = ℓ_ux + Bᵀ (V_xx' + μ I) A
//             Q_uu = ℓ_uu + Bᵀ (V_xx' + μ I) B
//             k    = argmin ½ δuᵀ Q_uu δu + Q_uᵀ δu within the bounds   (box_quadratic.h)
//             K    = −Q_uu⁻¹ Q_ux over the free controls, 0 over those at a bound
//   forward   u_k ← clamp(u_k + α k_k + K_k (x_k − x̄_k)), rolled out by the system itself; x̄_k
//             across impacts: reference_extension.h
//
// (Li, Todorov 2004; Tassa, Mansard, Todorov 2014). With second order Σ λᵢ ∂²fᵢ is added to Q, λ
// the costate, by central differences of A and B: differential dynamic programming, which converges
// quadratically where the cost's curvature does not vanish. With secants that sum, and what the
// Gauss-Newton approximation of the cost leaves out, is instead learnt from the plans before, by a
// symmetric change of rank one in each step after an iteration from (x, u) to (x', u'):
//
//   s = (x', u') − (x, u),  y = (ℓ_x' + A'ᵀ λ', ℓ_u' + B'ᵀ λ') − (ℓ_x + Aᵀ λ', ℓ_u + Bᵀ λ') − L s
//   H ← H + r rᵀ / (rᵀ s),  r = y − H s           L the Gauss-Newton Hessian of ℓ
//
// (Nocedal, Wright, "Numerical Optimization", 2nd edition, equation 6.24, in the parts of a
// partially separable function, section 7.4). It takes no further linearisation. It begins with a
// step α >= kSecantShare and ends with a smaller one; where a step's Q_uu is not positive definite
// with H, H = 0 there, and where the line search fails with H it is repeated without. A line search
// begins two fractions above the last that was accepted.
//
// The shift μ grows while a backward pass is not convex or its step does not decrease the cost, and
// falls otherwise. In steps where a control neither moves nor costs anything it stays as it was.
// Convergence is judged by the gradient of the Lagrangian, λ_k = ℓ_x + Aᵀ λ_{k+1},
// ∂J/∂u_k = ℓ_u + Bᵀ λ_{k+1}, and not by the change of the cost.

#include <functional>
#include <string>
#include <vector>

#include "tangible/control/cost.h"
#include "tangible/control/sampled_surrogate.h"
#include "tangible/control/step_map.h"
#include "tangible/control/tolerances.h"

namespace tangible {

struct ControlProblem {
  StepMap* map = nullptr;
  const Cost* cost = nullptr;
  VectorX<double> initial;    ///< state at the start
  VectorX<double> low, high;  ///< of each control; infinite where there is no bound
  long first_step = 0;        ///< the system's step that is the plan's step 0
};

struct IlqrIteration {
  double cost = 0.0;      ///< before the step
  double gradient = 0.0;  ///< the fraction that is compared with gradient_tolerance
  double shift = 0.0;     ///< μ over the largest entry of V
  double step = 0.0;      ///< α; 0: no step decreased the cost
};

/// Called after each iteration, with the start that it belongs to (0, or that of a search) and its
/// number in the plan of that start; of a search by several threads at once.
using IlqrProgress = std::function<void(int start, long number, const IlqrIteration& iteration)>;

struct IlqrOptions {
  int max_iterations = 200;  ///< >= 1
  /// The plan has converged when moving every control of every step by its range (ControlSizes of
  /// sampled_surrogate.h; without bounds at least the way to the least cost along the gradient)
  /// against the gradient would change the cost, to first order, by at most this fraction of it.
  double gradient_tolerance = kGradientTolerance;
  bool second_order = false;
  /// Curvature from secants; without effect with second_order, which is exact.
  bool secants = false;
  /// Where a run has an impact earlier or later than the plan, the feedback is relative to the
  /// plan's motion extended across the impact (reference_extension.h), and not to states on its
  /// other side.
  bool reference_extension = false;
  /// Where it has samples, at most the first half of max_iterations uses means of Jacobians over
  /// samples in the place of exact ones; exact ones go on from there. With either a step counts
  /// only where it decreases the cost of the real motion.
  SampledSurrogate surrogate{};
  /// Called after each iteration; true ends the work with the best plan so far.
  std::function<bool()> stop{};
  IlqrProgress progress{};
};

/// Controls and the motion that they cause. States are (steps + 1) x n, controls steps x m; the
/// gains K_k, m x n for each step, are those of the last backward pass.
struct Plan {
  RowMatrixXd states, controls;
  std::vector<MatrixX<double>> gains;
  double cost = 0.0;
  /// The impacts of each step, as StepMap reports them; empty without reference_extension.
  std::vector<std::vector<int>> impacts{};
};

enum class IlqrStatus {
  kConverged,
  kIterationLimit,
  kNoDescent,  ///< no step decreases the cost, whatever the shift
  kStopped,
  kFailed,  ///< the system cannot be stepped with the initial controls
};
/// "converged", "iteration_limit", "no_descent", "stopped", "failed".
const char* NameOf(IlqrStatus status);

struct IlqrResult {
  IlqrStatus status = IlqrStatus::kIterationLimit;
  std::string message;  ///< one line, where it did not converge or did at a maximum
  /// The initial controls had no gradient because an angle that wraps was half a turn from its
  /// target, where its cost is largest: they were offset by kStartOffset of their ranges.
  bool left_maximum = false;
  Plan plan;
  double gradient = 0.0;
  std::vector<IlqrIteration> iterations;
  long surrogate_iterations = 0;  ///< the first ones, with sampled Jacobians
  long rollouts = 0;
  long linearisations = 0;  ///< of whole plans
};

/// Empty, or one line: sizes that differ, a bound below another, no steps, controls out of range or
/// not finite.
std::string CheckProblem(const ControlProblem& problem, const RowMatrixXd& controls);

/// Hands on what a solve says as that of another start, after so many iterations; empty of an empty
/// one.
IlqrProgress ProgressAfter(const IlqrProgress& progress, int start, long done);

/// Solves the problem from initial controls (steps x m), which are clamped to the bounds.
IlqrResult SolveIlqr(const ControlProblem& problem, const RowMatrixXd& controls,
                     const IlqrOptions& options);

/// Costates λ_0 … λ_N (N + 1 rows) of a plan and ∂J/∂u (N rows, returned): exact, from the steps'
/// Jacobians.
RowMatrixXd CostGradient(const ControlProblem& problem, const Plan& plan, RowMatrixXd* costates,
                         std::string* error);

}  // namespace tangible
