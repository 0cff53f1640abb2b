// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/binned_test.h"

#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <numeric>

namespace tangible {
namespace {

// Of a bin: the mean of fewer says little.
constexpr size_t kLeastInBin = 10;

struct ResidualBin {
  double x = 0.0, sum = 0.0, square = 0.0;
  size_t count = 0;
};

std::vector<ResidualBin> BinsOf(const std::vector<double>& x, const std::vector<double>& r,
                                int bins) {
  std::vector<size_t> order(x.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&x](size_t a, size_t b) { return x[a] < x[b]; });
  const size_t wanted =
      std::max(kLeastInBin, (x.size() + static_cast<size_t>(bins) - 1) / static_cast<size_t>(bins));
  std::vector<ResidualBin> all;
  for (size_t k = 0; k < order.size(); ++k) {
    const bool is_new = k == 0 || x[order[k]] != x[order[k - 1]];
    const bool room = order.size() - k >= kLeastInBin;
    if (all.empty() || (is_new && room && all.back().count >= wanted)) all.emplace_back();
    ResidualBin& bin = all.back();
    bin.x += x[order[k]];
    bin.sum += r[order[k]];
    bin.square += r[order[k]] * r[order[k]];
    ++bin.count;
  }
  return all;
}

}  // namespace

BinnedTest TestBins(const std::vector<double>& x, const std::vector<double>& r, int bins) {
  BinnedTest test;
  const std::vector<ResidualBin> all = BinsOf(x, r, bins);
  if (all.size() < 2) return test;
  double sum = 0.0, between = 0.0, within = 0.0;
  for (const ResidualBin& bin : all) sum += bin.sum;
  const auto count = static_cast<double>(x.size());
  for (const ResidualBin& bin : all) {
    const auto in_bin = static_cast<double>(bin.count);
    const double mean = bin.sum / in_bin;
    test.at.push_back(bin.x / in_bin);
    test.mean.push_back(mean);
    between += in_bin * (mean - sum / count) * (mean - sum / count);
    within += std::max(0.0, bin.square - in_bin * mean * mean);
  }
  const double freedom = static_cast<double>(all.size()) - 1.0;
  const double rest = count - static_cast<double>(all.size());
  test.share = between + within > 0.0 ? between / (between + within) : 0.0;
  test.f = within > 0.0 ? between / freedom / (within / rest) : INFINITY;
  test.p_value =
      std::isfinite(test.f)
          ? boost::math::cdf(boost::math::complement(boost::math::fisher_f(freedom, rest), test.f))
          : 0.0;
  return test;
}

}  // namespace tangible
