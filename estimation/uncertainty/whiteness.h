// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Tests whether residuals are correlated in time, which shows that the model is incomplete whatever
// sigma is, because the test does not depend on the size of the residuals.
//
// For the residuals r_1, r_2, ... of one coordinate in the order of their times,
//
//   z_l = Σ r_t r_{t+l} / sqrt(Σ r_t² r_{t+l}²)           l = 1 ... 4, sums over all coordinates
//   Q = Σ_l z_l²                                          chi-square with 4 degrees of freedom
//
// if they are independent with zero means. Each sum is divided by its own standard deviation, so
// that, unlike in the test of Ljung and Box, variances may differ from row to row.
//
// References: G. M. Ljung and G. E. P. Box, Biometrika 65 (1978) 297; I. N. Lobato, J. C. Nankervis
// and N. E. Savin, International Economic Review 42 (2001) 187, for unequal variances.

#include <Eigen/Core>
#include <vector>

namespace tangible {

/// Where and when a residual was measured.
struct ResidualPlace {
  int recording = 0;
  int series = 0;      ///< its own number a coordinate of a body or point
  double time = 0.0;   ///< s
  double least = 0.0;  ///< in multiples of sigma: smaller residuals are rounding
};

struct Whiteness {
  double correlation = 0.0;  ///< of neighbours in time, over all coordinates; NaN: too few
  double p_value = 1.0;      ///< of Q, or more, if residuals were independent
};

/// The test needs 20 pairs of neighbours; residuals that are rounding are not tested.
Whiteness TestWhiteness(const Eigen::VectorXd& residuals, const std::vector<ResidualPlace>& places);

}  // namespace tangible
