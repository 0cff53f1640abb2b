// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/whiteness.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

namespace tangible {
namespace {

constexpr int kLags = 4;
constexpr int kFewestPairs = 20;

/// Sums over the pairs of one lag.
struct LagSums {
  double product = 0.0;         // Σ r_t r_{t+l}
  double square_product = 0.0;  // Σ r_t² r_{t+l}²
  double square = 0.0;          // Σ (r_t² + r_{t+l}²) / 2
  int pairs = 0;
};

}  // namespace

Whiteness TestWhiteness(const Eigen::VectorXd& residuals,
                        const std::vector<ResidualPlace>& places) {
  std::vector<int> order;
  double sum = 0.0;
  double rounding = 0.0;
  for (size_t i = 0; i < places.size(); ++i) {
    order.push_back(static_cast<int>(i));
    const double r = residuals[static_cast<Eigen::Index>(i)];
    sum += r * r;
    rounding += places[i].least * places[i].least;
  }
  Whiteness result;
  result.correlation = std::numeric_limits<double>::quiet_NaN();
  if (!(sum > rounding)) {
    return result;
  }
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return std::tie(places[a].recording, places[a].series, places[a].time) <
           std::tie(places[b].recording, places[b].series, places[b].time);
  });
  LagSums lags[kLags];
  for (size_t t = 0; t < order.size(); ++t) {
    for (int l = 0; l < kLags && t + l + 1 < order.size(); ++l) {
      const ResidualPlace& here = places[order[t]];
      const ResidualPlace& there = places[order[t + l + 1]];
      if (here.recording != there.recording || here.series != there.series) {
        break;
      }
      const double a = residuals[order[t]];
      const double b = residuals[order[t + l + 1]];
      lags[l].product += a * b;
      lags[l].square_product += a * a * b * b;
      lags[l].square += 0.5 * (a * a + b * b);
      ++lags[l].pairs;
    }
  }
  if (lags[0].pairs < kFewestPairs) {
    return result;
  }
  double q = 0.0;
  int used = 0;
  for (const LagSums& lag : lags) {
    if (lag.pairs >= kFewestPairs && lag.square_product > 0.0) {
      q += lag.product * lag.product / lag.square_product;
      ++used;
    }
  }
  if (used == 0 || !std::isfinite(q)) {
    return result;
  }
  result.correlation = lags[0].product / lags[0].square;
  result.p_value = boost::math::cdf(
      boost::math::complement(boost::math::chi_squared(static_cast<double>(used)), q));
  return result;
}

}  // namespace tangible
