// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How well the observations determine the parameters, to first order at the estimate.
//
//   C = (Jᵀ J)⁻¹,   standard deviation_k = sqrt(C_kk),   95 %: p_k ± 1.959964 sqrt(C_kk)
//
// J has the residuals in multiples of their sigma, which is absolute: C is not rescaled by the
// reduced chi-square 2 cost / (N − P). Residuals that Huber's loss takes linearly have no curvature
// and no part in C. A parameter at a bound is held there: it has no interval, and the others' are
// given that it stays.
//
// These hold where the model is right and sigma too. Beside them stands what holds where they are
// not: the same from the residuals as they are, whatever their size and however they are correlated
// in time or within a recording (robust_covariance.h), ± the quantile of Student's t. A test of the
// residuals' correlation (whiteness.h) warns of a model that does not fit however large sigma is.
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

/// Of more parameters the covariances of those of single recordings are not kept.
inline constexpr int kMostCovariance = 300;

/// Whether leverages are computed: time N P² and a number a residual.
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
  RobustMethod robust_method = RobustMethod::kNone;
  double bandwidth = 0.0;       ///< s, over which residuals count as correlated; 0: not at all
  Eigen::VectorXd prior_share;  ///< of a parameter's information, 0 to 1: what priors contribute
  /// What is determined of parameters that are not determined one by one.
  std::vector<DeterminedCombination> combinations;
  std::vector<std::string> messages;  ///< a parameter: why it has no interval; else empty
  double condition = 1.0;             ///< of J with unit columns, over the parameters that are free
  std::vector<std::string> warnings;  ///< of the whole
  /// J_i C J_iᵀ of each observation row i: what part of it the parameters take. Empty unless it was
  /// asked for.
  Eigen::VectorXd leverages;
};

/// `estimate` of all parameters of the problem, and its blocks there, with Jacobians.
Uncertainty EstimateUncertainty(const LeastSquaresProblem& problem, const Eigen::VectorXd& estimate,
                                const std::vector<BlockEvaluation>& blocks,
                                const UncertaintyOptions& options);

/// One line about how the robust intervals were found.
std::string DescribeRobust(const Uncertainty& uncertainty);

}  // namespace tangible
