// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How well chains of draws agree, and how many independent draws they are worth.
//
//   R-hat = sqrt(var⁺ / W),    var⁺ = (n − 1) / n W + B / n
//   ESS = m n / τ,             τ = −1 + 2 Σ_k (ρ_2k + ρ_2k+1)
//
// over the m halves of the chains, of n draws each: W is the mean of their variances, B / n the
// variance of their means, ρ_t the correlation at lag t, summed while pairs are positive and made
// monotone (Geyer's initial sequence). Both are computed of normal scores of the ranks, so that
// they exist without moments: R-hat is the larger one of draws and of their distances from the
// median, the bulk's ESS that of the draws, the tail's the smaller one of the indicators of the
// quantiles of 5 and 95 %.
//
// References: A. Vehtari, A. Gelman, D. Simpson, B. Carpenter, P.-C. Bürkner, Bayesian Analysis 16
// (2021) 667; C. J. Geyer, Statistical Science 7 (1992) 473.

#include <Eigen/Core>
#include <cmath>

namespace tangible {

struct ChainStatistics {
  double mean = NAN;
  double deviation = NAN;
  double low = NAN, median = NAN, high = NAN;  ///< quantiles of 2.5, 50 and 97.5 %
  double r_hat = NAN;                          ///< NaN: draws are equal or too few
  double ess_bulk = NAN, ess_tail = NAN;
};

/// The statistics of one quantity: a row each draw, a column each chain.
ChainStatistics DescribeChains(const Eigen::MatrixXd& draws);

/// The quantile of `share` of numbers, linear between neighbours.
double QuantileOf(Eigen::VectorXd numbers, double share);

}  // namespace tangible
