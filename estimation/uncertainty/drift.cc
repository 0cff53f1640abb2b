// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/drift.h"

#include <algorithm>
#include <boost/math/special_functions/bessel.hpp>
#include <cmath>
#include <numbers>

#include "tangible/math/scalar.h"

namespace tangible {

double ProbabilityOfBridge(double x) {
  // Below, 1 − P is less than the rounding of 1, and above, P.
  if (!(x > 0.01)) return 1.0;
  if (x > 20.0) return 0.0;
  constexpr int kTerms = 100;
  double sum = 0.0;
  double weight = 1.0;  // Γ(j + 1/2) / (Γ(1/2) j!)
  for (int j = 0; j < kTerms; ++j) {
    const double odd = 4.0 * j + 1.0;
    const double z = odd * odd / (16.0 * x);
    const double term = weight * std::sqrt(odd) * std::exp(-z) * boost::math::cyl_bessel_k(0.25, z);
    if (sum + term == sum) break;
    sum += term;
    weight *= (j + 0.5) / (j + 1.0);
  }
  return std::clamp(1.0 - sum / (std::numbers::pi * std::sqrt(x)), 0.0, 1.0);
}

double DriftProbability(const Eigen::VectorXd& moved) {
  const Eigen::Index count = moved.size();
  if (count < kFewestOfDrift) return kNaN;
  const double mean = moved.mean();
  const double square = (moved.array() - mean).square().sum();
  if (!(square > 0.0) || !std::isfinite(square)) return kNaN;
  double sum = 0.0;
  double squares = 0.0;
  for (Eigen::Index t = 0; t < count; ++t) {
    sum += moved[t] - mean;
    squares += sum * sum;
  }
  return ProbabilityOfBridge(squares / (static_cast<double>(count) * square));
}

}  // namespace tangible
