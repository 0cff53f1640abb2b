// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/uncertainty.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace tangible {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kNormalQuantile = 1.959963984540054;  // of 0.975
// A parameter whose share in a direction that is not determined is smaller than this is taken as
// determined.
constexpr double kSmallShare = 1e-4;
// Of the reduced chi-square above 1, in its standard deviations sqrt(2 / (N - P)).
constexpr double kChiSquareDeviations = 5.0;

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

/// Rows of J that count and columns that are free.
RowMatrixXd FreePart(const Eigen::VectorXd& residuals, const RowMatrixXd& jacobian,
                     const std::vector<int>& free, double huber) {
  RowMatrixXd part = RowMatrixXd::Zero(jacobian.rows(), static_cast<Eigen::Index>(free.size()));
  for (Eigen::Index i = 0; i < jacobian.rows(); ++i) {
    if (huber > 0.0 && std::abs(residuals[i]) > huber) {
      continue;
    }
    for (size_t k = 0; k < free.size(); ++k) {
      part(i, static_cast<Eigen::Index>(k)) = jacobian(i, free[k]);
    }
  }
  return part;
}

class Decomposition {
 public:
  Decomposition(const RowMatrixXd& jacobian, double tolerance) {
    length_ = jacobian.colwise().norm();
    for (double& length : length_) {
      length = length > 0.0 ? length : 1.0;
    }
    const RowMatrixXd scaled = jacobian * length_.cwiseInverse().asDiagonal();
    svd_.compute(scaled, Eigen::ComputeFullV);
    const Eigen::VectorXd& s = svd_.singularValues();
    rank_ = 0;
    while (rank_ < s.size() && s[rank_] > tolerance * s[0]) {
      ++rank_;
    }
  }
  Eigen::Index rank() const { return rank_; }
  Eigen::Index size() const { return length_.size(); }
  double condition() const {
    const Eigen::VectorXd& s = svd_.singularValues();
    const bool full = s.size() == size() && s.size() > 0 && s[s.size() - 1] > 0.0;
    return full ? s[0] / s[s.size() - 1] : std::numeric_limits<double>::infinity();
  }
  /// A right singular vector in unscaled columns.
  Eigen::VectorXd Direction(Eigen::Index i) const {
    return svd_.matrixV().col(i).cwiseQuotient(length_);
  }
  /// Sum over the determined directions.
  Eigen::MatrixXd Covariance() const {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size(), size());
    for (Eigen::Index i = 0; i < rank_; ++i) {
      const Eigen::VectorXd v = Direction(i) / svd_.singularValues()[i];
      sum += v * v.transpose();
    }
    return sum;
  }

 private:
  Eigen::VectorXd length_;
  Eigen::JacobiSVD<Eigen::MatrixXd> svd_;
  Eigen::Index rank_ = 0;
};

/// Names the directions without information and takes the intervals of their parameters away.
void MarkUndetermined(const std::vector<ParameterizedScene::Entry>& entries,
                      const Eigen::VectorXd& estimate, const std::vector<int>& free,
                      const Decomposition& decomposition, Uncertainty* result) {
  for (Eigen::Index i = decomposition.rank(); i < decomposition.size(); ++i) {
    Eigen::VectorXd direction = decomposition.Direction(i);
    for (size_t k = 0; k < free.size(); ++k) {
      const double magnitude = std::abs(estimate[free[k]]);
      direction[static_cast<Eigen::Index>(k)] /=
          magnitude > 0.0 ? magnitude : entries[free[k]].scale;
    }
    const std::string combination = Combination(entries, free, direction);
    result->warnings.push_back("not determined by the observations: relative changes along " +
                               combination);
    const double largest = direction.cwiseAbs().maxCoeff();
    for (size_t k = 0; k < free.size(); ++k) {
      if (std::abs(direction[static_cast<Eigen::Index>(k)]) >= kSmallShare * largest) {
        result->messages[free[k]] = "not determined: the observations do not fix " + combination;
      }
    }
  }
}

void FillCovariance(const std::vector<int>& free, const Eigen::MatrixXd& covariance,
                    const Eigen::VectorXd& estimate, Uncertainty* result) {
  for (size_t i = 0; i < free.size(); ++i) {
    if (!result->messages[free[i]].empty()) {
      continue;
    }
    for (size_t j = 0; j < free.size(); ++j) {
      if (result->messages[free[j]].empty()) {
        result->covariance(free[i], free[j]) =
            covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      }
    }
    const double deviation = std::sqrt(result->covariance(free[i], free[i]));
    const double p = estimate[free[i]];
    result->standard_deviation[free[i]] = deviation;
    result->confidence_95[free[i]] = {p - kNormalQuantile * deviation,
                                      p + kNormalQuantile * deviation};
  }
}

}  // namespace

bool IsAtBound(const ParameterizedScene::Entry& entry, double estimate) {
  // exp(ln bound) and the minimiser's projection come back to a bound within rounding.
  const double slack = 1e-13 * std::max(std::abs(estimate), entry.scale);
  const bool open = entry.logarithmic && entry.lower == 0.0;
  return (!open && estimate <= entry.lower + slack) || estimate >= entry.upper - slack;
}

Uncertainty EstimateUncertainty(const std::vector<ParameterizedScene::Entry>& entries,
                                const Eigen::VectorXd& estimate, const Eigen::VectorXd& residuals,
                                const RowMatrixXd& jacobian, const UncertaintyOptions& options) {
  const int size = static_cast<int>(entries.size());
  Uncertainty result;
  result.covariance = RowMatrixXd::Constant(size, size, kNaN);
  result.standard_deviation = Eigen::VectorXd::Constant(size, kNaN);
  result.confidence_95.resize(size);
  result.messages.resize(size);
  std::vector<int> free;
  for (int k = 0; k < size; ++k) {
    if (IsAtBound(entries[k], estimate[k])) {
      result.messages[k] =
          std::string("at its ") +
          (estimate[k] < 0.5 * (entries[k].lower + entries[k].upper) ? "lower" : "upper") +
          " bound: no interval";
      result.warnings.push_back("'" + entries[k].name + "' is " + result.messages[k]);
    } else {
      free.push_back(k);
    }
  }
  const double count = static_cast<double>(residuals.size());
  const double freedom = count - static_cast<double>(free.size());
  result.residual_rms = std::sqrt(residuals.squaredNorm() / count);
  result.reduced_chi_square = freedom > 0.0 ? residuals.squaredNorm() / freedom : kNaN;
  if (result.reduced_chi_square > 1.0 + kChiSquareDeviations * std::sqrt(2.0 / freedom)) {
    result.warnings.push_back("residuals are larger than sigma explains (reduced chi-square " +
                              Short(result.reduced_chi_square) +
                              "): the model misses something, or sigma is too small, and the "
                              "intervals are too narrow");
  }
  if (free.empty()) {
    return result;
  }
  const Decomposition decomposition(FreePart(residuals, jacobian, free, options.huber),
                                    options.rank_tolerance);
  result.condition = decomposition.condition();
  MarkUndetermined(entries, estimate, free, decomposition, &result);
  FillCovariance(free, decomposition.Covariance(), estimate, &result);
  if (decomposition.rank() == decomposition.size() &&
      result.condition > options.condition_warning) {
    Eigen::VectorXd direction = decomposition.Direction(decomposition.size() - 1);
    for (size_t k = 0; k < free.size(); ++k) {
      const double magnitude = std::abs(estimate[free[k]]);
      direction[static_cast<Eigen::Index>(k)] /=
          magnitude > 0.0 ? magnitude : entries[free[k]].scale;
    }
    result.warnings.push_back("ill-conditioned (" + Short(result.condition) +
                              "): worst determined are relative changes along " +
                              Combination(entries, free, direction) +
                              "; hold one of these parameters or observe more");
  }
  return result;
}

}  // namespace tangible
