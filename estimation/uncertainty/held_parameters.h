// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Held parameters: values of the scene that are not estimated and that the observations contradict,
// for example a damping of 0 that drives an estimated mass to its bound.
//
// At the estimate let J have the columns of the free parameters, and let u = ∂r/∂θ be the column of
// a held parameter θ. The multiplier of the constraint that holds θ is uᵀ r. If θ were released,
// then to first order
//
//   ũ = u − J J⁺ u                       what the free parameters cannot do           (1)
//   Δθ = −ũᵀ r / ũᵀ ũ                    its change
//   ½ (ũᵀ r)² / ũᵀ ũ                     what the cost would fall by                  (2)
//   g_b' = J_bᵀ (r + ũ Δθ)               the slope of the cost in a parameter b at its bound
//
// (2) is Rao's score statistic, here as a share of the cost. Where the slope g_b' no longer points
// out of the range, θ is what has driven b there.
//
// References: C. R. Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50; S. D. Silvey, Annals of
// Mathematical Statistics 30 (1959) 389 (the Lagrange multiplier test).

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tangible/estimation/problem/least_squares.h"

namespace tangible {

enum class HeldTest { kRun, kSkip };

struct HeldParameter {
  std::string path;
  double value = 0.0;                 ///< at which it is held
  double change = 0.0;                ///< Δθ
  double cost_share = 0.0;            ///< (2) over the cost, 0 to 1
  std::vector<std::string> releases;  ///< parameters that would leave their bounds
  /// Whether it was fitted with the others (held_refit.h); `releases` are then those that did.
  bool refitted = false;
  double refitted_value = 0.0;
  double refitted_share = 0.0;  ///< of the cost, by which it fell
};

struct HeldOptions {
  GradientMethod derivatives = GradientMethod::kTangent;
  double least_share = 0.1;       ///< of the cost, for a number that releases no parameter
  double least_deviations = 5.0;  ///< ũᵀ r over that of independent residuals of their own size
  int most = 5;                   ///< numbers that are reported
  int most_candidates = 400;
};

/// Tests all values of the problem's scenes that no parameter sets, with one run of each block that
/// has a column for each; the same value of several blocks' scenes counts as one. Own parameters of
/// a block are eliminated from its rows first. Those that release parameters from bounds come
/// first, then the order is by cost_share. Values that may not change that way (a friction of 0
/// that would become negative) are left out. The result is empty where a run fails or there are
/// more than `most_candidates` values.
std::vector<HeldParameter> FindHeldParameters(const Eigen::VectorXd& estimate,
                                              const HeldOptions& options,
                                              LeastSquaresProblem* problem);

/// The message "the observations contradict 'joints/pin/damping', which is held at 0: ...".
std::string Describe(const HeldParameter& held);

}  // namespace tangible
