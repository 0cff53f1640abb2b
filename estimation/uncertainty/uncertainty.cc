// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/uncertainty.h"

#include <algorithm>
#include <cmath>

#include "tangible/estimation/uncertainty/decomposition.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/median.h"
#include "tangible/math/scalar.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

// The number of terms that a message has of a combination.
constexpr int kMostTerms = 12;

/// "0.71 'a' - 0.71 'b'": a direction in the parameters' relative changes.
std::string Combination(const std::vector<ParameterEntry>& entries,
                        const Eigen::VectorXd& direction) {
  std::string text;
  int terms = 0;
  double largest = direction.cwiseAbs().maxCoeff();
  for (size_t k = 0; k < entries.size(); ++k) {
    double share = direction[static_cast<Eigen::Index>(k)] / largest;
    if (std::abs(share) < kSmallShare) {
      continue;
    }
    if (++terms > kMostTerms) {
      return text + " + ...";
    }
    if (text.empty() && share < 0.0) {  // a direction has no sign: the first share is positive
      largest = -largest;
      share = -share;
    }
    text += text.empty() ? "" : (share < 0.0 ? " - " : " + ");
    text += CompactNumber(std::abs(share), 3) + " '" + entries[k].name + "'";
  }
  return text;
}

/// A block at the estimate, over its free parameters.
struct BlockPart {
  std::vector<int> own;     ///< indices in p
  RowMatrixXd shared_rows;  ///< with the root of the weight
  RowMatrixXd own_rows;
  RowMatrixXd reduced;      ///< S̃, without rows of which Huber's loss takes no notice
  RowMatrixXd own_normal;   ///< (OᵀO)⁻¹
  RowMatrixXd from_shared;  ///< D
  double condition = 1.0;
};

/// A direction in all parameters that is not determined, or hardly.
struct WeakDirection {
  Eigen::VectorXd change;  ///< relative
  bool undetermined = true;
};

/// Computes the uncertainty of one fit.
class Estimator {
 public:
  Estimator(const LeastSquaresProblem& problem, const Eigen::VectorXd& estimate,
            const std::vector<BlockEvaluation>& blocks, const UncertaintyOptions& options)
      : problem_(problem),
        layout_(problem),
        entries_(problem.entries()),
        estimate_(estimate),
        blocks_(blocks),
        options_(options) {
    const Eigen::Index size = estimate.size();
    const Eigen::Index kept = size > kMostCovariance ? layout_.num_shared() : size;
    result_.covariance = RowMatrixXd::Constant(kept, kept, kNaN);
    result_.standard_deviation = Eigen::VectorXd::Constant(size, kNaN);
    result_.standard_deviation_robust = Eigen::VectorXd::Constant(size, kNaN);
    result_.degrees_of_freedom = Eigen::VectorXd::Constant(size, kNaN);
    result_.drift_p_value = Eigen::VectorXd::Constant(size, kNaN);
    result_.prior_share = Eigen::VectorXd::Zero(size);
    result_.confidence_95.resize(entries_.size());
    result_.confidence_95_robust.resize(entries_.size());
    result_.messages.resize(entries_.size());
  }

  Uncertainty Run() {
    FindFree();
    WarnOfPriors();
    WarnOfResiduals();
    if (num_free_ == 0) {
      return result_;
    }
    Eliminate();
    FindWeakDirections();
    NameUndetermined();
    FillCovariance();
    FillPriorShares();
    if (options_.leverages == Leverages::kCompute) {
      FillLeverages();
    }
    FillRobust();
    ProposeCombinations();
    return result_;
  }

 private:
  void FindFree() {
    parts_.resize(blocks_.size());
    for (size_t k = 0; k < entries_.size(); ++k) {
      const double estimate = estimate_[static_cast<Eigen::Index>(k)];
      if (!IsAtBound(entries_[k], estimate)) {
        ++num_free_;
        continue;
      }
      const bool lower = estimate < 0.5 * (entries_[k].lower + entries_[k].upper);
      result_.messages[k] = std::string("at its ") + (lower ? "lower" : "upper") + " bound" +
                            (lower && LeastOf(entries_[k]) > entries_[k].lower ? " 0" : "") +
                            ": no interval";
      result_.warnings.push_back("'" + entries_[k].name + "' is " + result_.messages[k]);
    }
    for (int k = 0; k < layout_.num_shared(); ++k) {
      if (result_.messages[k].empty()) {
        shared_.push_back(k);
      }
    }
  }

  void WarnOfPriors() {
    for (size_t k = 0; k < entries_.size(); ++k) {
      if (!entries_[k].prior) continue;
      const Prior& prior = *entries_[k].prior;
      const double estimate = estimate_[static_cast<Eigen::Index>(k)];
      const double apart = EvaluatePrior(prior, estimate).residual;
      if (!(std::abs(apart) > kContradictsPrior)) continue;
      result_.contradicts_prior = true;
      result_.warnings.push_back(
          "the observations contradict the prior of '" + entries_[k].name + "': the estimate " +
          CompactNumber(estimate, 6) + " is " + CompactNumber(std::abs(apart), 3) +
          " of its sigma " + (apart > 0.0 ? "above " : "below ") + CompactNumber(prior.center, 6) +
          ": the prior or the model is wrong, and the interval mixes both");
    }
  }

  // With Huber's loss some residuals are expected to be large, and they do not widen the intervals:
  // the others tell whether sigma is right.
  bool MedianExplained() const {
    if (!(options_.huber > 0.0)) return false;
    std::vector<double> sizes;
    for (size_t b = 0; b < blocks_.size(); ++b) {
      for (int i = 0; i < problem_.num_observation_rows(static_cast<int>(b)); ++i) {
        sizes.push_back(std::abs(blocks_[b].residuals[i]));
      }
    }
    const double freedom = static_cast<double>(sizes.size()) - static_cast<double>(num_free_);
    return freedom > 0.0 && kDeviationByMedian * Median(std::move(sizes)) <=
                                1.0 + kMedianDeviations * kDeviationOfMedian / std::sqrt(freedom);
  }

  void WarnOfResiduals() {
    static_cast<ResidualQuality&>(result_) = JudgeResiduals(problem_, blocks_, num_free_);
    result_.too_large = result_.too_large && !MedianExplained();
    if (result_.too_large) {
      result_.warnings.push_back("residuals are larger than sigma explains (reduced chi-square " +
                                 CompactNumber(result_.reduced_chi_square, 3) +
                                 "): the model misses something, or sigma is too small, and the "
                                 "intervals from sigma are too narrow");
    }
    if (result_.correlated) {
      result_.warnings.push_back(
          "residuals are correlated in time (" + CompactNumber(result_.whiteness.correlation, 3) +
          " from one sample to the next, probability by chance " +
          (result_.whiteness.p_value > kLeastProbability
               ? CompactNumber(result_.whiteness.p_value, 3)
               : "below " + CompactNumber(kLeastProbability, 3)) +
          "): the model misses something, whatever sigma is, and the intervals from sigma are too "
          "narrow");
    }
  }

  /// Whether a derivative with this square of its norm is rounding, as where the cost is flat.
  bool HasNoEffect(int parameter, double square) const {
    const double magnitude =
        std::max(std::abs(estimate_[parameter]), entries_[static_cast<size_t>(parameter)].scale);
    return magnitude * std::sqrt(square) < kRoundingColumn;
  }

  /// Eliminates the own parameters from the rows of each block and decomposes the rest.
  void Eliminate() {
    const Eigen::Index shared = static_cast<Eigen::Index>(shared_.size());
    Eigen::VectorXd all_squares = Eigen::VectorXd::Zero(shared);
    for (size_t b = 0; b < blocks_.size(); ++b) {
      all_squares += problem_.weight(static_cast<int>(b)) *
                     blocks_[b].jacobian(Eigen::all, shared_).colwise().squaredNorm().transpose();
    }
    for (Eigen::Index i = 0; i < shared; ++i) {
      without_effect_.push_back(HasNoEffect(shared_[static_cast<size_t>(i)], all_squares[i]) ? 1
                                                                                             : 0);
    }
    Eigen::VectorXd squares = Eigen::VectorXd::Zero(shared);
    for (size_t b = 0; b < blocks_.size(); ++b) {
      EliminateOwn(static_cast<int>(b));
      squares += parts_[b].shared_rows.colwise().squaredNorm().transpose();
    }
    RowMatrixXd stacked(layout_.num_rows(), shared);
    for (size_t b = 0; b < blocks_.size(); ++b) {
      stacked.middleRows(layout_.row_offset(static_cast<int>(b)), parts_[b].reduced.rows()) =
          parts_[b].reduced;
      parts_[b].reduced.resize(0, 0);  // as large as the observations, and no longer needed
    }
    decomposition_.emplace(stacked, squares.cwiseSqrt(), options_.rank_tolerance);
    shared_covariance_ = decomposition_->Covariance();
    result_.condition = shared > 0 ? decomposition_->condition() : 1.0;
    for (const BlockPart& part : parts_) {
      result_.condition = std::max(result_.condition, part.condition);
    }
  }

  void EliminateOwn(int block) {
    BlockPart& part = parts_[block];
    const BlockEvaluation& evaluation = blocks_[block];
    std::vector<int> local;
    for (int i = layout_.num_shared(); i < layout_.num_local(block); ++i) {
      const int k = layout_.ParameterOf(block, i);
      if (result_.messages[k].empty()) {
        part.own.push_back(k);
        local.push_back(i);
      }
    }
    const double root = std::sqrt(problem_.weight(block));
    part.shared_rows = root * evaluation.jacobian(Eigen::all, shared_);
    part.own_rows = root * evaluation.jacobian(Eigen::all, local);
    for (size_t i = 0; i < shared_.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      if (without_effect_[i] != 0) part.shared_rows.col(at).setZero();
    }
    for (size_t i = 0; i < part.own.size(); ++i) {
      auto column = part.own_rows.col(static_cast<Eigen::Index>(i));
      if (HasNoEffect(part.own[i], column.squaredNorm())) column.setZero();
    }
    RowMatrixXd own = part.own_rows;
    part.reduced = part.shared_rows;
    for (int i = 0; i < problem_.num_observation_rows(block) && options_.huber > 0.0; ++i) {
      if (std::abs(evaluation.residuals[i]) > options_.huber) {
        own.row(i).setZero();
        part.reduced.row(i).setZero();
      }
    }
    part.from_shared = PseudoSolve(own, part.reduced, options_.rank_tolerance);
    if (own.cols() == 0) {
      return;
    }
    part.reduced -= own * part.from_shared;
    const Decomposition decomposition(own, options_.rank_tolerance);
    part.own_normal = decomposition.Covariance();
    part.condition = decomposition.condition();
    AddWeak(decomposition, [&](const Eigen::VectorXd& direction) {
      Eigen::VectorXd all = Eigen::VectorXd::Zero(estimate_.size());
      all(part.own) = direction;
      return all;
    });
  }

  void FindWeakDirections() {
    AddWeak(*decomposition_, [&](const Eigen::VectorXd& direction) {
      Eigen::VectorXd all = Eigen::VectorXd::Zero(estimate_.size());
      all(shared_) = direction;
      for (const BlockPart& part : parts_) {
        if (!part.own.empty()) {
          all(part.own) = -part.from_shared * direction;
        }
      }
      return all;
    });
  }

  /// Keeps the directions of a decomposition that are not determined, or hardly; `extend` converts
  /// one to a direction in all parameters.
  template <typename Extend>
  void AddWeak(const Decomposition& decomposition, const Extend& extend) {
    const Eigen::VectorXd& s = decomposition.singular_values();
    for (Eigen::Index i = 0; i < decomposition.size(); ++i) {
      const bool determined = i < decomposition.rank();
      if (determined && s[i] * options_.condition_warning > s[0]) {
        continue;
      }
      Eigen::VectorXd change = extend(decomposition.Direction(i));
      for (Eigen::Index k = 0; k < change.size(); ++k) {
        const double magnitude = std::abs(estimate_[k]);
        change[k] /= magnitude > 0.0 ? magnitude : entries_[static_cast<size_t>(k)].scale;
      }
      weak_.push_back({change.normalized(), !determined});
    }
  }

  /// Names the undetermined directions and removes the intervals of their parameters.
  void NameUndetermined() {
    const WeakDirection* worst = nullptr;
    bool any = false;
    for (const WeakDirection& weak : weak_) {
      worst = &weak;
      if (!weak.undetermined) {
        continue;
      }
      any = true;
      const std::string combination = Combination(entries_, weak.change);
      result_.warnings.push_back("not determined by the observations: relative changes along " +
                                 combination);
      const double largest = weak.change.cwiseAbs().maxCoeff();
      for (size_t k = 0; k < entries_.size(); ++k) {
        if (std::abs(weak.change[static_cast<Eigen::Index>(k)]) >= kSmallShare * largest) {
          result_.messages[k] = "not determined: the observations do not fix " + combination;
        }
      }
    }
    if (!any && worst != nullptr) {
      result_.warnings.push_back("ill-conditioned (" + CompactNumber(result_.condition, 3) +
                                 "): worst determined are relative changes along " +
                                 Combination(entries_, worst->change) +
                                 "; hold one of these parameters or observe more");
    }
  }

  ConfidenceInterval IntervalAround(int parameter, double half) const {
    const double p = estimate_[parameter];
    return std::pair(p - half, p + half);
  }

  /// `all` (parameters x parameters, NaN to begin with) from the covariances of the shared
  /// parameters and of each block's own.
  template <typename Own>
  void Spread(const RowMatrixXd& shared, const Own& own, RowMatrixXd* all) const {
    const Eigen::Index kept = all->rows();
    if (!shared_.empty()) {
      (*all)(shared_, shared_) = shared;
    }
    for (size_t b = 0; b < parts_.size() && kept == estimate_.size(); ++b) {
      const BlockPart& part = parts_[b];
      if (part.own.empty()) {
        continue;
      }
      const RowMatrixXd cross = -part.from_shared * shared;
      if (!shared_.empty()) {
        (*all)(part.own, shared_) = cross;
        (*all)(shared_, part.own) = cross.transpose();
      }
      for (size_t c = 0; c < parts_.size(); ++c) {
        if (c != b && !parts_[c].own.empty()) {
          (*all)(part.own, parts_[c].own) = -cross * parts_[c].from_shared.transpose();
        }
      }
      (*all)(part.own, part.own) = own(b);
    }
  }

  RowMatrixXd OwnCovariance(size_t block) const {
    const BlockPart& part = parts_[block];
    return part.own_normal + part.from_shared * shared_covariance_ * part.from_shared.transpose();
  }

  void FillCovariance() {
    Eigen::VectorXd variance = Eigen::VectorXd::Constant(estimate_.size(), kNaN);
    if (!shared_.empty()) {
      variance(shared_) = shared_covariance_.diagonal();
    }
    for (size_t b = 0; b < parts_.size(); ++b) {
      if (!parts_[b].own.empty()) {
        variance(parts_[b].own) = OwnCovariance(b).diagonal();
      }
    }
    all_ = RowMatrixXd::Constant(result_.covariance.rows(), result_.covariance.cols(), kNaN);
    Spread(
        shared_covariance_, [&](size_t b) { return OwnCovariance(b); }, &all_);
    result_.covariance = all_;
    for (size_t k = 0; k < entries_.size(); ++k) {
      const int parameter = static_cast<int>(k);
      if (!result_.messages[k].empty()) {
        if (parameter < all_.rows()) {
          result_.covariance.row(parameter).setConstant(kNaN);
          result_.covariance.col(parameter).setConstant(kNaN);
        }
        continue;
      }
      const double deviation = std::sqrt(variance[parameter]);
      result_.standard_deviation[parameter] = deviation;
      result_.confidence_95[k] = IntervalAround(parameter, kNormalQuantile * deviation);
    }
  }

  /// C = C J_dataᵀ J_data C + C J_priorᵀ J_prior C: the second part of its diagonal.
  void FillPriorShares() {
    if (all_.rows() < estimate_.size()) {
      return;
    }
    Eigen::VectorXd part = Eigen::VectorXd::Zero(estimate_.size());
    for (size_t b = 0; b < blocks_.size(); ++b) {
      const int block = static_cast<int>(b);
      const double root = std::sqrt(problem_.weight(block));
      const Eigen::Index first = NumDataRows(block) + problem_.num_slope_rows(block);
      for (Eigen::Index i = first; i < blocks_[b].residuals.size(); ++i) {
        Eigen::VectorXd moved = Eigen::VectorXd::Zero(estimate_.size());
        for (int local = 0; local < layout_.num_local(block); ++local) {
          const int k = layout_.ParameterOf(block, local);
          const double derivative = root * blocks_[b].jacobian(i, local);
          if (derivative != 0.0 && std::isfinite(all_(k, k))) {
            moved += derivative * all_.col(k);
          }
        }
        part += moved.cwiseAbs2();
      }
    }
    for (Eigen::Index k = 0; k < part.size(); ++k) {
      if (all_(k, k) > 0.0 && std::isfinite(part[k])) {
        result_.prior_share[k] = std::min(1.0, part[k] / all_(k, k));
      }
    }
  }

  /// With C's parts of the shared and of a block's own parameters.
  void FillLeverages() {
    std::vector<double> all;
    all.reserve(static_cast<size_t>(layout_.num_rows()));
    for (size_t b = 0; b < parts_.size(); ++b) {
      const BlockPart& part = parts_[b];
      const Eigen::Index rows = problem_.num_observation_rows(static_cast<int>(b));
      // u = s − o D: o (OᵀO)⁻¹ oᵀ + u C_shared uᵀ
      RowMatrixXd u = part.shared_rows.topRows(rows);
      if (!part.own.empty()) {
        u -= part.own_rows.topRows(rows) * part.from_shared;
      }
      for (Eigen::Index i = 0; i < rows; ++i) {
        double leverage = shared_.empty() ? 0.0 : u.row(i).dot(u.row(i) * shared_covariance_);
        if (!part.own.empty()) {
          const auto own = part.own_rows.row(i);
          leverage += own.dot(own * part.own_normal);
        }
        all.push_back(leverage);
      }
    }
    result_.leverages =
        Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
  }

  /// Rows of observations and of random forces; what follows are slopes and priors.
  Eigen::Index NumDataRows(int block) const {
    return problem_.num_observation_rows(block) + problem_.num_noise_rows(block);
  }

  void FillRobust() {
    robust_ = RowMatrixXd::Constant(all_.rows(), all_.cols(), kNaN);
    std::vector<size_t> of_recordings;
    RowMatrixXd prior(0, static_cast<Eigen::Index>(shared_.size()));
    const std::vector<RecordingRows> recordings = Recordings(&of_recordings, &prior);
    // Smoothed residuals are correlated where the model is right.
    const bool too_few = result_.has_forces && recordings.size() < kFewRecordings;
    if (recordings.empty() || too_few) {
      return;
    }
    const RobustCovariance robust =
        EstimateRobustCovariance(recordings, prior, {options_.huber, options_.rank_tolerance});
    result_.robust_method = robust.method;
    result_.num_recordings = static_cast<int>(recordings.size());
    result_.bandwidth = robust.bandwidth;
    if (robust.method == RobustMethod::kNone) {
      return;
    }
    FillRobustIntervals(shared_, robust.shared, robust.shared_freedom);
    WarnOfDrift(robust.drift_p_value);
    std::vector<RowMatrixXd> own(parts_.size());
    for (size_t g = 0; g < of_recordings.size(); ++g) {
      own[of_recordings[g]] = robust.own[g];
      FillRobustIntervals(parts_[of_recordings[g]].own, robust.own[g], robust.own_freedom[g]);
    }
    Spread(
        robust.shared, [&](size_t b) { return own[b]; }, &robust_);
  }

  // Many parameters are tested, of which chance lets some seem to drift.
  void WarnOfDrift(const Eigen::VectorXd& p_values) {
    const double least =
        kDriftProbability / static_cast<double>(std::max<size_t>(1, shared_.size()));
    for (Eigen::Index i = 0; i < p_values.size(); ++i) {
      const int k = shared_[static_cast<size_t>(i)];
      result_.drift_p_value[k] = p_values[i];
      if (!(p_values[i] < least) || !result_.messages[k].empty()) continue;
      result_.warnings.push_back(
          "'" + entries_[k].name +
          "' drifts over the recordings in their order (probability by "
          "chance " +
          (p_values[i] > kLeastProbability ? CompactNumber(p_values[i], 3)
                                           : "below " + CompactNumber(kLeastProbability, 3)) +
          "): its interval holds for the mean over these recordings and not for later ones; "
          "let it vary (\"per\": \"recording\") and look at its course");
    }
  }

  void FillRobustIntervals(const std::vector<int>& parameters, const RowMatrixXd& covariance,
                           const Eigen::VectorXd& freedom) {
    for (size_t i = 0; i < parameters.size(); ++i) {
      const int k = parameters[i];
      const Eigen::Index at = static_cast<Eigen::Index>(i);
      if (!result_.messages[k].empty() || !(freedom[at] > 0.0)) {
        continue;
      }
      const double deviation = std::sqrt(std::max(0.0, covariance(at, at)));
      result_.standard_deviation_robust[k] = deviation;
      result_.degrees_of_freedom[k] = freedom[at];
      result_.confidence_95_robust[k] = IntervalAround(k, StudentQuantile(freedom[at]) * deviation);
    }
  }

  /// The blocks with observations, whose indices go to `of`; the others' rows go to `prior`. Empty
  /// where it is not known when rows were measured. Takes the rows from the parts: they are as many
  /// as the observations, and none is kept twice.
  std::vector<RecordingRows> Recordings(std::vector<size_t>* of, RowMatrixXd* prior) {
    std::vector<RecordingRows> recordings;
    for (size_t b = 0; b < blocks_.size(); ++b) {
      const int block = static_cast<int>(b);
      BlockPart& part = parts_[b];
      const Eigen::Index data = NumDataRows(block);
      const Eigen::Index priors = blocks_[b].residuals.size() - data;
      if (data == 0) {
        const Eigen::Index before = prior->rows();
        prior->conservativeResize(before + priors, Eigen::NoChange);
        prior->bottomRows(priors) = part.shared_rows;
        continue;
      }
      const std::vector<RowPlace> places = problem_.Places(block);
      if (static_cast<int>(places.size()) != problem_.num_observation_rows(block)) {
        return {};
      }
      RecordingRows rows;
      rows.times.reserve(places.size());
      for (const RowPlace& place : places) {
        rows.times.push_back(place.time);
      }
      rows.times.resize(static_cast<size_t>(data), 0.0);
      rows.weight = problem_.weight(block);
      rows.residuals = blocks_[b].residuals.head(data);
      rows.shared = part.shared_rows.topRows(data);
      rows.own = part.own_rows.topRows(data);
      rows.prior_residuals = std::sqrt(rows.weight) * blocks_[b].residuals.tail(priors);
      rows.prior_shared = part.shared_rows.bottomRows(priors);
      rows.prior_own = part.own_rows.bottomRows(priors);
      part.shared_rows.resize(0, 0);
      part.own_rows.resize(0, 0);
      recordings.push_back(std::move(rows));
      of->push_back(b);
    }
    return recordings;
  }

  void ProposeCombinations() {
    if (weak_.empty() || all_.rows() < estimate_.size()) {
      return;
    }
    Eigen::MatrixXd none(estimate_.size(), static_cast<Eigen::Index>(weak_.size()));
    for (size_t i = 0; i < weak_.size(); ++i) {
      none.col(static_cast<Eigen::Index>(i)) = weak_[i].change;
    }
    result_.combinations = FindDeterminedCombinations(entries_, estimate_, none, all_, robust_);
    for (const DeterminedCombination& combination : result_.combinations) {
      result_.warnings.push_back(
          "the observations do determine " + combination.sum + " = " +
          CompactNumber(combination.value, 3) + " ± " +
          CompactNumber(combination.standard_deviation, 3) +
          (combination.product.empty() ? "" : ", locally the product " + combination.product));
    }
  }

  const LeastSquaresProblem& problem_;
  const BlockLayout layout_;
  const std::vector<ParameterEntry>& entries_;
  const Eigen::VectorXd& estimate_;
  const std::vector<BlockEvaluation>& blocks_;
  const UncertaintyOptions& options_;
  int num_free_ = 0;
  std::vector<char> without_effect_;  ///< of shared_: its derivative is rounding
  std::vector<int> shared_;           ///< those that are free
  std::vector<BlockPart> parts_;
  std::optional<Decomposition> decomposition_;  ///< of S̃
  RowMatrixXd shared_covariance_;
  std::vector<WeakDirection> weak_;
  RowMatrixXd all_, robust_;  ///< over all parameters that are kept, also along weak directions
  Uncertainty result_;
};

}  // namespace

Uncertainty EstimateUncertainty(const LeastSquaresProblem& problem, const Eigen::VectorXd& estimate,
                                const std::vector<BlockEvaluation>& blocks,
                                const UncertaintyOptions& options) {
  return Estimator(problem, estimate, blocks, options).Run();
}

std::string DescribeRobust(const Uncertainty& uncertainty) {
  switch (uncertainty.robust_method) {
    case RobustMethod::kNone:
      return uncertainty.has_forces
                 ? "intervals from sigma and the random forces; robust ones from " +
                       std::to_string(kFewRecordings) + " recordings on"
                 : "robust intervals: none, for there are no more residuals than parameters";
    case RobustMethod::kRecordings:
      return "robust intervals: jackknife over the recordings, Student's t";
    case RobustMethod::kTime:
      return "robust intervals: residuals as they are, correlated over " +
             CompactNumber(uncertainty.bandwidth, 3) + " s, Student's t" +
             (uncertainty.num_recordings == 1
                  ? "; what differs from recording to recording is not in those of one"
                  : "");
  }
  return "";
}

}  // namespace tangible
