// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Whether residuals depend on a quantity: their means in bins of it. With B bins of n_b residuals,
//
//   F = Σ_b n_b (m_b − m)² / (B − 1)  ÷  Σ_b Σ_i (r_bi − m_b)² / (n − B)
//
// which for independent normal residuals has Fisher's distribution (one-way analysis of variance).
// Residuals that are correlated in time make it too large: a small probability then says that
// there is something, and shows where, but not by what chance.
//
// Reference: R. A. Fisher, Statistical methods for research workers (1925), ch. 7.

#include <cmath>
#include <vector>

namespace tangible {

struct BinnedTest {
  std::vector<double> at;    ///< the mean of the quantity in each bin; empty: no test
  std::vector<double> mean;  ///< of the residuals
  double f = NAN;
  double share = NAN;    ///< of the sum of squares, that lies between the bins
  double p_value = NAN;  ///< of independent residuals
};

/// Bins of about as many residuals each, at most `bins` and with at least ten; equal values of x
/// are in one bin. No test where that leaves less than two. x and r have the same length.
BinnedTest TestBins(const std::vector<double>& x, const std::vector<double>& r, int bins);

}  // namespace tangible
