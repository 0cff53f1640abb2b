// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The combinations that observations determine where they do not determine parameters one by one.
//
// Let the columns of N be the directions, in relative changes d ln p of n parameters, along which
// no residual changes (or hardly any). A combination with weights e is determined if eᵀ N = 0. The
// combinations are a basis of those e in reduced row echelon form: each has a parameter that the
// others do not have, and few further ones. A combination is
//
//   Σ e_k d ln p_k:    locally the product Π p_k^e_k, for parameters that are positive,
//                      and the sum Σ (e_k / p_k) p_k, with weights taken at the estimate
//
// both of which have the same derivative. For example, m a² + I of a pendulum has the weights (m
// a², 2 m a², I) and is written as the sum m + 2 (m / a) a + I / a², with the values of these
// coefficients; m1 m2 is written as the product.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tangible/estimation/problem/parameter_entry.h"
#include "tangible/math/scalar.h"

namespace tangible {

struct DeterminedCombination {
  std::vector<int> parameters;       ///< indices into the entries
  std::vector<double> exponents;     ///< e, the first is 1
  std::vector<double> coefficients;  ///< of the sum, the first is 1
  std::string product;               ///< "'a' * 'b'^2"; empty where one is not positive
  std::string sum;                   ///< "'a' + 0.5 'b'"
  double value = 0.0;                ///< of the sum
  double standard_deviation = 0.0;
  double standard_deviation_robust = 0.0;  ///< NaN: none
};

/// Combinations of the parameters with a share in the columns of `none` (parameters x directions),
/// which are relative changes that the observations do not determine. `covariance` and `robust`
/// (parameters x parameters) only have to be right along determined directions.
std::vector<DeterminedCombination> FindDeterminedCombinations(
    const std::vector<ParameterEntry>& entries, const Eigen::VectorXd& estimate,
    const Eigen::MatrixXd& none, const RowMatrixXd& covariance, const RowMatrixXd& robust);

}  // namespace tangible
