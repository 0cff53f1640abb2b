// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "tangible/math/scalar.h"

namespace tangible {
namespace {

std::vector<ParameterEntry> Entries(int count) {
  std::vector<ParameterEntry> entries;
  entries.reserve(count);
  for (int k = 0; k < count; ++k) {
    entries.push_back({std::string(1, static_cast<char>('a' + k)), 1.0, -kInfinity, kInfinity});
  }
  return entries;
}

/// Rows that are there already, of one or several blocks.
class RowsProblem : public LeastSquaresProblem {
 public:
  RowsProblem(std::vector<ParameterEntry> entries, int num_shared,
              const std::vector<BlockEvaluation>& blocks, std::vector<std::vector<RowPlace>> places)
      : entries_(std::move(entries)),
        num_shared_(num_shared),
        blocks_(blocks),
        places_(std::move(places)) {}
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return num_shared_; }
  int num_blocks() const override { return static_cast<int>(blocks_.size()); }
  int num_own(int block) const override {
    return static_cast<int>(blocks_[block].jacobian.cols()) - num_shared_;
  }
  int num_rows(int block) const override {
    return static_cast<int>(blocks_[block].residuals.size());
  }
  int num_observation_rows(int block) const override {
    return places_[block].empty() ? num_rows(block) : static_cast<int>(places_[block].size());
  }
  std::vector<RowPlace> Places(int block) const override { return places_[block]; }
  bool EvaluateBlock(int, const Eigen::VectorXd&, GradientMethod, BlockDerivatives,
                     BlockEvaluation*) override {
    return false;
  }

 private:
  std::vector<ParameterEntry> entries_;
  int num_shared_;
  const std::vector<BlockEvaluation>& blocks_;
  std::vector<std::vector<RowPlace>> places_;
};

/// One block, all of whose parameters are shared; rows without a place are of priors.
Uncertainty EstimateUncertainty(const std::vector<ParameterEntry>& entries,
                                const Eigen::VectorXd& estimate, const Eigen::VectorXd& residuals,
                                const RowMatrixXd& jacobian, const std::vector<RowPlace>& places,
                                const UncertaintyOptions& options) {
  std::vector<BlockEvaluation> blocks(1);
  blocks[0].residuals = residuals;
  blocks[0].jacobian = jacobian;
  return EstimateUncertainty(
      RowsProblem(entries, static_cast<int>(entries.size()), blocks, {places}), estimate, blocks,
      options);
}

TEST(UncertaintyTest, CovarianceIsTheInverseOfTheNormalMatrix) {
  RowMatrixXd jacobian(4, 2);
  jacobian << 1, 2, 3, -1, 0, 5, 2e3, 1;
  const Eigen::Vector4d residuals(1.0, -2.0, 0.5, 0.25);
  const Uncertainty result =
      EstimateUncertainty(Entries(2), Eigen::Vector2d(3.0, 4.0), residuals, jacobian, {}, {});
  const Eigen::Matrix2d expected = (jacobian.transpose() * jacobian).inverse();
  EXPECT_LT((result.covariance - expected).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_NEAR(result.standard_deviation[1], std::sqrt(expected(1, 1)), 1e-14);
  ASSERT_TRUE(result.confidence_95[0]);
  EXPECT_NEAR(result.confidence_95[0]->second - 3.0, 1.959964 * result.standard_deviation[0],
              1e-6 * result.standard_deviation[0]);
  EXPECT_NEAR(result.residual_rms, std::sqrt(residuals.squaredNorm() / 4.0), 1e-15);
  EXPECT_NEAR(result.reduced_chi_square, residuals.squaredNorm() / 2.0, 1e-15);
}

TEST(UncertaintyTest, ResidualsBeyondHuberDoNotCount) {
  RowMatrixXd jacobian(3, 1);
  jacobian << 1, 2, 100;
  UncertaintyOptions options;
  options.huber = 3.0;
  const Uncertainty result = EstimateUncertainty(
      Entries(1), Eigen::VectorXd::Ones(1), Eigen::Vector3d(1, -2.5, 4), jacobian, {}, options);
  EXPECT_NEAR(result.covariance(0, 0), 0.2, 1e-15);
}

TEST(UncertaintyTest, FewerResidualsThanParameters) {
  RowMatrixXd jacobian(1, 2);
  jacobian << 1, -1;
  const Uncertainty result = EstimateUncertainty(Entries(2), Eigen::Vector2d::Ones(),
                                                 Eigen::VectorXd::Zero(1), jacobian, {}, {});
  EXPECT_FALSE(result.confidence_95[0]);
  EXPECT_FALSE(result.confidence_95[1]);
  EXPECT_TRUE(std::isnan(result.reduced_chi_square));
  EXPECT_FALSE(result.messages[0].empty());
}

TEST(UncertaintyTest, AnUndeterminedPairLeavesTheOthersTheirIntervals) {
  RowMatrixXd jacobian(4, 3);
  jacobian << 1, 2, 0, 2, 4, 0, 0, 0, 5, -1, -2, 1;
  const Uncertainty result = EstimateUncertainty(Entries(3), Eigen::Vector3d(2.0, 1.0, 1.0),
                                                 Eigen::Vector4d::Zero(), jacobian, {}, {});
  EXPECT_FALSE(result.confidence_95[0]);
  EXPECT_FALSE(result.confidence_95[1]);
  EXPECT_TRUE(result.confidence_95[2]);
  // a + 2 b is measured, so a - 2 da = -2 db: equal and opposite relative changes where a = 2 b.
  ASSERT_EQ(result.warnings.size(), 2u);
  EXPECT_NE(result.warnings[0].find("1 'a' - 1 'b'"), std::string::npos) << result.warnings[0];
  ASSERT_EQ(result.combinations.size(), 1u);
  EXPECT_NE(result.warnings[1].find("the observations do determine 'a' + 2 'b' = 4"),
            std::string::npos)
      << result.warnings[1];
  // Of a + 2 b alone: Σ J² = 1 + 4 + 1 in multiples of it, less what c takes of the last row.
  EXPECT_NEAR(result.combinations[0].standard_deviation, std::sqrt(1.0 / (6.0 - 1.0 / 26.0)),
              1e-12);
}

TEST(UncertaintyTest, IllConditionAndMisfitAreWarnedOf) {
  RowMatrixXd jacobian(3, 2);
  jacobian << 1, 1, 1, 1 + 1e-6, 1, 1;
  const Uncertainty result = EstimateUncertainty(Entries(2), Eigen::Vector2d::Ones(),
                                                 Eigen::Vector3d(50, 50, 50), jacobian, {}, {});
  ASSERT_EQ(result.warnings.size(), 3u);
  EXPECT_NE(result.warnings[0].find("larger than sigma explains"), std::string::npos);
  EXPECT_NE(result.warnings[1].find("ill-conditioned"), std::string::npos);
  EXPECT_NE(result.warnings[2].find("do determine 'a' + 1 'b' = 2"), std::string::npos)
      << result.warnings[2];
}

/// A line through measurements that a parabola made.
Uncertainty FitLineToParabola(double sigma) {
  constexpr int kCount = 100;
  RowMatrixXd jacobian(kCount, 2);
  Eigen::VectorXd observed(kCount);
  std::vector<RowPlace> places;
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 0.01);
  for (int i = 0; i < kCount; ++i) {
    const double t = 0.02 * i - 1.0;
    jacobian.row(i) << 1.0 / sigma, t / sigma;
    observed[i] = (t * t + normal(random)) / sigma;
    places.push_back({0, t, 0.0});
  }
  const Eigen::Vector2d estimate = jacobian.colPivHouseholderQr().solve(observed);
  return EstimateUncertainty(Entries(2), estimate, jacobian * estimate - observed, jacobian, places,
                             {});
}

TEST(UncertaintyTest, AnInflatedSigmaNeitherSilencesTheWarningNorWidensTheRobustInterval) {
  const Uncertainty fair = FitLineToParabola(0.01);
  const Uncertainty inflated = FitLineToParabola(1e3);
  const auto warns = [](const Uncertainty& uncertainty) {
    return std::any_of(uncertainty.warnings.begin(), uncertainty.warnings.end(),
                       [](const std::string& warning) {
                         return warning.find("correlated in time") != std::string::npos;
                       });
  };
  EXPECT_TRUE(warns(fair));
  EXPECT_TRUE(warns(inflated));
  EXPECT_GT(fair.reduced_chi_square, 100.0);
  EXPECT_LT(inflated.reduced_chi_square, 1e-6);
  ASSERT_TRUE(fair.confidence_95_robust[1] && inflated.confidence_95_robust[1]);
  EXPECT_NEAR(inflated.standard_deviation_robust[1] / fair.standard_deviation_robust[1], 1.0, 1e-9);
  EXPECT_GT(fair.standard_deviation_robust[0], 10.0 * fair.standard_deviation[0]);
  EXPECT_EQ(fair.robust_method, RobustMethod::kTime);
}

TEST(UncertaintyTest, PriorsShareTheInformation) {
  // a is measured four times with deviation 1, its prior has 0.5; b has its measurements alone.
  RowMatrixXd jacobian = RowMatrixXd::Zero(9, 2);
  jacobian.topLeftCorner(4, 1).setOnes();
  jacobian.block(4, 1, 4, 1).setOnes();
  jacobian(8, 0) = 2.0;
  std::vector<RowPlace> places;
  for (int i = 0; i < 8; ++i) {
    places.push_back({i / 4, 0.1 * i, 0.0});
  }
  Eigen::VectorXd residuals = Eigen::VectorXd::Zero(9);
  residuals << 1, -1, 1, -1, 1, -1, 1, -1, 30;
  const Uncertainty result =
      EstimateUncertainty(Entries(2), Eigen::Vector2d::Ones(), residuals, jacobian, places, {});
  EXPECT_NEAR(result.prior_share[0], 0.5, 1e-14);
  EXPECT_EQ(result.prior_share[1], 0.0);
  EXPECT_NEAR(result.covariance(0, 0), 1.0 / 8.0, 1e-14);
  EXPECT_NEAR(result.residual_rms, 1.0, 1e-14) << "a prior is no measurement";
}

/// Rows of normal numbers: 3 blocks with 2 shared parameters and 2 own each.
std::vector<BlockEvaluation> RandomBlocks(int rows) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<BlockEvaluation> blocks(3);
  for (BlockEvaluation& block : blocks) {
    block.residuals = Eigen::VectorXd::Zero(rows);
    block.jacobian = RowMatrixXd::Zero(rows, 4);
    for (Eigen::Index i = 0; i < rows; ++i) {
      block.residuals[i] = normal(random);
      for (Eigen::Index k = 0; k < 4; ++k) {
        block.jacobian(i, k) = normal(random);
      }
    }
  }
  return blocks;
}

TEST(UncertaintyTest, BlocksGiveWhatTheWholeMatrixGives) {
  const std::vector<BlockEvaluation> blocks = RandomBlocks(20);
  RowMatrixXd whole = RowMatrixXd::Zero(60, 8);
  Eigen::VectorXd residuals(60);
  std::vector<std::vector<RowPlace>> places(3);
  for (int b = 0; b < 3; ++b) {
    whole.block(20 * b, 0, 20, 2) = blocks[b].jacobian.leftCols(2);
    whole.block(20 * b, 2 + 2 * b, 20, 2) = blocks[b].jacobian.rightCols(2);
    residuals.segment(20 * b, 20) = blocks[b].residuals;
    for (int i = 0; i < 20; ++i) {
      places[b].push_back({0, 0.1 * i, 0.0});
    }
  }
  const RowsProblem problem(Entries(8), 2, blocks, places);
  const Uncertainty result =
      EstimateUncertainty(problem, Eigen::VectorXd::Ones(8), blocks, UncertaintyOptions());
  const Eigen::MatrixXd expected = (whole.transpose() * whole).inverse();
  EXPECT_LT((result.covariance - expected).cwiseAbs().maxCoeff(), 1e-14);
  for (int k = 0; k < 8; ++k) {
    EXPECT_NEAR(result.standard_deviation[k], std::sqrt(expected(k, k)), 1e-14);
    ASSERT_TRUE(result.confidence_95_robust[k]) << k;
    // White residuals of unit size: the robust deviation is about the other one.
    EXPECT_NEAR(result.standard_deviation_robust[k] / result.standard_deviation[k], 1.0, 0.6) << k;
  }
}

TEST(UncertaintyTest, WhatABlockDoesNotDetermineTakesNoOtherInterval) {
  std::vector<BlockEvaluation> blocks = RandomBlocks(20);
  blocks[1].jacobian.col(3) = -2.0 * blocks[1].jacobian.col(2);  // 'e' and 'f'
  const RowsProblem problem(Entries(8), 2, blocks, {{}, {}, {}});
  const Uncertainty result =
      EstimateUncertainty(problem, Eigen::VectorXd::Ones(8), blocks, UncertaintyOptions());
  for (int k = 0; k < 8; ++k) {
    EXPECT_EQ(result.confidence_95[k].has_value(), k != 4 && k != 5) << k;
  }
  ASSERT_EQ(result.combinations.size(), 1u);
  EXPECT_EQ(result.combinations[0].sum, "'e' - 2 'f'");
}

// A derivative that is rounding, as of a cost that is flat about the estimate, determines nothing,
// of a parameter that is shared or a recording's own; sizes of parameters do not matter.
TEST(UncertaintyTest, ADerivativeThatIsRoundingDeterminesNothing) {
  for (const int num_shared : {0, 1}) {
    for (const double size : {1e-6, 1.0, 1e6}) {
      std::vector<BlockEvaluation> blocks(1);
      blocks[0].residuals = Eigen::Vector4d(1.0, -2.0, 0.5, 0.25);
      std::vector<ParameterEntry> entries = Entries(1);
      entries[0].scale = size;
      const auto deviation = [&](double derivative) {
        blocks[0].jacobian =
            RowMatrixXd(Eigen::Vector4d(1.0, 0.5, 0.0, -1.0) * (derivative / size));
        const RowsProblem problem(entries, num_shared, blocks, {{}});
        return EstimateUncertainty(problem, Eigen::VectorXd::Constant(1, size), blocks, {});
      };
      const Uncertainty flat = deviation(1e-16);
      EXPECT_TRUE(std::isnan(flat.standard_deviation[0])) << flat.standard_deviation[0];
      EXPECT_NE(flat.messages[0].find("not determined"), std::string::npos) << flat.messages[0];
      EXPECT_FALSE(flat.confidence_95[0]);
      EXPECT_FALSE(flat.confidence_95_robust[0]);
      const Uncertainty weak = deviation(1e-6);
      EXPECT_NEAR(weak.standard_deviation[0], 1e6 * size / 1.5, 1e-6 * 1e6 * size);
    }
  }
}

}  // namespace
}  // namespace tangible
