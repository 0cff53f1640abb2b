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
// J is decomposed as U S Vᵀ with columns scaled to unit length. Singular values below
// `rank_tolerance` of the largest are directions that the observations do not determine: parameters
// with a share in them have no interval, and the message names the combination.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/estimation/problem/parameterized_scene.h"
#include "tangible/math/scalar.h"

namespace tangible {

struct UncertaintyOptions {
  double rank_tolerance = 1e-9;
  double condition_warning = 1e4;  ///< of J with unit columns
  double huber = 0.0;              ///< as FitOptions
};

struct Uncertainty {
  RowMatrixXd covariance;              ///< P x P; NaN rows and columns where there is none
  Eigen::VectorXd standard_deviation;  ///< NaN: none
  std::vector<std::optional<std::pair<double, double>>> confidence_95;
  std::vector<std::string> messages;  ///< a parameter: why it has no interval; else empty
  double condition = 1.0;             ///< of J with unit columns, over the parameters that are free
  double residual_rms = 0.0;          ///< in multiples of sigma
  double reduced_chi_square = 0.0;  ///< Σ r² / (N − free parameters); NaN where N is not larger
  std::vector<std::string> warnings;  ///< of the whole
};

/// `entries` and `estimate` of the parameters, residuals r (N) and J (N x P) there.
Uncertainty EstimateUncertainty(const std::vector<ParameterizedScene::Entry>& entries,
                                const Eigen::VectorXd& estimate, const Eigen::VectorXd& residuals,
                                const RowMatrixXd& jacobian, const UncertaintyOptions& options);

/// Whether an estimate lies on a bound.
bool IsAtBound(const ParameterizedScene::Entry& entry, double estimate);

}  // namespace tangible
