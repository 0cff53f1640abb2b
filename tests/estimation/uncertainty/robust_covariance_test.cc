// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/robust_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <random>
#include <tuple>

#include "tangible/estimation/uncertainty/decomposition.h"

namespace tangible {
namespace {

/// A linear model fitted to residuals e, which the fit makes r = e − J δ with δ = J⁺ e.
struct LinearFit {
  std::vector<RecordingRows> recordings;
  Eigen::VectorXd moved;  // δ, the error of the estimate: all shared, then own of each recording
};

/// Recordings with the columns 1 and cos(3 t) shared and, if asked, sin(5 t) as their own.
LinearFit FitLinear(const std::vector<Eigen::VectorXd>& errors, int own) {
  LinearFit fit;
  const Eigen::Index count = static_cast<Eigen::Index>(errors.size());
  const Eigen::Index samples = errors.front().size();
  RowMatrixXd all = RowMatrixXd::Zero(count * samples, 2 + count * own);
  Eigen::VectorXd error(count * samples);
  for (Eigen::Index g = 0; g < count; ++g) {
    for (Eigen::Index i = 0; i < samples; ++i) {
      const double t = 0.05 * static_cast<double>(i);
      const Eigen::Index row = g * samples + i;
      all(row, 0) = 1.0;
      all(row, 1) = std::cos(3.0 * t + static_cast<double>(g));
      if (own > 0) {
        all(row, 2 + g) = std::sin(5.0 * t);
      }
      error[row] = errors[g][i];
    }
  }
  fit.moved = all.colPivHouseholderQr().solve(error);
  const Eigen::VectorXd residuals = error - all * fit.moved;
  for (Eigen::Index g = 0; g < count; ++g) {
    RecordingRows rows;
    for (Eigen::Index i = 0; i < samples; ++i) {
      rows.times.push_back(0.05 * static_cast<double>(i));
    }
    rows.residuals = residuals.segment(g * samples, samples);
    rows.shared = all.block(g * samples, 0, samples, 2);
    rows.own = all.block(g * samples, 2 + g * own, samples, own);
    fit.recordings.push_back(rows);
  }
  return fit;
}

/// First-order autoregression of unit deviation.
Eigen::VectorXd Autoregression(double rho, int samples, std::mt19937* random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  Eigen::VectorXd error(samples);
  double last = normal(*random);
  for (int i = 0; i < samples; ++i) {
    error[i] = last;
    last = rho * last + std::sqrt(1.0 - rho * rho) * normal(*random);
  }
  return error;
}

/// Part of 400 replicas in which the interval of shared parameter k has the true value.
Eigen::Vector2d Coverage(int recordings, double rho, double common, unsigned seed) {
  constexpr int kReplicas = 400;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  Eigen::Vector2d covered = Eigen::Vector2d::Zero();
  for (int replica = 0; replica < kReplicas; ++replica) {
    std::vector<Eigen::VectorXd> errors;
    for (int g = 0; g < recordings; ++g) {
      errors.push_back(3.0 * Autoregression(rho, 400 / recordings, &random));
      errors.back().array() += common * normal(random);
    }
    const LinearFit fit = FitLinear(errors, 1);
    const RobustCovariance robust =
        EstimateRobustCovariance(fit.recordings, RowMatrixXd(0, 2), RobustOptions());
    for (int k = 0; k < 2; ++k) {
      const double half =
          StudentQuantile(robust.shared_freedom[k]) * std::sqrt(robust.shared(k, k));
      covered[k] += std::abs(fit.moved[k]) < half ? 1.0 / kReplicas : 0.0;
    }
  }
  return covered;
}

// Of 400 replicas 0.95 has a deviation of 0.011; four of them.
constexpr double kSpread = 0.044;

TEST(RobustCovarianceTest, CoversWhateverTheSizeOfWhiteResiduals) {
  const Eigen::Vector2d covered = Coverage(1, 0.0, 0.0, 1);
  EXPECT_NEAR(covered[0], 0.95, kSpread);
  EXPECT_NEAR(covered[1], 0.95, kSpread);
}

TEST(RobustCovarianceTest, CoversWithResidualsThatAreCorrelatedInTime) {
  // An interval that takes them as independent covers half: their mean varies three times more.
  const Eigen::Vector2d covered = Coverage(1, 0.8, 0.0, 2);
  EXPECT_GT(covered[0], 0.90);
  EXPECT_GT(covered[1], 0.90);
}

TEST(RobustCovarianceTest, CoversWithRecordingsThatDeviateAsWholes) {
  for (const int recordings : {5, 10}) {
    const Eigen::Vector2d covered = Coverage(recordings, 0.5, 2.0, 3);
    EXPECT_GT(covered[0], 0.91) << recordings;
    EXPECT_GT(covered[1], 0.91) << recordings;
  }
}

TEST(RobustCovarianceTest, KernelAndFreedomAreTheirSums) {
  std::mt19937 random(4);
  LinearFit fit = FitLinear({Autoregression(0.7, 60, &random)}, 0);
  RecordingRows& rows = fit.recordings[0];
  rows.times[20] = rows.times[19];  // two at the same time, and a gap
  for (size_t i = 40; i < rows.times.size(); ++i) {
    rows.times[i] += 0.7;
  }
  const RobustCovariance robust =
      EstimateRobustCovariance(fit.recordings, RowMatrixXd(0, 2), RobustOptions());
  const double width = robust.bandwidth;
  ASSERT_GT(width, 0.2);
  const RowMatrixXd normal = (rows.shared.transpose() * rows.shared).inverse();
  RowMatrixXd sum = RowMatrixXd::Zero(2, 2);
  Eigen::Vector2d weights = Eigen::Vector2d::Zero();
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d a = normal * rows.shared.row(i).transpose();
    weights += a.cwiseAbs2();
    for (int j = 0; j < 60; ++j) {
      const Eigen::Vector2d b = normal * rows.shared.row(j).transpose();
      const double k = std::max(0.0, 1.0 - std::abs(rows.times[i] - rows.times[j]) / width);
      sum += k * rows.residuals[i] * rows.residuals[j] * a * b.transpose();
      squares += k * k * a.cwiseAbs2().cwiseProduct(b.cwiseAbs2());
    }
  }
  const double beta = width / (rows.times.back() - rows.times.front());
  const double factor = 60.0 / 58.0 / (1.0 - beta + beta * beta / 3.0);
  // What residuals at one time do not show, equation (5).
  RowMatrixXd hidden = RowMatrixXd::Zero(2, 2);
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) {
      for (int l = 0; l < 60; ++l) {
        if (rows.times[i] != rows.times[j] || rows.times[i] != rows.times[l]) continue;
        const auto leverage = [&](int p, int q) {
          return rows.shared.row(p).dot(normal * rows.shared.row(q).transpose());
        };
        hidden += leverage(i, j) * leverage(i, l) * (normal * rows.shared.row(j).transpose()) *
                  (normal * rows.shared.row(l).transpose()).transpose();
      }
    }
  }
  hidden *= rows.residuals.squaredNorm() / 58.0;
  EXPECT_LT((robust.shared - factor * sum - hidden).norm(), 1e-12 * sum.norm());
  EXPECT_LT(hidden.norm(), 0.01 * sum.norm());
  for (int k = 0; k < 2; ++k) {
    const double seen = factor * sum(k, k);
    const double freedom = weights[k] * weights[k] / squares[k];
    EXPECT_NEAR(robust.shared_freedom[k],
                std::pow(seen + hidden(k, k), 2) /
                    (seen * seen / freedom + std::pow(hidden(k, k), 2) / 58.0),
                1e-9 * robust.shared_freedom[k]);
  }
}

// A force that acts just before the last sample moves that one alone: its residual is 0 whatever
// its error. One that moves two coordinates of it leaves one combination of them 0.
TEST(RobustCovarianceTest, CoversWhatASingleSampleDecides) {
  constexpr int kReplicas = 400;
  constexpr int kSamples = 20;
  for (const auto& [both_coordinates, noise, huber] :
       {std::tuple{false, 1.0, 0.0}, std::tuple{true, 1.0, 0.0}, std::tuple{true, 3.0, 0.0},
        std::tuple{false, 3.0, 1.0}}) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal(0.0, noise);
    double covered = 0.0;
    for (int replica = 0; replica < kReplicas; ++replica) {
      RecordingRows rows;
      rows.shared = RowMatrixXd::Zero(2 * kSamples, 1);
      rows.own = RowMatrixXd::Zero(2 * kSamples, 1);
      Eigen::VectorXd error(2 * kSamples);
      for (int i = 0; i < 2 * kSamples; ++i) {
        rows.times.push_back(0.1 * (i / 2));
        if (i % 2 == 0) rows.own(i, 0) = 1.0;
        error[i] = normal(random);
      }
      rows.shared(2 * kSamples - 2, 0) = both_coordinates ? 0.5 : 0.0;
      rows.shared(2 * kSamples - 1, 0) = 1.0;
      RowMatrixXd all(2 * kSamples, 2);
      all << rows.shared, rows.own;
      const Eigen::Vector2d moved = all.colPivHouseholderQr().solve(error);
      rows.residuals = error - all * moved;
      const RobustCovariance robust =
          EstimateRobustCovariance({rows}, RowMatrixXd(0, 1), {.huber = huber});
      const double half =
          StudentQuantile(robust.shared_freedom[0]) * std::sqrt(robust.shared(0, 0));
      covered += std::abs(moved[0]) < half ? 1.0 / kReplicas : 0.0;
    }
    EXPECT_NEAR(covered, 0.95, kSpread) << both_coordinates << " " << noise << " " << huber;
  }
}

TEST(RobustCovarianceTest, RecordingsAreLeftOutOneByOne) {
  std::mt19937 random(5);
  std::vector<Eigen::VectorXd> errors;
  for (int g = 0; g < 6; ++g) {
    errors.push_back(Autoregression(0.9, 30, &random));
  }
  const LinearFit fit = FitLinear(errors, 1);
  const RobustCovariance robust =
      EstimateRobustCovariance(fit.recordings, RowMatrixXd(0, 2), RobustOptions());
  ASSERT_EQ(robust.method, RobustMethod::kRecordings);
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (int out = 0; out < 6; ++out) {  // by fits without it, in which cosines keep their phases
    RowMatrixXd all = RowMatrixXd::Zero(5 * 30, 7);
    Eigen::VectorXd error(5 * 30);
    for (int g = 0, at = 0; g < 6; ++g) {
      if (g == out) {
        continue;
      }
      all.block(30 * at, 0, 30, 2) = fit.recordings[g].shared;
      all.block(30 * at, 2 + at, 30, 1) = fit.recordings[g].own;
      error.segment(30 * at, 30) = errors[g];
      ++at;
    }
    const Eigen::Vector2d moved =
        all.colPivHouseholderQr().solve(error).head<2>() - fit.moved.head<2>();
    sum += moved * moved.transpose();
  }
  EXPECT_LT((robust.shared - 5.0 / 6.0 * sum).norm(), 1e-12 * sum.norm());
  // All tell nearly the same about the constant.
  EXPECT_NEAR(robust.shared_freedom[0], 5.0, 0.2);
}

TEST(RobustCovarianceTest, APriorIsAMeasurementOfKnownDeviation) {
  std::mt19937 random(6);
  LinearFit fit = FitLinear({Autoregression(0.0, 50, &random)}, 0);
  RowMatrixXd prior(1, 2);
  prior << 1e6, 0.0;  // a deviation of 1e-6
  const RobustCovariance robust = EstimateRobustCovariance(fit.recordings, prior, RobustOptions());
  EXPECT_NEAR(std::sqrt(robust.shared(0, 0)), 1e-6, 1e-9);
  EXPECT_GT(robust.shared_freedom[0], 1e6);
}

TEST(RobustCovarianceTest, NothingWithoutMoreResidualsThanParameters) {
  RecordingRows rows;
  rows.times = {0.0, 1.0};
  rows.residuals = Eigen::Vector2d(1.0, 2.0);
  rows.shared = RowMatrixXd::Identity(2, 2);
  rows.own = RowMatrixXd(2, 0);
  const RobustCovariance robust =
      EstimateRobustCovariance({rows}, RowMatrixXd(0, 2), RobustOptions());
  EXPECT_EQ(robust.method, RobustMethod::kNone);
  EXPECT_TRUE(std::isnan(robust.shared(0, 0)));
}

TEST(RobustCovarianceTest, StudentQuantiles) {
  EXPECT_NEAR(StudentQuantile(1.0), 12.706204736, 1e-8);
  EXPECT_NEAR(StudentQuantile(4.0), 2.7764451052, 1e-9);
  EXPECT_NEAR(StudentQuantile(1e9), 1.9599639845, 1e-8);
}

TEST(DecompositionTest, IsThatOfTheWholeMatrix) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 1.0);
  RowMatrixXd a(1000, 3);
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    a.row(i) << normal(random), 1e6 * normal(random), 0.0;
    a(i, 2) = a(i, 0) + 1e-9 * normal(random);
  }
  const Decomposition decomposition(a, 1e-12);
  EXPECT_EQ(decomposition.rank(), 3);
  // Unit columns 0 and 2 differ by 1e-9: singular values sqrt(2) and 1e-9 / sqrt(2).
  EXPECT_NEAR(decomposition.condition() / 2e9, 1.0, 0.1);
  EXPECT_EQ(Decomposition(a, 1e-6).rank(), 2);
  EXPECT_EQ(Decomposition(RowMatrixXd::Ones(1, 3), 1e-6).rank(), 1);
}

TEST(RobustCovarianceTest, RecordingsThatShareNothingHaveTheirOwnIntervals) {
  std::vector<RecordingRows> recordings(6);
  for (RecordingRows& rows : recordings) {
    rows.times = {0.0, 1.0, 2.0, 3.0};
    rows.residuals = Eigen::Vector4d(1.0, -1.0, 1.0, -1.0);
    rows.shared = RowMatrixXd(4, 0);
    rows.own = RowMatrixXd::Ones(4, 1);
    rows.prior_residuals = Eigen::VectorXd(0);
    rows.prior_shared = RowMatrixXd(0, 0);
    rows.prior_own = RowMatrixXd(0, 1);
  }
  const RobustCovariance robust =
      EstimateRobustCovariance(recordings, RowMatrixXd(0, 0), RobustOptions());
  EXPECT_EQ(robust.method, RobustMethod::kTime);
  ASSERT_EQ(robust.own.size(), 6U);
  EXPECT_GT(robust.own[0](0, 0), 0.0);
}

}  // namespace
}  // namespace tangible
