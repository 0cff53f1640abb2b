// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The uncertainty of the parameters, to first order at the estimate.
//
//   C = (Jᵀ J)⁻¹,   standard deviation_k = sqrt(C_kk),   95 %: p_k ± 1.959964 sqrt(C_kk)
//
// J has the residuals in multiples of their sigma, which is absolute: C is not rescaled by the
// reduced chi-square 2 cost / (N − P). Residuals that Huber's loss takes linearly have no curvature
// and no part in C. A parameter at a bound is held there: it has no interval, and those of the
// others are conditional on its value.
//
// These intervals are valid if the model and sigma are right. Robust intervals are valid otherwise
// too: they follow from the actual residuals, with their size and their correlation in time or
// within a recording (robust_covariance.h), ± the quantile of Student's t. A test of the
// correlation of residuals (whiteness.h) warns of a model that does not fit, whatever sigma is.
//
// Parameters of single blocks are eliminated block by block (Schur complement): with O_b and S_b
// the columns of a block's own and of the shared parameters,
//
//   D_b = O_b⁺ S_b,   S̃_b = S_b − O_b D_b,   C_shared = (Σ S̃_bᵀ S̃_b)⁻¹
//   C_own = (O_bᵀ O_b)⁻¹ + D_b C_shared D_bᵀ
//
// J is decomposed as U S Vᵀ with columns scaled to unit length (decomposition.h). Singular values
// below `rank_tolerance` of the largest are directions that the observations do not determine:
// parameters with a share in them have no interval, and the message names the combination.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/estimation/problem/least_squares.h"
#include "tangible/estimation/uncertainty/combinations.h"
#include "tangible/estimation/uncertainty/residual_quality.h"
#include "tangible/estimation/uncertainty/robust_covariance.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible {

/// With more parameters, the covariances of own parameters of recordings are not kept.
inline constexpr int kMostCovariance = 300;

/// Whether leverages are computed, which takes time N P² and one number for each residual.
enum class Leverages { kSkip, kCompute };

struct UncertaintyOptions {
  double rank_tolerance = kJacobianRank;
  double condition_warning = 1e4;  ///< of J with unit columns
  double huber = 0.0;              ///< as FitOptions
  Leverages leverages = Leverages::kSkip;
};

using ConfidenceInterval = std::optional<std::pair<double, double>>;

struct Uncertainty : ResidualQuality {
  /// P x P, of more than kMostCovariance parameters of the shared ones alone; NaN rows and columns
  /// where there is none.
  RowMatrixXd covariance;
  Eigen::VectorXd standard_deviation;  ///< NaN: none
  std::vector<ConfidenceInterval> confidence_95;
  Eigen::VectorXd standard_deviation_robust;  ///< NaN: none
  Eigen::VectorXd degrees_of_freedom;         ///< of Student's t of the robust interval; NaN: none
  std::vector<ConfidenceInterval> confidence_95_robust;
  /// Of each shared parameter: the probability of such a drift over the recordings, or a larger
  /// one, if they can be exchanged (drift.h); NaN: not tested.
  Eigen::VectorXd drift_p_value;
  RobustMethod robust_method = RobustMethod::kNone;
  int num_recordings = 0;       ///< with observations, from which robust intervals are
  double bandwidth = 0.0;       ///< s, over which residuals count as correlated; 0: not at all
  Eigen::VectorXd prior_share;  ///< of a parameter's information, 0 to 1: what priors contribute
  /// The combinations that are determined of parameters that are not determined one by one.
  std::vector<DeterminedCombination> combinations;
  std::vector<std::string> messages;  ///< a parameter: why it has no interval; else empty
  double condition = 1.0;             ///< of J with unit columns, over the parameters that are free
  std::vector<std::string> warnings;  ///< of the whole
  bool contradicts_prior = false;     ///< the observations contradict a parameter's prior
  /// J_i C J_iᵀ of each observation row i, the part of it that the parameters fit. Empty unless
  /// requested.
  Eigen::VectorXd leverages;
};

/// `estimate` has all parameters of the problem, `blocks` their evaluations there, with Jacobians.
Uncertainty EstimateUncertainty(const LeastSquaresProblem& problem, const Eigen::VectorXd& estimate,
                                const std::vector<BlockEvaluation>& blocks,
                                const UncertaintyOptions& options);

/// One line that describes how the robust intervals were computed.
std::string DescribeRobust(const Uncertainty& uncertainty);

}  // namespace tangible
