// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/uncertainty/residual_quality.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tangible {
namespace {

/// One series of rows a block, without parameters.
class Rows : public LeastSquaresProblem {
 public:
  explicit Rows(int count) : count_(count) {}
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 0; }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int /*block*/) const override { return count_; }
  std::vector<RowPlace> Places(int /*block*/) const override {
    std::vector<RowPlace> places;
    for (int i = 0; i < count_; ++i) {
      places.push_back({0, 0.1 * i, 0.0});
    }
    return places;
  }
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& /*p*/, GradientMethod /*method*/,
                     BlockDerivatives /*derivatives*/, BlockEvaluation* /*evaluation*/) override {
    return false;
  }

 private:
  int count_;
  std::vector<ParameterEntry> entries_;
};

ResidualQuality Judge(const Eigen::VectorXd& residuals) {
  BlockEvaluation block;
  block.residuals = residuals;
  return JudgeResiduals(Rows(static_cast<int>(residuals.size())), {block}, 2);
}

TEST(ResidualQualityTest, DistinguishesNoiseFromAMissingModel) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0.0, 1.0);
  Eigen::VectorXd noise(300);
  Eigen::VectorXd wave(300);
  for (int i = 0; i < 300; ++i) {
    noise[i] = normal(random);
    wave[i] = 3.0 * std::sin(0.1 * i) + noise[i];
  }
  const ResidualQuality fine = Judge(noise);
  EXPECT_FALSE(fine.DoesNotFit());
  EXPECT_FALSE(fine.MayBeLocal());
  EXPECT_NEAR(fine.reduced_chi_square, noise.squaredNorm() / 298.0, 1e-12);
  // A sigma that is ten times too small.
  const ResidualQuality large = Judge(10.0 * noise);
  EXPECT_TRUE(large.too_large);
  EXPECT_FALSE(large.MayBeLocal());
  // Correlated however large sigma is.
  for (const double factor : {1.0, 0.01}) {
    const ResidualQuality missing = Judge(factor * wave);
    EXPECT_EQ(missing.too_large, factor == 1.0);
    EXPECT_TRUE(missing.correlated);
    EXPECT_TRUE(missing.MayBeLocal());
  }
  // Of few residuals the correlation is not known.
  EXPECT_TRUE(Judge(10.0 * noise.head(12)).MayBeLocal());
}

}  // namespace
}  // namespace tangible
