// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "tangible/estimation/fit/decomposition.h"

namespace tangible {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kNormalQuantile = 1.959963984540054;  // of 0.975
// Of the reduced chi-square above 1, in its standard deviations sqrt(2 / (N - P)).
constexpr double kChiSquareDeviations = 5.0;
// Residuals are called correlated where chance gives this with less than that probability, and
// where it matters: below a tenth from one sample to the next intervals change by 10 %.
constexpr double kWhitenessProbability = 1e-4;
constexpr double kWhitenessCorrelation = 0.1;

std::string Short(double x) {
  std::ostringstream text;
  text.precision(3);
  text << x;
  return text.str();
}

/// "0.71 'a' - 0.71 'b'": a direction in the parameters' relative changes.
std::string Combination(const std::vector<ParameterizedScene::Entry>& entries,
                        const std::vector<int>& free, const Eigen::VectorXd& direction) {
  std::string text;
  double largest = direction.cwiseAbs().maxCoeff();
  for (size_t i = 0; i < free.size(); ++i) {
    double share = direction[static_cast<Eigen::Index>(i)] / largest;
    if (std::abs(share) < kSmallShare) {
      continue;
    }
    if (text.empty() && share < 0.0) {  // a direction has no sign: the first share is positive
      largest = -largest;
      share = -share;
    }
    text += text.empty() ? "" : (share < 0.0 ? " - " : " + ");
    text += Short(std::abs(share)) + " '" + entries[free[i]].name + "'";
  }
  return text;
}

/// Rows of J that count and columns that are free; the first `num_data` have Huber's loss.
RowMatrixXd FreePart(const Eigen::VectorXd& residuals, const RowMatrixXd& jacobian,
                     const std::vector<int>& free, Eigen::Index num_data, double huber) {
  RowMatrixXd part = RowMatrixXd::Zero(jacobian.rows(), static_cast<Eigen::Index>(free.size()));
  for (Eigen::Index i = 0; i < jacobian.rows(); ++i) {
    if (huber > 0.0 && i < num_data && std::abs(residuals[i]) > huber) {
      continue;
    }
    for (size_t k = 0; k < free.size(); ++k) {
      part(i, static_cast<Eigen::Index>(k)) = jacobian(i, free[k]);
    }
  }
  return part;
}

/// One fit's uncertainty under way.
class Estimator {
 public:
  Estimator(const std::vector<ParameterizedScene::Entry>& entries, const Eigen::VectorXd& estimate,
            const Eigen::VectorXd& residuals, const RowMatrixXd& jacobian,
            const std::vector<ResidualPlace>& places, const UncertaintyOptions& options)
      : entries_(entries),
        estimate_(estimate),
        residuals_(residuals),
        jacobian_(jacobian),
        places_(places),
        options_(options) {
    const Eigen::Index size = estimate.size();
    result_.covariance = RowMatrixXd::Constant(size, size, kNaN);
    result_.standard_deviation = Eigen::VectorXd::Constant(size, kNaN);
    result_.standard_deviation_robust = Eigen::VectorXd::Constant(size, kNaN);
    result_.degrees_of_freedom = Eigen::VectorXd::Constant(size, kNaN);
    result_.prior_share = Eigen::VectorXd::Zero(size);
    result_.confidence_95.resize(entries.size());
    result_.confidence_95_robust.resize(entries.size());
    result_.messages.resize(entries.size());
  }

  Uncertainty Run() {
    FindFree();
    JudgeResiduals();
    if (free_.empty()) {
      return result_;
    }
    const Decomposition decomposition(
        FreePart(residuals_, jacobian_, free_, num_data(), options_.huber),
        options_.rank_tolerance);
    result_.condition = decomposition.condition();
    MarkUndetermined(decomposition);
    const Eigen::MatrixXd covariance = decomposition.Covariance();
    FillCovariance(covariance);
    FillPriorShare(covariance);
    const RowMatrixXd robust = FillRobust();
    // An ill-conditioned direction is given up too.
    result_.combinations = FindDeterminedCombinations(
        entries_, estimate_, free_, decomposition,
        std::max(options_.rank_tolerance, 1.0 / options_.condition_warning), covariance, robust);
    if (decomposition.rank() == decomposition.size() &&
        result_.condition > options_.condition_warning) {
      WarnOfCondition(decomposition);
    }
    for (const DeterminedCombination& combination : result_.combinations) {
      result_.warnings.push_back("the observations do determine " + NameOf(combination));
    }
    return result_;
  }

 private:
  /// Residuals of measured coordinates; those after are of priors.
  Eigen::Index num_data() const {
    return places_.empty() ? residuals_.size() : static_cast<Eigen::Index>(places_.size());
  }

  void FindFree() {
    for (size_t k = 0; k < entries_.size(); ++k) {
      const double estimate = estimate_[static_cast<Eigen::Index>(k)];
      if (!IsAtBound(entries_[k], estimate)) {
        free_.push_back(static_cast<int>(k));
        continue;
      }
      const bool lower = estimate < 0.5 * (entries_[k].lower + entries_[k].upper);
      result_.messages[k] =
          std::string("at its ") + (lower ? "lower" : "upper") + " bound: no interval";
      result_.warnings.push_back("'" + entries_[k].name + "' is " + result_.messages[k]);
    }
  }

  void JudgeResiduals() {
    const auto data = residuals_.head(num_data());
    const double count = static_cast<double>(data.size());
    const double freedom = count - static_cast<double>(free_.size());
    result_.residual_rms = std::sqrt(data.squaredNorm() / count);
    result_.reduced_chi_square = freedom > 0.0 ? data.squaredNorm() / freedom : kNaN;
    result_.too_large =
        result_.reduced_chi_square > 1.0 + kChiSquareDeviations * std::sqrt(2.0 / freedom);
    if (result_.too_large) {
      result_.warnings.push_back("residuals are larger than sigma explains (reduced chi-square " +
                                 Short(result_.reduced_chi_square) +
                                 "): the model misses something, or sigma is too small, and the "
                                 "intervals from sigma are too narrow");
    }
    result_.whiteness = TestWhiteness(data, places_);
    result_.correlated = result_.whiteness.p_value < kWhitenessProbability &&
                         std::abs(result_.whiteness.correlation) > kWhitenessCorrelation;
    if (result_.correlated) {
      result_.warnings.push_back(
          "residuals are correlated in time (" + Short(result_.whiteness.correlation) +
          " from one sample to the next, probability by chance " +
          (result_.whiteness.p_value > 1e-12 ? Short(result_.whiteness.p_value) : "below 1e-12") +
          "): the model misses something, whatever sigma is, and the intervals from sigma are too "
          "narrow");
    }
  }

  /// Names the directions without information and takes the intervals of their parameters away.
  void MarkUndetermined(const Decomposition& decomposition) {
    for (Eigen::Index i = decomposition.rank(); i < decomposition.size(); ++i) {
      const Eigen::VectorXd direction =
          RelativeChanges(entries_, estimate_, free_, decomposition.Direction(i));
      const std::string combination = Combination(entries_, free_, direction);
      result_.warnings.push_back("not determined by the observations: relative changes along " +
                                 combination);
      const double largest = direction.cwiseAbs().maxCoeff();
      for (size_t k = 0; k < free_.size(); ++k) {
        if (std::abs(direction[static_cast<Eigen::Index>(k)]) >= kSmallShare * largest) {
          result_.messages[free_[k]] = "not determined: the observations do not fix " + combination;
        }
      }
    }
  }

  void FillCovariance(const Eigen::MatrixXd& covariance) {
    for (size_t i = 0; i < free_.size(); ++i) {
      if (!result_.messages[free_[i]].empty()) {
        continue;
      }
      for (size_t j = 0; j < free_.size(); ++j) {
        if (result_.messages[free_[j]].empty()) {
          result_.covariance(free_[i], free_[j]) =
              covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
        }
      }
      const double deviation = std::sqrt(result_.covariance(free_[i], free_[i]));
      result_.standard_deviation[free_[i]] = deviation;
      result_.confidence_95[free_[i]] = IntervalAround(free_[i], kNormalQuantile * deviation);
    }
  }

  /// C = C J_dataᵀ J_data C + C J_priorᵀ J_prior C: the second part of its diagonal.
  void FillPriorShare(const Eigen::MatrixXd& covariance) {
    const Eigen::Index priors = residuals_.size() - num_data();
    if (priors == 0) {
      return;
    }
    const RowMatrixXd rows = jacobian_.bottomRows(priors)(Eigen::all, free_) * covariance;
    for (size_t i = 0; i < free_.size(); ++i) {
      const Eigen::Index k = static_cast<Eigen::Index>(i);
      if (covariance(k, k) > 0.0) {
        result_.prior_share[free_[i]] = std::min(1.0, rows.col(k).squaredNorm() / covariance(k, k));
      }
    }
  }

  ConfidenceInterval IntervalAround(int parameter, double half) const {
    const double p = estimate_[parameter];
    return std::pair(p - half, p + half);
  }

  int RecordingOf(int parameter) const {
    return options_.recording_of_parameter.empty() ? -1
                                                   : options_.recording_of_parameter[parameter];
  }

  /// The robust covariance over the free parameters, which it fills into the result.
  RowMatrixXd FillRobust() {
    const Eigen::Index size = static_cast<Eigen::Index>(free_.size());
    RowMatrixXd all = RowMatrixXd::Constant(size, size, kNaN);
    if (places_.empty()) {
      return all;
    }
    int count = 1;
    for (const ResidualPlace& place : places_) {
      count = std::max(count, place.recording + 1);
    }
    std::vector<int> shared;  // indices into free
    std::vector<std::vector<int>> own(count);
    for (size_t i = 0; i < free_.size(); ++i) {
      const int recording = RecordingOf(free_[i]);
      (recording < 0 ? shared : own[recording]).push_back(static_cast<int>(i));
    }
    RowMatrixXd shared_prior;
    const RobustCovariance robust = EstimateRobustCovariance(
        Rows(shared, own, &shared_prior), shared_prior, {options_.huber, options_.rank_tolerance});
    result_.robust_method = robust.method;
    result_.bandwidth = robust.bandwidth;
    if (robust.method == RobustMethod::kNone) {
      return all;
    }
    const auto fill = [&](const std::vector<int>& which, const RowMatrixXd& covariance,
                          const Eigen::VectorXd& freedom) {
      for (size_t i = 0; i < which.size(); ++i) {
        const int k = free_[which[i]];
        const Eigen::Index at = static_cast<Eigen::Index>(i);
        for (size_t j = 0; j < which.size(); ++j) {
          all(which[i], which[j]) = covariance(at, static_cast<Eigen::Index>(j));
        }
        if (!result_.messages[k].empty() || !(freedom[at] > 0.0)) {
          continue;
        }
        const double deviation = std::sqrt(std::max(0.0, covariance(at, at)));
        result_.standard_deviation_robust[k] = deviation;
        result_.degrees_of_freedom[k] = freedom[at];
        result_.confidence_95_robust[k] =
            IntervalAround(k, StudentQuantile(freedom[at]) * deviation);
      }
    };
    fill(shared, robust.shared, robust.shared_freedom);
    for (int g = 0; g < count; ++g) {
      fill(own[g], robust.own[g], robust.own_freedom[g]);
    }
    return all;
  }

  /// The rows by recording; priors that involve no own parameter go to `shared_prior`.
  std::vector<RecordingRows> Rows(const std::vector<int>& shared,
                                  const std::vector<std::vector<int>>& own,
                                  RowMatrixXd* shared_prior) const {
    std::vector<std::vector<int>> data(own.size()), priors(own.size());
    std::vector<int> of_shared;
    for (size_t i = 0; i < places_.size(); ++i) {
      data[places_[i].recording].push_back(static_cast<int>(i));
    }
    for (Eigen::Index i = num_data(); i < residuals_.size(); ++i) {
      int recording = -1;
      for (size_t k = 0; k < entries_.size(); ++k) {
        if (jacobian_(i, static_cast<Eigen::Index>(k)) != 0.0) {
          recording = std::max(recording, RecordingOf(static_cast<int>(k)));
        }
      }
      (recording < 0 ? of_shared : priors[recording]).push_back(static_cast<int>(i));
    }
    const auto columns = [this](const std::vector<int>& which) {
      std::vector<int> parameters;
      for (const int i : which) {
        parameters.push_back(free_[i]);
      }
      return parameters;
    };
    *shared_prior = jacobian_(of_shared, columns(shared));
    std::vector<RecordingRows> recordings(own.size());
    for (size_t g = 0; g < own.size(); ++g) {
      RecordingRows& rows = recordings[g];
      for (const int i : data[g]) {
        rows.times.push_back(places_[i].time);
      }
      rows.residuals = residuals_(data[g]);
      rows.shared = jacobian_(data[g], columns(shared));
      rows.own = jacobian_(data[g], columns(own[g]));
      rows.prior_residuals = residuals_(priors[g]);
      rows.prior_shared = jacobian_(priors[g], columns(shared));
      rows.prior_own = jacobian_(priors[g], columns(own[g]));
    }
    return recordings;
  }

  void WarnOfCondition(const Decomposition& decomposition) {
    const Eigen::VectorXd direction = RelativeChanges(
        entries_, estimate_, free_, decomposition.Direction(decomposition.size() - 1));
    result_.warnings.push_back("ill-conditioned (" + Short(result_.condition) +
                               "): worst determined are relative changes along " +
                               Combination(entries_, free_, direction) +
                               "; hold one of these parameters or observe more");
  }

  static std::string NameOf(const DeterminedCombination& combination) {
    return combination.sum + " = " + Short(combination.value) + " ± " +
           Short(combination.standard_deviation) +
           (combination.product.empty() ? "" : ", locally the product " + combination.product);
  }

  const std::vector<ParameterizedScene::Entry>& entries_;
  const Eigen::VectorXd& estimate_;
  const Eigen::VectorXd& residuals_;
  const RowMatrixXd& jacobian_;
  const std::vector<ResidualPlace>& places_;
  const UncertaintyOptions& options_;
  std::vector<int> free_;
  Uncertainty result_;
};

}  // namespace

Uncertainty EstimateUncertainty(const std::vector<ParameterizedScene::Entry>& entries,
                                const Eigen::VectorXd& estimate, const Eigen::VectorXd& residuals,
                                const RowMatrixXd& jacobian,
                                const std::vector<ResidualPlace>& places,
                                const UncertaintyOptions& options) {
  return Estimator(entries, estimate, residuals, jacobian, places, options).Run();
}

std::string DescribeRobust(const Uncertainty& uncertainty) {
  switch (uncertainty.robust_method) {
    case RobustMethod::kNone:
      return "robust intervals: none, for there are no more residuals than parameters";
    case RobustMethod::kRecordings:
      return "robust intervals: jackknife over the recordings, Student's t";
    case RobustMethod::kTime:
      return "robust intervals: residuals as they are, correlated over " +
             Short(uncertainty.bandwidth) + " s, Student's t";
  }
  return "";
}

}  // namespace tangible
