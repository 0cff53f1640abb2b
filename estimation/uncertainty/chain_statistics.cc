// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/chain_statistics.h"

#include <algorithm>
#include <boost/math/special_functions/erf.hpp>
#include <limits>
#include <numeric>
#include <vector>

namespace tangible {
namespace {

constexpr Eigen::Index kLeastDraws = 4;  // of half a chain

/// The halves of chains, as columns; of an odd number of draws without the middle one.
Eigen::MatrixXd Halves(const Eigen::MatrixXd& draws) {
  const Eigen::Index n = draws.rows() / 2;
  Eigen::MatrixXd halves(n, 2 * draws.cols());
  halves << draws.topRows(n), draws.bottomRows(n);
  return halves;
}

/// Normal scores of the ranks of all draws, equal ones at the mean of their ranks.
Eigen::MatrixXd NormalScores(const Eigen::MatrixXd& draws) {
  const Eigen::Index count = draws.size();
  std::vector<Eigen::Index> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  const double* const values = draws.data();
  std::sort(order.begin(), order.end(), [values](Eigen::Index a, Eigen::Index b) {
    return values[a] < values[b] || (values[a] == values[b] && a < b);
  });
  Eigen::MatrixXd scores(draws.rows(), draws.cols());
  for (size_t i = 0; i < order.size();) {
    size_t end = i;
    while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
    const double rank = 0.5 * static_cast<double>(i + end + 1);
    const double share = (rank - 0.375) / (static_cast<double>(count) + 0.25);
    const double score = std::sqrt(2.0) * boost::math::erf_inv(2.0 * share - 1.0);
    for (; i < end; ++i) scores.data()[order[i]] = score;
  }
  return scores;
}

double VarianceOf(const Eigen::VectorXd& numbers) {
  return (numbers.array() - numbers.mean()).square().sum() /
         static_cast<double>(numbers.size() - 1);
}

double RHatOf(const Eigen::MatrixXd& halves) {
  const double n = static_cast<double>(halves.rows());
  double within = 0.0;
  for (Eigen::Index j = 0; j < halves.cols(); ++j) within += VarianceOf(halves.col(j));
  within /= static_cast<double>(halves.cols());
  const double between = VarianceOf(halves.colwise().mean());  // B / n
  return std::sqrt((n - 1.0) / n + between / within);
}

double EffectiveOf(const Eigen::MatrixXd& halves) {
  const Eigen::Index n = halves.rows();
  const double count = static_cast<double>(n);
  const Eigen::MatrixXd centred = halves.rowwise() - halves.colwise().mean().eval();
  // The mean over halves of the covariance at a lag.
  const auto covariance = [&](Eigen::Index lag) {
    return centred.topRows(n - lag).cwiseProduct(centred.bottomRows(n - lag)).sum() /
           (count * static_cast<double>(halves.cols()));
  };
  const double within = covariance(0) * count / (count - 1.0);
  const double all = within * (count - 1.0) / count + VarianceOf(halves.colwise().mean());
  if (!(within > 0.0) || !(all > 0.0)) return NAN;
  const auto correlation = [&](Eigen::Index lag) {
    return lag == 0 ? 1.0 : 1.0 - (within - covariance(lag)) / all;
  };
  double tau = -1.0;
  double before = std::numeric_limits<double>::infinity();
  for (Eigen::Index lag = 0; lag + 1 < n; lag += 2) {
    const double pair = std::min(before, correlation(lag) + correlation(lag + 1));
    if (!(pair > 0.0)) break;
    tau += 2.0 * pair;
    before = pair;
  }
  const double total = count * static_cast<double>(halves.cols());
  // Draws that alternate are worth more than independent ones, within a limit (Vehtari et al.).
  return total / std::max(tau, 1.0 / std::log10(total));
}

}  // namespace

double QuantileOf(Eigen::VectorXd numbers, double share) {
  if (numbers.size() == 0) return NAN;
  std::sort(numbers.begin(), numbers.end());
  const double place = share * static_cast<double>(numbers.size() - 1);
  const auto below = static_cast<Eigen::Index>(place);
  const Eigen::Index above = std::min(below + 1, numbers.size() - 1);
  // Equal neighbours, also infinite ones, are not subtracted from each other.
  if (numbers[below] == numbers[above]) return numbers[below];
  return numbers[below] + (place - static_cast<double>(below)) * (numbers[above] - numbers[below]);
}

ChainStatistics DescribeChains(const Eigen::MatrixXd& draws) {
  ChainStatistics statistics;
  if (draws.size() == 0) return statistics;
  const Eigen::VectorXd all = draws.reshaped();
  statistics.mean = all.mean();
  statistics.low = QuantileOf(all, 0.025);
  statistics.median = QuantileOf(all, 0.5);
  statistics.high = QuantileOf(all, 0.975);
  if (all.size() < 2) return statistics;
  statistics.deviation = std::sqrt(VarianceOf(all));
  if (draws.rows() / 2 < kLeastDraws || all.minCoeff() == all.maxCoeff()) return statistics;
  const Eigen::MatrixXd halves = Halves(draws);
  const Eigen::MatrixXd folded = (halves.array() - statistics.median).abs();
  const Eigen::MatrixXd scores = NormalScores(halves);
  statistics.r_hat = std::max(RHatOf(scores), RHatOf(NormalScores(folded)));
  statistics.ess_bulk = EffectiveOf(scores);
  const auto below = [&](double share) -> Eigen::MatrixXd {
    return (halves.array() <= QuantileOf(all, share)).cast<double>();
  };
  statistics.ess_tail = std::min(EffectiveOf(below(0.05)), EffectiveOf(below(0.95)));
  return statistics;
}

}  // namespace tangible
