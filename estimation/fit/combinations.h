// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Where observations do not determine parameters one by one: what they do determine.
//
// Let the columns of N be the directions, in relative changes d ln p of n parameters, along which
// no residual changes (or hardly any). A combination with weights e is determined if eᵀ N = 0. The
// combinations proposed are a basis of those e, brought to reduced row echelon form: each has a
// parameter of its own and as few others as that allows. A combination reads
//
//   Σ e_k d ln p_k:    locally the product Π p_k^e_k, for parameters that are positive,
//                      and the sum Σ (e_k / p_k) p_k, with weights taken at the estimate
//
// both of which have the same derivative. m a² + I of a pendulum, say, has the weights (m a², 2 m
// a², I) and stands as the sum m + 2 (m / a) a + I / a² in numbers; m1 m2 with nothing else stands
// as the product.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tangible/estimation/fit/decomposition.h"
#include "tangible/estimation/problem/parameterized_scene.h"

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

/// The direction's parts in relative changes of the parameters `free`.
Eigen::VectorXd RelativeChanges(const std::vector<ParameterizedScene::Entry>& entries,
                                const Eigen::VectorXd& estimate, const std::vector<int>& free,
                                Eigen::VectorXd direction);

/// Combinations of the parameters with a share in the directions of `decomposition` whose singular
/// values are not above `least` of the largest. `covariance` and `robust` are over `free`, and need
/// only be right along determined directions; empty where every parameter is determined.
std::vector<DeterminedCombination> FindDeterminedCombinations(
    const std::vector<ParameterizedScene::Entry>& entries, const Eigen::VectorXd& estimate,
    const std::vector<int>& free, const Decomposition& decomposition, double least,
    const Eigen::MatrixXd& covariance, const RowMatrixXd& robust);

/// Parameters with a smaller share of a direction than this have none.
inline constexpr double kSmallShare = 1e-4;

}  // namespace tangible
