// SPDX-License-Identifier: Apache-2.0
//
// Fits with priors (problem_with_priors.h).
#include <gtest/gtest.h>

#include <cmath>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/fit.h"

namespace tangible {
namespace {

FitResult FitGravity(const std::optional<Prior>& prior, double huber = 0.0) {
  const Scene scene = MakeScene(kFallingBall);
  FitParameter gravity = Parameter("gravity/y", -9.0);
  gravity.prior = prior;
  RolloutResiduals residuals = MakeResiduals(
      scene, {}, {gravity, Parameter("bodies/ball/velocity/x", 0.5)}, Observe(scene, 5, 0.01, 3));
  FitOptions options;
  options.huber = huber;
  return Fit(options, &residuals, {});
}

TEST(PriorFitTest, APriorOfTheSameDeviationHalvesTheWay) {
  const FitResult plain = FitGravity(std::nullopt);
  ASSERT_EQ(plain.status, FitStatus::kConverged) << plain.message;
  const double deviation = plain.uncertainty.standard_deviation[0];
  const FitResult both =
      FitGravity(Prior{PriorKind::kGaussian, plain.estimate[0] + 0.2, deviation});
  ASSERT_EQ(both.status, FitStatus::kConverged) << both.message;
  // Positions are linear in gravity: precisions add, and the estimate is the mean of both.
  EXPECT_NEAR(both.estimate[0], plain.estimate[0] + 0.1, 1e-8);
  EXPECT_NEAR(both.uncertainty.standard_deviation[0], deviation / std::sqrt(2.0), 1e-8 * deviation);
  EXPECT_NEAR(both.uncertainty.prior_share[0], 0.5, 1e-8);
  EXPECT_NEAR(both.uncertainty.prior_share[1], 0.0, 1e-8);
  EXPECT_NEAR(both.estimate[1], plain.estimate[1], 1e-8);
  EXPECT_EQ(both.residuals.size(), plain.residuals.size()) << "of observations alone";
  EXPECT_NEAR(both.final_cost - plain.final_cost, 0.25 * std::pow(0.2 / deviation, 2),
              1e-6 * both.final_cost);
}

TEST(PriorFitTest, TheRobustLossIsNotOfPriors) {
  // 1000 deviations away: Huber's loss would let the prior go.
  const FitResult plain = FitGravity(std::nullopt, 3.0);
  const FitResult held =
      FitGravity(Prior{PriorKind::kGaussian, plain.estimate[0] + 1.0, 1e-6}, 3.0);
  EXPECT_NEAR(held.estimate[0], plain.estimate[0] + 1.0, 1e-3);
}

TEST(PriorFitTest, ALogNormalPriorActsOnRatios) {
  const Scene scene = MakeScene(kFallingBall);  // damping 0.3
  FitParameter damping = Parameter("bodies/ball/linear_damping", 0.1);
  damping.prior = Prior{PriorKind::kLogNormal, 0.6, 1e-5};
  RolloutResiduals residuals = MakeResiduals(scene, {}, {damping}, Observe(scene, 20, 1.0, 3));
  const FitResult result = Fit(FitOptions(), &residuals, {});
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  EXPECT_NEAR(result.estimate[0], 0.6, 1e-6);
  EXPECT_NEAR(result.uncertainty.standard_deviation[0], 0.6e-5, 1e-9);
  EXPECT_NEAR(result.uncertainty.prior_share[0], 1.0, 1e-6);
}

TEST(PriorFitTest, APriorThatTheDataContradictIsNamed) {
  const auto warns = [](const FitResult& fit) {
    return fit.uncertainty.contradicts_prior &&
           fit.uncertainty.warnings.front().rfind(
               "the observations contradict the prior of 'gravity/y'", 0) == 0;
  };
  const FitResult plain = FitGravity(std::nullopt);
  const double deviation = plain.uncertainty.standard_deviation[0];
  // The estimate is the mean of both: half of the way is 10 of its sigma, or 2.
  EXPECT_TRUE(warns(
      FitGravity(Prior{PriorKind::kGaussian, plain.estimate[0] + 20.0 * deviation, deviation})));
  EXPECT_FALSE(
      FitGravity(Prior{PriorKind::kGaussian, plain.estimate[0] + 4.0 * deviation, deviation})
          .uncertainty.contradicts_prior);
  EXPECT_FALSE(plain.uncertainty.contradicts_prior);
}

// Every seventh observation is a metre off: what Huber's loss is there for.
TEST(PriorFitTest, OutliersAreNoReasonToDoubtSigmaWithHubersLoss) {
  const Scene scene = MakeScene(kFallingBall);
  std::vector<Observation> observations = Observe(scene, 2, 0.01, 3);
  const auto fit = [&](double scale) {
    std::vector<Observation> seen = observations;
    for (size_t i = 0; i < seen.size(); ++i) {
      seen[i].sigma *= scale;
      if (i % 7 == 0) seen[i].value += 1.0;
    }
    RolloutResiduals residuals = MakeResiduals(
        scene, {}, {Parameter("gravity/y", -9.0), Parameter("bodies/ball/velocity/x", 0.5)}, seen);
    FitOptions options;
    options.huber = 1.5;
    return Fit(options, &residuals, {});
  };
  const FitResult right = fit(1.0);
  ASSERT_EQ(right.status, FitStatus::kConverged) << right.message;
  EXPECT_NEAR(right.estimate[0], -9.81, 0.05);
  EXPECT_GT(right.uncertainty.reduced_chi_square, 100.0);
  EXPECT_FALSE(right.uncertainty.too_large);
  // A sigma that is three times too small is still said.
  EXPECT_TRUE(fit(1.0 / 3.0).uncertainty.too_large);
}

}  // namespace
}  // namespace tangible
