// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Newton's method for the nearest poses on the joints, joint_projection.h: of
//
//   M (q⁺ − q̃) = A(q⁺)ᵀ μ,   C(q⁺) = 0,   A = ∂C/∂q                                       (1)
//
// by the exact matrix
//
//   K = [W −Aᵀ; A 0],   W = M − Σ μ ∇²C                                                    (2)
//
// A step that does not lower the merit ½|q − q̃|²_M + ν |C|₁ is replaced by one with W = M, halved
// until it does. W may be indefinite where the drift is of the order of a link's inertia over its
// arm; a nearly singular block of a body is shifted before the factorisation, which slows
// convergence, but does not reduce accuracy.

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tangible/dynamics/elements/joint_curvature.h"
#include "tangible/lcp/system/block_lu.h"

namespace tangible {

/// The iteration's variables, for T = double kept from call to call.
template <typename T>
struct ProjectionIterate {
  State<T> from, at, trial;    ///< q̃, q, and q + a step
  std::vector<T> multipliers;  ///< μ, three for each joint
  std::vector<JointRows<T>> rows, trial_rows;
  std::vector<JointCurvature<T>> curvature;         ///< of each joint, of couplings of share 0
  std::vector<JointCurvature<T>> second_curvature;  ///< of couplings of share 1
  std::vector<std::pair<int, int>> edges;
  BlockLu<T> lu;
  std::vector<T> rhs;
  bool shifted = false;  ///< the factorised matrix is not K itself
  double error = 0.0;    ///< largest |C| at q
  int damped_steps = 0;  ///< with W = M, because Newton's step did not lower the merit
};

/// Newton from `at`, which equals `from` on entry; then `extra` more steps, for the derivatives of
/// Jets. False where it does not converge to the scene's joint_tolerance (and rounding) within 60
/// steps; `at` is the last iterate in any case.
template <typename T>
bool IterateProjection(const Model<T>& model, int extra, ProjectionIterate<T>* iterate);

/// The same, continued from `at` and the multipliers of an earlier iteration, with at most `most`
/// steps.
template <typename T>
bool ResumeProjection(const Model<T>& model, int most, int extra, ProjectionIterate<T>* iterate);

/// The matrix used as W in (2): W itself; M; or W without the coupling of bodies, with M where the
/// block of a body is not positive definite.
enum class ProjectionWeight { kExact, kMass, kConvex };

/// Factorises (2) at the iterate, or where `shifted` becomes true a matrix near it; false where it
/// is singular.
bool FactorProjection(const Model<double>& model, ProjectionIterate<double>* iterate,
                      ProjectionWeight weight = ProjectionWeight::kExact);

/// Sets rows and error of the iterate's poses.
void EvaluateProjection(const Model<double>& model, ProjectionIterate<double>* iterate);

/// To be called after that: whether every joint's error is within `tolerance` (m or rad) plus the
/// rounding of its coordinates, which matters far from the origin.
bool JointsHold(const Model<double>& model, const ProjectionIterate<double>& iterate,
                double tolerance);

/// To be called after both of these: rhs becomes the step of poses (three for each moving body) and
/// multipliers; returns its size in radii of gyration.
double SolveProjectionStep(const Model<double>& model, ProjectionIterate<double>* iterate);

/// y −= K x, row-major with `columns` columns, after FactorProjection.
void SubtractProjectionMatrix(const Model<double>& model, const ProjectionIterate<double>& iterate,
                              const double* x, int columns, double* y);

template <typename T>
const JointCurvature<T>& CurvatureOf(const ProjectionIterate<T>& iterate, size_t joint, int k) {
  return k == 0 ? iterate.curvature[joint] : iterate.second_curvature[joint];
}

/// Largest |C| of a joint's rows; infinite where one is not a number.
template <typename T>
double LargestError(const JointRows<T>& row) {
  double largest = 0.0;
  for (int k = 0; k < row.rows; ++k) {
    const double error = std::abs(ValueOf(row.error[k]));
    largest = std::isnan(error) ? HUGE_VAL : std::max(largest, error);
  }
  return largest;
}

}  // namespace tangible
