// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/robust_covariance.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "tangible/estimation/uncertainty/decomposition.h"
#include "tangible/estimation/uncertainty/drift.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/decompositions.h"
#include "tangible/math/median.h"
#include "tangible/math/scalar.h"

namespace tangible {
namespace {

/// Residuals at the same time count as one: their influences are added.
struct TimeSeries {
  std::vector<double> times;  // ascending, all different
  RowMatrixXd u;              // times x parameters
  RowMatrixXd w;              // their variances were the residuals white and of size sigma

  Eigen::Index size() const { return static_cast<Eigen::Index>(times.size()); }
  double Time(Eigen::Index t) const { return times[static_cast<size_t>(t)]; }
};

TimeSeries CollectTimes(const std::vector<double>& times, const Eigen::VectorXd& psi,
                        const RowMatrixXd& influence) {
  std::vector<int> order(times.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return times[a] < times[b]; });
  TimeSeries series;
  for (const int i : order) {
    if (series.times.empty() || times[i] > series.times.back()) {
      series.times.push_back(times[i]);
    }
  }
  series.u.setZero(series.size(), influence.cols());
  series.w.setZero(series.size(), influence.cols());
  Eigen::Index t = 0;
  for (const int i : order) {
    t += times[i] > series.Time(t) ? 1 : 0;
    series.u.row(t) += psi[i] * influence.row(i);
    series.w.row(t) += influence.row(i).cwiseAbs2();
  }
  return series;
}

/// Andrews' α of these series, with the first-order autoregression of each component.
double AutoregressiveAlpha(const TimeSeries& series) {
  double above = 0.0;
  double below = 0.0;
  const RowMatrixXd& u = series.u;
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    double product = 0.0;
    double square = 0.0;
    for (Eigen::Index t = 0; t + 1 < u.rows(); ++t) {
      product += u(t, k) * u(t + 1, k);
      square += 0.5 * (u(t, k) * u(t, k) + u(t + 1, k) * u(t + 1, k));
    }
    if (!(square > 0.0)) {
      continue;
    }
    const double rho =
        std::clamp(product / square, -kLargestAutoregression, kLargestAutoregression);
    above += 4.0 * rho * rho / (std::pow(1.0 - rho, 6) * std::pow(1.0 + rho, 2));
    below += 1.0 / std::pow(1.0 - rho, 4);
  }
  return below > 0.0 ? above / below : 0.0;
}

/// The bandwidth S in seconds.
double Bandwidth(const TimeSeries& series) {
  if (series.times.size() < 3) {
    return 0.0;
  }
  std::vector<double> spacing;
  for (size_t t = 0; t + 1 < series.times.size(); ++t) {
    spacing.push_back(series.times[t + 1] - series.times[t]);
  }
  // The spacing is the median, which gaps in a recording do not change.
  const double samples = static_cast<double>(series.times.size());
  const double width = kAndrewsFactor * std::cbrt(AutoregressiveAlpha(series) * samples);
  const double duration = series.times.back() - series.times.front();
  return std::min(width * UpperMedian(std::move(spacing)), kLargestBandwidth * duration);
}

/// Σ k_tt' u_t u_t'ᵀ. Bartlett's kernel is the overlap of two windows of width S: the sum is 1/S
/// times the integral over a sliding window of the square of what is in it. This is linear in the
/// number of times, and never negative.
RowMatrixXd KernelSum(const TimeSeries& series, double bandwidth) {
  const Eigen::Index count = series.size();
  const Eigen::Index size = series.u.cols();
  RowMatrixXd sum = RowMatrixXd::Zero(size, size);
  if (!(bandwidth > 0.0)) {
    for (Eigen::Index t = 0; t < count; ++t) {
      sum += series.u.row(t).transpose() * series.u.row(t);
    }
    return sum;
  }
  Eigen::VectorXd inside = Eigen::VectorXd::Zero(size);
  Eigen::Index in = 0;   // the next that enters at its time
  Eigen::Index out = 0;  // the next that leaves at its time + bandwidth
  double last = count == 0 ? 0.0 : series.Time(0);
  while (out < count) {
    const bool enters = in < count && series.Time(in) <= series.Time(out) + bandwidth;
    const double now = enters ? series.Time(in) : series.Time(out) + bandwidth;
    sum += ((now - last) / bandwidth) * (inside * inside.transpose());
    last = now;
    if (enters) {
      inside += series.u.row(in++).transpose();
    } else {
      inside -= series.u.row(out++).transpose();
    }
    if (in == out) {
      inside.setZero();  // no rounding is carried on
    }
  }
  return sum;
}

/// (Σ_t w_t, Σ_tt' k_tt'² w_t w_t') of each component, with k² expanded in powers of t' − t.
std::pair<Eigen::VectorXd, Eigen::VectorXd> KernelWeights(const TimeSeries& series,
                                                          double bandwidth) {
  const Eigen::Index size = series.w.cols();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(size);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(size);
  Eigen::VectorXd ahead[3];  // Σ w_t' ((t' − origin) / S)^n over the t' within S after t
  for (Eigen::VectorXd& power : ahead) {
    power = Eigen::VectorXd::Zero(size);
  }
  Eigen::Index next = 0;
  const auto add = [&](Eigen::Index i, double sign) {
    const double x = (series.Time(i) - series.Time(0)) / bandwidth;
    ahead[0] += sign * series.w.row(i).transpose();
    ahead[1] += sign * x * series.w.row(i).transpose();
    ahead[2] += sign * x * x * series.w.row(i).transpose();
  };
  for (Eigen::Index t = 0; t < series.size(); ++t) {
    const auto w = series.w.row(t).transpose();
    sum += w;
    squares += w.cwiseAbs2();
    if (!(bandwidth > 0.0)) {
      continue;
    }
    while (next < series.size() && series.Time(next) < series.Time(t) + bandwidth) {
      add(next++, 1.0);
    }
    add(t, -1.0);
    const double a = 1.0 + (series.Time(t) - series.Time(0)) / bandwidth;
    squares += 2.0 * w.cwiseProduct(a * a * ahead[0] - 2.0 * a * ahead[1] + ahead[2]);
  }
  return {sum, squares};
}

/// One recording with its own parameters eliminated.
struct Reduced {
  Eigen::VectorXd psi;
  Eigen::VectorXd counts;   // 1, or 0 where Huber's loss is linear
  RowMatrixXd shared;       // S̃
  RowMatrixXd from_shared;  // D
  RowMatrixXd own_normal;   // (OᵀO + own_known)⁺
  RowMatrixXd own_known;    // of the priors
  RowMatrixXd prior;        // S̃ of the priors on own parameters
  RowMatrixXd known;        // their part of A_g
  RowMatrixXd information;  // A_g
};

/// The variance that residuals with a leverage do not show, of the whole fit.
struct Unseen {
  double variance = 1.0;       // s², of a residual of weight 1
  double freedom = kInfinity;  // of s²
};

Reduced Reduce(const RecordingRows& rows, const RobustOptions& options) {
  Reduced reduced;
  reduced.psi = rows.residuals;
  reduced.counts = Eigen::VectorXd::Ones(rows.residuals.size());
  for (Eigen::Index i = 0; i < rows.residuals.size(); ++i) {
    if (options.huber > 0.0 && std::abs(rows.residuals[i]) > options.huber) {
      reduced.psi[i] = std::copysign(options.huber, rows.residuals[i]);
      reduced.counts[i] = 0.0;
    }
  }
  reduced.psi *= std::sqrt(rows.weight);
  reduced.shared = rows.shared;
  const Eigen::Index own = rows.own.cols();
  const Eigen::Index priors = rows.prior_own.rows();
  const Eigen::Index size = rows.shared.cols();
  reduced.known = RowMatrixXd::Zero(size, size);
  reduced.own_known = RowMatrixXd::Zero(own, own);
  reduced.from_shared = RowMatrixXd::Zero(own, size);
  if (own > 0) {
    RowMatrixXd stacked(rows.own.rows() + priors, own);
    stacked.topRows(rows.own.rows()) = reduced.counts.asDiagonal() * rows.own;
    if (priors > 0) {
      stacked.bottomRows(priors) = rows.prior_own;
      reduced.own_known = rows.prior_own.transpose() * rows.prior_own;
    }
    reduced.own_normal = Decomposition(stacked, options.rank_tolerance).Covariance();
    RowMatrixXd right(stacked.rows(), size);
    right.topRows(rows.own.rows()) = reduced.counts.asDiagonal() * rows.shared;
    if (priors > 0) {
      right.bottomRows(priors) = rows.prior_shared;
    }
    reduced.from_shared = PseudoSolve(stacked, right, options.rank_tolerance);
    reduced.shared -= rows.own * reduced.from_shared;
  }
  const RowMatrixXd counted = reduced.counts.asDiagonal() * reduced.shared;
  reduced.information = counted.transpose() * counted;
  if (priors > 0) {
    reduced.prior = rows.prior_shared - rows.prior_own * reduced.from_shared;
    reduced.known = reduced.prior.transpose() * reduced.prior;
    reduced.information += reduced.known;
  }
  return reduced;
}

/// s² of equation (5); `parameters` of all recordings. Where Huber's loss cuts residuals off the
/// median tells their size, at least.
Unseen UnseenOf(const std::vector<RecordingRows>& recordings, const std::vector<Reduced>& reduced,
                Eigen::Index parameters, const RobustOptions& options) {
  double sum = 0.0;
  Eigen::Index rows = 0;
  std::vector<double> sizes;
  for (size_t g = 0; g < recordings.size(); ++g) {
    if (!(recordings[g].weight > 0.0)) continue;
    sum += reduced[g].psi.squaredNorm() / recordings[g].weight;
    rows += reduced[g].psi.size();
    for (const double r : recordings[g].residuals) sizes.push_back(std::abs(r));
  }
  Unseen unseen;
  if (rows > parameters) {
    unseen.freedom = static_cast<double>(rows - parameters);
    unseen.variance = sum / unseen.freedom;
    if (options.huber > 0.0) {
      const double size = kDeviationByMedian * Median(std::move(sizes));
      unseen.variance = std::max(unseen.variance, size * size);
    }
  }
  return unseen;
}

/// The sum of equation (5) for these influences, rows x parameters.
RowMatrixXd UnseenSum(const Unseen& unseen, const RecordingRows& rows, const Reduced& part,
                      const RowMatrixXd& normal, const RowMatrixXd& influence) {
  std::vector<int> order(rows.times.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return rows.times[a] < rows.times[b]; });
  std::erase_if(order, [&](int i) { return part.counts[i] == 0.0; });
  RowMatrixXd sum = RowMatrixXd::Zero(influence.cols(), influence.cols());
  std::vector<int> at;  // the rows at one time
  for (size_t first = 0; first < order.size(); first += at.size()) {
    at.clear();
    for (size_t i = first; i < order.size() && !(rows.times[order[i]] > rows.times[order[first]]);
         ++i) {
      at.push_back(order[i]);
    }
    const RowMatrixXd shared = part.shared(at, Eigen::all);
    RowMatrixXd leverage = shared * normal * shared.transpose();
    if (rows.own.cols() > 0) {
      const RowMatrixXd own = rows.own(at, Eigen::all);
      leverage += own * part.own_normal * own.transpose();
    }
    const RowMatrixXd hidden = leverage * influence(at, Eigen::all);
    sum += hidden.transpose() * hidden;
  }
  return unseen.variance * rows.weight * sum;
}

/// The factor f of equation (4) without N / (N − P).
double TakenAway(const TimeSeries& series, double bandwidth) {
  const double duration = series.times.empty() ? 0.0 : series.times.back() - series.times.front();
  const double beta = duration > 0.0 ? bandwidth / duration : 0.0;
  return 1.0 / (1.0 - beta + beta * beta / 3.0);
}

struct KernelResult {
  RowMatrixXd covariance;
  Eigen::VectorXd weights, square_weights;
  double bandwidth = 0.0;
};

KernelResult KernelCovariance(const RecordingRows& rows, const Eigen::VectorXd& psi,
                              const RowMatrixXd& influence) {
  const TimeSeries series = CollectTimes(rows.times, psi, influence);
  KernelResult result;
  result.bandwidth = Bandwidth(series);
  result.covariance = TakenAway(series, result.bandwidth) * KernelSum(series, result.bandwidth);
  std::tie(result.weights, result.square_weights) = KernelWeights(series, result.bandwidth);
  return result;
}

/// Equation (3); false where a recording cannot be left out.
bool Jackknife(const std::vector<Reduced>& reduced, const std::vector<RecordingRows>& recordings,
               const RowMatrixXd& normal, const RowMatrixXd& information,
               const RobustOptions& options, RobustCovariance* result) {
  const Eigen::Index size = normal.rows();
  const double count = static_cast<double>(recordings.size());
  RowMatrixXd all_moved(static_cast<Eigen::Index>(reduced.size()), size);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(size);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(size);
  const Eigen::VectorXd length = information.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (size_t i = 0; i < reduced.size(); ++i) {
    const Reduced& g = reduced[i];
    // This matrix is a square: its condition is the square of that of the rows.
    Eigen::MatrixXd left = information - g.information;
    Eigen::VectorXd score = g.shared.transpose() * g.psi;
    if (g.prior.rows() > 0) {
      score += g.prior.transpose() * recordings[i].prior_residuals;
    }
    for (Eigen::Index k = 0; k < size; ++k) {
      const double scale = length[k] > 0.0 ? 1.0 / length[k] : 1.0;
      left.row(k) *= scale;
      left.col(k) *= scale;
      score[k] *= scale;
    }
    PivotedQr qr;
    qr.SetThreshold(std::max(options.rank_tolerance, kJackknifeRank));
    qr.Compute(left);
    if (qr.rank() < size) {
      return false;
    }
    const Eigen::VectorXd moved = qr.Solve(score);
    for (Eigen::Index k = 0; k < size; ++k) {
      all_moved(static_cast<Eigen::Index>(i), k) =
          moved[k] * (length[k] > 0.0 ? 1.0 / length[k] : 1.0);
    }
    const Eigen::VectorXd w = (normal * g.information * normal).diagonal();
    weights += w;
    squares += w.cwiseAbs2();
  }
  RowMatrixXd sum = RowMatrixXd::Zero(size, size);
  for (const auto& moved : all_moved.rowwise()) sum += moved.transpose() * moved;
  result->method = RobustMethod::kRecordings;
  result->shared = (count - 1.0) / count * sum;
  result->drift_p_value.resize(size);
  for (Eigen::Index k = 0; k < size; ++k) {
    result->drift_p_value[k] = DriftProbability(all_moved.col(k));
  }
  result->shared_freedom =
      (weights.cwiseAbs2().cwiseQuotient(squares).array() - 1.0).max(1.0).matrix();
  return true;
}

/// A prior's part of the variance is known: the sum has more degrees of freedom (Satterthwaite).
void AddKnown(const RowMatrixXd& known, RobustCovariance* result) {
  for (Eigen::Index k = 0; k < known.rows(); ++k) {
    const double estimated = result->shared(k, k);
    if (estimated > 0.0) {
      const double ratio = 1.0 + known(k, k) / estimated;
      result->shared_freedom[k] *= ratio * ratio;
    }
  }
  result->shared += known;
}

/// Equations (4) and (5) of the shared parameters.
void SumOverTime(const std::vector<RecordingRows>& recordings, const std::vector<Reduced>& reduced,
                 const RowMatrixXd& normal, double factor, const Unseen& unseen,
                 RobustCovariance* result) {
  const Eigen::Index size = normal.rows();
  result->method = RobustMethod::kTime;
  result->shared = RowMatrixXd::Zero(size, size);
  RowMatrixXd known = RowMatrixXd::Zero(size, size);
  RowMatrixXd not_seen = RowMatrixXd::Zero(size, size);
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(size);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(size);
  for (size_t g = 0; g < recordings.size(); ++g) {
    const RowMatrixXd influence = reduced[g].shared * normal;
    const KernelResult kernel = KernelCovariance(recordings[g], reduced[g].psi, influence);
    not_seen += UnseenSum(unseen, recordings[g], reduced[g], normal, influence);
    result->shared += factor * kernel.covariance;
    weights += kernel.weights;
    squares += kernel.square_weights;
    result->bandwidth = std::max(result->bandwidth, kernel.bandwidth);
    known += reduced[g].known;
  }
  result->shared_freedom = weights.cwiseAbs2().cwiseQuotient(squares);
  for (Eigen::Index k = 0; k < size; ++k) {
    const double seen = result->shared(k, k), rest = not_seen(k, k);
    if (!(rest > 0.0)) continue;
    result->shared_freedom[k] =
        (seen + rest) * (seen + rest) /
        (seen * seen / result->shared_freedom[k] + rest * rest / unseen.freedom);
  }
  result->shared += not_seen;
  AddKnown(normal * known * normal, result);
}

void AddOwn(const std::vector<RecordingRows>& recordings, const std::vector<Reduced>& reduced,
            const RowMatrixXd& normal, double factor, const Unseen& unseen,
            RobustCovariance* result) {
  for (size_t g = 0; g < recordings.size(); ++g) {
    if (recordings[g].own.cols() == 0) {
      result->own.emplace_back();
      result->own_freedom.emplace_back();
      continue;
    }
    const Reduced& part = reduced[g];
    const RowMatrixXd influence = recordings[g].own * part.own_normal;
    const KernelResult kernel = KernelCovariance(recordings[g], part.psi, influence);
    const RowMatrixXd not_seen = UnseenSum(unseen, recordings[g], part, normal, influence);
    const RowMatrixXd of_data = factor * kernel.covariance;
    const RowMatrixXd of_prior = part.own_normal * part.own_known * part.own_normal;
    const RowMatrixXd of_shared = part.from_shared * result->shared * part.from_shared.transpose();
    result->own.emplace_back(of_data + not_seen + of_prior + of_shared);
    const Eigen::VectorXd freedom = kernel.weights.cwiseAbs2().cwiseQuotient(kernel.square_weights);
    Eigen::VectorXd all(freedom.size());
    for (Eigen::Index k = 0; k < all.size(); ++k) {
      double uncertain =
          std::pow(of_data(k, k), 2) / freedom[k] + std::pow(not_seen(k, k), 2) / unseen.freedom;
      // The shared part has degrees of freedom of its own; those of its largest share are used.
      const Eigen::VectorXd shares =
          part.from_shared.row(k).transpose().cwiseAbs2().cwiseProduct(result->shared.diagonal());
      Eigen::Index most = 0;
      if (shares.size() > 0 && shares.maxCoeff(&most) > 0.0) {
        uncertain += of_shared(k, k) * of_shared(k, k) / result->shared_freedom[most];
      }
      const double total = result->own.back()(k, k);
      all[k] = total * total / uncertain;
    }
    result->own_freedom.push_back(all);
    result->bandwidth = std::max(result->bandwidth, kernel.bandwidth);
  }
}

}  // namespace

RobustCovariance EstimateRobustCovariance(const std::vector<RecordingRows>& recordings,
                                          const RowMatrixXd& prior, const RobustOptions& options) {
  RobustCovariance result;
  const Eigen::Index size = recordings.empty() ? 0 : recordings.front().shared.cols();
  std::vector<Reduced> reduced;
  Eigen::Index stacked_rows = prior.rows();
  Eigen::Index parameters = size;
  for (const RecordingRows& recording : recordings) {
    reduced.push_back(Reduce(recording, options));
    stacked_rows += reduced.back().shared.rows() + reduced.back().prior.rows();
    parameters += recording.own.cols();
  }
  result.shared = RowMatrixXd::Constant(size, size, kNaN);
  result.shared_freedom = Eigen::VectorXd::Constant(size, kNaN);
  if (stacked_rows <= parameters) {
    return result;
  }
  // The rank is that of the rows and not of their normal matrix.
  RowMatrixXd stacked(stacked_rows, size);
  RowMatrixXd known = RowMatrixXd::Zero(size, size);
  Eigen::Index first = 0;
  const auto append = [&](const RowMatrixXd& rows) {
    if (rows.rows() > 0) {
      stacked.middleRows(first, rows.rows()) = rows;
      first += rows.rows();
    }
  };
  append(prior);
  if (prior.rows() > 0) {
    known = prior.transpose() * prior;
  }
  RowMatrixXd information = known;
  for (const Reduced& g : reduced) {
    append(g.counts.asDiagonal() * g.shared);
    append(g.prior);
    information += g.information;
  }
  const RowMatrixXd normal = Decomposition(stacked, options.rank_tolerance).Covariance();
  const double rows = static_cast<double>(stacked_rows);
  const double factor = rows / (rows - static_cast<double>(parameters));
  const Unseen unseen = UnseenOf(recordings, reduced, parameters, options);
  // Without shared parameters leaving a recording out moves nothing.
  if (size == 0 || static_cast<int>(recordings.size()) < kFewRecordings ||
      !Jackknife(reduced, recordings, normal, information, options, &result)) {
    SumOverTime(recordings, reduced, normal, factor, unseen, &result);
  }
  AddKnown(normal * known * normal, &result);
  AddOwn(recordings, reduced, normal, factor, unseen, &result);
  return result;
}

const char* NameOf(RobustMethod method) {
  switch (method) {
    case RobustMethod::kNone:
      return "none";
    case RobustMethod::kRecordings:
      return "recordings";
    case RobustMethod::kTime:
      return "time";
  }
  return "";
}

double StudentQuantile(double freedom) {
  return boost::math::quantile(boost::math::students_t(freedom), 0.975);
}

}  // namespace tangible
