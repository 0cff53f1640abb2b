// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/random_effects.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <functional>
#include <utility>

#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/problem/problem_with_priors.h"
#include "tangible/math/decompositions.h"
#include "tangible/math/median.h"

namespace tangible {
namespace {

// The number of points at which a likelihood is evaluated before its maximum is searched between
// two of them.
constexpr int kGrid = 41;
// The number of bits of ln τ to which a maximum, which is flat, can be located.
constexpr int kBits = 24;
constexpr int kMostSweeps = 50;
constexpr int kBisections = 100;

/// The sum of ln |diagonal entry| of a triangular matrix over the columns that are determined.
double LogDiagonal(const Eigen::MatrixXd& factor, const Eigen::VectorXd& lengths,
                   Eigen::Index count) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < std::min(count, factor.rows()); ++i) {
    const double size = std::abs(factor(i, i));
    if (size > kUndeterminedColumn * lengths[i]) sum += std::log(size);
  }
  return sum;
}

}  // namespace

SpreadLikelihood::SpreadLikelihood(const BlockLayout& layout, std::vector<BlockFactor> blocks,
                                   std::vector<RandomEffect> effects, Eigen::VectorXd estimate,
                                   std::vector<bool> free)
    : layout_(layout),
      blocks_(std::move(blocks)),
      effects_(std::move(effects)),
      estimate_(std::move(estimate)),
      free_(std::move(free)) {
  for (int block = 0; block < layout_.num_blocks(); ++block) {
    // Columns are [own | shared | r].
    const int own = layout_.num_own(block);
    for (int i = 0; i < layout_.num_local(block); ++i) {
      const int k = layout_.ParameterOf(block, i);
      if (!free_[static_cast<size_t>(k)]) {
        const int column = i < layout_.num_shared() ? own + i : i - layout_.num_shared();
        blocks_[block].factor.col(column).setZero();
      }
    }
  }
}

SpreadLikelihood::Normal SpreadLikelihood::Eliminate(int block,
                                                     const std::vector<double>& spreads) const {
  const RowMatrixXd& data = blocks_[block].factor;
  const Eigen::Index own = layout_.num_own(block);
  const Eigen::Index shared = layout_.num_shared();
  const bool has_effects = block < static_cast<int>(effects_.empty() ? 0 : effects_[0].own.size());
  const auto num_effects = static_cast<Eigen::Index>(has_effects ? effects_.size() : 0);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(data.rows() + num_effects, own + shared + 1);
  rows.topRows(data.rows()) = data;
  for (Eigen::Index e = 0; e < num_effects; ++e) {
    const RandomEffect& effect = effects_[static_cast<size_t>(e)];
    const int own_index = effect.own[block];
    if (own_index < 0) continue;
    Prior prior{effect.kind, estimate_[effect.mean], spreads[static_cast<size_t>(e)]};
    const PriorResidual residual = EvaluatePrior(prior, estimate_[own_index]);
    const double by_mean = -EvaluatePrior(prior, prior.center).derivative;
    const Eigen::Index row = data.rows() + e;
    if (free_[own_index]) rows(row, own_index - layout_.own_offset(block)) = residual.derivative;
    if (free_[effect.mean]) rows(row, own + effect.mean) = by_mean;
    rows(row, own + shared) = residual.residual;
  }
  const Eigen::VectorXd lengths = rows.colwise().norm();
  const Eigen::MatrixXd factor = UnpivotedQr(rows).UpperFactor();
  Normal normal;
  normal.log_determinant = LogDiagonal(factor, lengths, own);
  const Eigen::Index left = std::max<Eigen::Index>(0, factor.rows() - own);
  normal.reduced = factor.bottomRightCorner(left, shared + 1);
  return normal;
}

SpreadLikelihood::Value SpreadLikelihood::At(const std::vector<double>& spreads) const {
  Value value;
  const Eigen::Index shared = layout_.num_shared();
  Eigen::MatrixXd stacked(0, shared + 1);
  std::vector<RowMatrixXd> parts;
  Eigen::Index count = 0;
  for (int block = 0; block < layout_.num_blocks(); ++block) {
    Normal normal = Eliminate(block, spreads);
    value.likelihood -= normal.log_determinant;
    count += normal.reduced.rows();
    parts.push_back(std::move(normal.reduced));
  }
  stacked.resize(count, shared + 1);
  Eigen::Index first = 0;
  for (const RowMatrixXd& part : parts) {
    stacked.middleRows(first, part.rows()) = part;
    first += part.rows();
  }
  const Eigen::VectorXd lengths = stacked.colwise().norm();
  const Eigen::MatrixXd factor = UnpivotedQr(stacked).UpperFactor();
  value.likelihood -= LogDiagonal(factor, lengths, shared);
  if (count > shared) {
    value.twice_cost = factor(shared, shared) * factor(shared, shared);
  }
  for (size_t e = 0; e < effects_.size(); ++e) {
    const auto& own = effects_[e].own;
    const auto recordings =
        static_cast<double>(std::count_if(own.begin(), own.end(), [](int k) { return k >= 0; }));
    value.likelihood -= recordings * std::log(spreads[e]);
  }
  value.likelihood -= 0.5 * value.twice_cost;
  return value;
}

std::pair<double, double> SpreadLikelihood::RangeOf(int effect) const {
  const RandomEffect& of = effects_[static_cast<size_t>(effect)];
  std::vector<double> deviations;
  for (size_t block = 0; block < of.own.size(); ++block) {
    const int k = of.own[block];
    const int b = static_cast<int>(block);
    if (k < 0) continue;
    // The part of the parameter's column that is orthogonal to the other own columns of the block.
    RowMatrixXd own = blocks_[block].factor.leftCols(layout_.num_own(b));
    const Eigen::Index column = k - layout_.own_offset(b);
    own.col(column).swap(own.col(own.cols() - 1));
    const Eigen::MatrixXd factor = UnpivotedQr(own).UpperFactor();
    const Eigen::Index last = own.cols() - 1;
    const double left = own.rows() > last ? std::abs(factor(last, last)) : 0.0;
    if (left > kUndeterminedColumn * own.norm()) {
      const double size = of.kind == PriorKind::kLogNormal ? std::abs(estimate_[k]) : 1.0;
      deviations.push_back(1.0 / (left * size));
    }
  }
  if (deviations.empty()) return {kLeastSpread * of.spread, kLargestSpread * of.spread};
  const double middle = UpperMedian(std::move(deviations));
  return {kLeastSpread * middle, kLargestSpread * std::max(middle, of.spread)};
}

namespace {

/// The spread that maximises ℓ over its range, with the other spreads held.
double BestSpread(const SpreadLikelihood& likelihood, size_t effect, std::vector<double> spreads) {
  const auto [low, high] = likelihood.RangeOf(static_cast<int>(effect));
  const auto cost = [&](double log_spread) {
    spreads[effect] = std::exp(log_spread);
    return -likelihood.At(spreads).likelihood;
  };
  const double first = std::log(low);
  const double step = (std::log(high) - first) / (kGrid - 1);
  int best = 0;
  double least = HUGE_VAL;
  for (int i = 0; i < kGrid; ++i) {
    const double here = cost(first + i * step);
    if (here < least) {
      least = here;
      best = i;
    }
  }
  if (best == 0) return low;
  const double from = first + (best - 1) * step;
  const double to = first + std::min(best + 1, kGrid - 1) * step;
  return std::exp(boost::math::tools::brent_find_minima(cost, from, to, kBits).first);
}

/// The spread between `from` and `to` at which the decreasing function Q falls to `level`; 0 where
/// Q is below it at `from`.
double Crossing(const std::function<double(double)>& q, double level, double low, double high) {
  if (q(low) <= level) return 0.0;
  double from = std::log(low);
  double to = std::log(high);
  for (int i = 0; i < kBisections && to - from > kSettledLogarithm; ++i) {
    const double middle = 0.5 * (from + to);
    (q(std::exp(middle)) > level ? from : to) = middle;
  }
  return std::exp(0.5 * (from + to));
}

/// Equation (2).
ConfidenceInterval IntervalOf(const SpreadLikelihood& likelihood, size_t effect, int recordings,
                              bool mean_has_prior, std::vector<double> spreads) {
  const auto [low, high] = likelihood.RangeOf(static_cast<int>(effect));
  spreads[effect] = kInfiniteSpread * high;
  const double free = likelihood.At(spreads).twice_cost;
  const auto q = [&](double spread) {
    spreads[effect] = spread;
    return likelihood.At(spreads).twice_cost - free;
  };
  const int freedom = recordings - (mean_has_prior ? 0 : 1);
  if (freedom < 1) return std::nullopt;
  const boost::math::chi_squared distribution(freedom);
  return std::pair(
      Crossing(q, boost::math::quantile(distribution, 0.975), low, kInfiniteSpread * high),
      Crossing(q, boost::math::quantile(distribution, 0.025), low, kInfiniteSpread * high));
}

/// Above this a spread is as good as infinite.
double LargestSpread(const RandomEffect& effect, const ParameterEntry& mean,
                     const Eigen::VectorXd& estimate) {
  if (effect.kind == PriorKind::kLogNormal) return kUnlimitedLogSpread;
  double largest = std::max(mean.scale, std::abs(estimate[effect.mean]));
  for (const int own : effect.own) {
    if (own >= 0) largest = std::max(largest, std::abs(estimate[own]));
  }
  return kUnlimitedSpread * largest;
}

/// The linear problem at the estimate; false where a run fails.
bool Linearise(const FitOptions& options, const Eigen::VectorXd& estimate,
               ProblemWithPriors* with_priors, std::vector<BlockFactor>* factors,
               std::string* message) {
  Linearizer linearizer(with_priors, options.derivatives, options.threads, nullptr);
  std::vector<BlockEvaluation> blocks;
  if (!linearizer.Rows(estimate, BlockDerivatives::kCompute, &blocks)) {
    *message = "the run at the estimate fails: " + linearizer.message();
    return false;
  }
  for (int b = 0; b < with_priors->num_blocks(); ++b) {
    const Eigen::VectorXd unit = Eigen::VectorXd::Ones(blocks[b].jacobian.cols());
    factors->push_back(Reduce(blocks[b], unit, with_priors->num_own(b),
                              with_priors->num_observation_rows(b), with_priors->weight(b),
                              options.huber));
  }
  return true;
}

}  // namespace

bool UpdateSpreads(const FitOptions& options, const FitResult& result, RecordingsProblem* problem,
                   std::vector<SpreadEstimate>* spreads, double* largest, std::string* message) {
  ProblemWithPriors with_priors(problem, {});
  std::vector<BlockFactor> factors;
  if (!Linearise(options, result.estimate, &with_priors, &factors, message)) return false;
  const std::vector<ParameterEntry>& entries = problem->entries();
  std::vector<bool> free;
  for (size_t k = 0; k < entries.size(); ++k) {
    free.push_back(!IsAtBound(entries[k], result.estimate[static_cast<Eigen::Index>(k)]));
  }
  const SpreadLikelihood likelihood(BlockLayout(with_priors), std::move(factors),
                                    problem->effects(), result.estimate, free);
  std::vector<double> now;
  for (const RandomEffect& effect : problem->effects()) now.push_back(effect.spread);
  const std::vector<double> before = now;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0.0;
    for (size_t e = 0; e < now.size(); ++e) {
      if (!problem->EstimatesSpread(static_cast<int>(e))) continue;
      const double best = BestSpread(likelihood, e, now);
      change = std::max(change, std::abs(std::log(best / now[e])));
      now[e] = best;
    }
    if (change < kSettledLogarithm) break;
  }
  bool limited = true;
  for (size_t e = 0; e < now.size(); ++e) {
    const int effect = static_cast<int>(e);
    SpreadEstimate& one = (*spreads)[e];
    if (!one.estimated) continue;
    const double smallest = likelihood.RangeOf(effect).first;
    const bool none = now[e] <= smallest;
    one.spread = none ? 0.0 : now[e];
    const bool has_prior = entries[problem->effects()[e].mean].prior.has_value();
    one.interval = IntervalOf(likelihood, e, one.recordings, has_prior, now);
    const RandomEffect& of = problem->effects()[e];
    const double most = LargestSpread(of, entries[of.mean], result.estimate);
    one.limited = now[e] <= most && !(one.interval && one.interval->second > most);
    if (!one.limited) one.interval.reset();
    if (now[e] > most) {
      limited = false;
      *message = "the observations do not limit the spread of \"" + one.name + "\"";
    }
    // A change between spreads at the lower end of the range does not matter.
    const bool was_none = before[e] <= 2.0 * smallest;
    if (!(none && was_none)) {
      *largest = std::max(*largest, std::abs(std::log(now[e] / before[e])));
    }
    problem->SetSpread(effect, now[e]);
  }
  return limited;
}

}  // namespace tangible
