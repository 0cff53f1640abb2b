// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/posterior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "../../support/block_problem.h"
#include "tangible/estimation/problem/problem_with_priors.h"

namespace tangible {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// A problem of one parameter p, with residuals p − y_i.
class MeanProblem : public LeastSquaresProblem {
 public:
  MeanProblem(ParameterEntry entry, std::vector<double> observed)
      : entries_{std::move(entry)}, observed_(std::move(observed)) {}
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 1; }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int /*block*/) const override { return static_cast<int>(observed_.size()); }
  std::vector<RowPlace> Places(int /*block*/) const override {
    return std::vector<RowPlace>(observed_.size());
  }
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives /*derivatives*/, BlockEvaluation* evaluation) override {
    evaluation->residuals.resize(num_rows(0));
    for (int i = 0; i < num_rows(0); ++i) evaluation->residuals[i] = p[0] - observed_[i];
    evaluation->jacobian = RowMatrixXd::Ones(num_rows(0), 1);
    return true;
  }

 private:
  std::vector<ParameterEntry> entries_;
  std::vector<double> observed_;
};

/// The problem with the priors of its entries, a new one each time.
template <typename Problem>
ProblemMaker MakerWithPriors(const std::function<Problem()>& make) {
  struct Both {
    Problem problem;
    ProblemWithPriors with_priors;
    explicit Both(Problem made) : problem(std::move(made)), with_priors(&problem, {}) {}
  };
  return [make]() -> std::shared_ptr<LeastSquaresProblem> {
    const auto both = std::make_shared<Both>(make());
    return {both, &both->with_priors};
  };
}

struct Drawn {
  FitResult fit;
  Posterior posterior;
  std::string error;
};

Drawn Draw(const ProblemMaker& maker, const PosteriorOptions& options = {}, double huber = 0.0) {
  Drawn drawn;
  FitOptions fit;
  fit.huber = huber;
  fit.profile_pass = ProfilePass::kSkip;
  const std::shared_ptr<LeastSquaresProblem> problem = maker();
  drawn.fit = Fit(fit, problem.get(), {});
  SamplePosterior(options, fit, drawn.fit, FreeCoordinates(problem->entries(), {}), maker, {}, {},
                  &drawn.posterior, &drawn.error);
  return drawn;
}

Drawn DrawMean(const ParameterEntry& entry, const std::vector<double>& observed, int draws = 8000,
               double huber = 0.0) {
  PosteriorOptions options;
  options.draws = draws;
  return Draw(MakerWithPriors<MeanProblem>([=] { return MeanProblem(entry, observed); }), options,
              huber);
}

/// A mean, to four of its standard errors.
void ExpectMean(const ChainStatistics& of, double expected) {
  EXPECT_LT(of.r_hat, 1.02);
  EXPECT_NEAR(of.mean, expected, 4.0 * of.deviation / std::sqrt(of.ess_bulk));
}

TEST(FreeCoordinateTest, DerivativesAreThoseOfTheValues) {
  for (const FreeCoordinate& coordinate :
       {FreeCoordinate{-1.0, 3.0}, FreeCoordinate{0.5, kUnbounded},
        FreeCoordinate{-kUnbounded, 2.0}, FreeCoordinate{-kUnbounded, kUnbounded},
        FreeCoordinate{0.0, kUnbounded, true}, FreeCoordinate{0.5, 4.0, true}}) {
    for (const double x : {-3.0, -0.4, 0.3, 2.5}) {
      const FreeCoordinate::Value at = coordinate.At(x);
      EXPECT_NEAR(coordinate.From(at.p), x, 1e-12);
      if (!coordinate.of_logarithm) {
        EXPECT_NEAR(at.log_factor, std::log(std::abs(at.first)), 1e-12);
      } else {
        EXPECT_NEAR(at.log_factor, std::log(at.first / at.p), 1e-12);
      }
      for (const double h : {1e-4, 1e-5}) {
        const FreeCoordinate::Value up = coordinate.At(x + h);
        const FreeCoordinate::Value down = coordinate.At(x - h);
        // Central differences: h² of the third derivative and rounding over h.
        EXPECT_NEAR((up.p - down.p) / (2.0 * h), at.first, 1e-6);
        EXPECT_NEAR((up.first - down.first) / (2.0 * h), at.second, 1e-6);
        EXPECT_NEAR((up.log_factor - down.log_factor) / (2.0 * h), at.log_factor_first, 1e-6);
        EXPECT_NEAR((up.log_factor_first - down.log_factor_first) / (2.0 * h), at.log_factor_second,
                    1e-6);
      }
    }
  }
  // Far out values are those of the bounds and still finite.
  const FreeCoordinate::Value far = FreeCoordinate{-1.0, 3.0}.At(800.0);
  EXPECT_EQ(far.p, 3.0);
  EXPECT_TRUE(std::isfinite(far.log_factor));
}

TEST(PosteriorTest, OfANormalDensity) {
  const Drawn drawn =
      DrawMean({"p", 0.0, -kUnbounded, kUnbounded, false, 1.0}, {1.0, 2.0, 3.0, 4.0});
  ASSERT_EQ(drawn.error, "");
  const ChainStatistics& of = drawn.posterior.parameters[0];
  ExpectMean(of, 2.5);
  EXPECT_NEAR(of.deviation, 0.5, 0.025);
  EXPECT_NEAR(of.low, 2.5 - 0.98, 0.06);
  EXPECT_NEAR(of.high, 2.5 + 0.98, 0.06);
  EXPECT_EQ(drawn.posterior.draws.rows(), 8000);
  EXPECT_EQ(drawn.posterior.transitions, 8000);
  EXPECT_EQ(drawn.posterior.chain_of.front(), 0);
  EXPECT_EQ(drawn.posterior.chain_of.back(), 3);
  for (Eigen::Index i = 0; i < 8000; i += 1000) {
    const double p = drawn.posterior.draws(i, 0);
    EXPECT_NEAR(
        drawn.posterior.costs[i],
        0.5 * (std::pow(p - 1, 2) + std::pow(p - 2, 2) + std::pow(p - 3, 2) + std::pow(p - 4, 2)),
        1e-9);
  }
}

// The estimate is at the bound, where x is infinite: half of a normal density.
TEST(PosteriorTest, AtABound) {
  for (const double upper : {kUnbounded, 50.0}) {
    const Drawn drawn = DrawMean({"p", 1.0, 0.0, upper, false, 1.0}, {0.0});
    ASSERT_EQ(drawn.error, "");
    const ChainStatistics& of = drawn.posterior.parameters[0];
    ExpectMean(of, std::sqrt(2.0 / M_PI));
    EXPECT_NEAR(of.deviation, std::sqrt(1.0 - 2.0 / M_PI), 0.03);
    EXPECT_GT(drawn.posterior.draws.minCoeff(), 0.0);
    FitResult result = drawn.fit;
    TakeIntervals(drawn.posterior, &result);
    EXPECT_EQ(result.intervals[0].method, "posterior");
    EXPECT_GT(*result.intervals[0].low, 0.0);
    EXPECT_NEAR(*result.intervals[0].low, 0.0313, 0.015);  // P(|x| < 0.0313) = 0.025
    EXPECT_NEAR(*result.intervals[0].high, 2.2414, 0.12);
  }
}

// A cost that rises linearly from the bound, ten deviations below which it has its minimum: an
// exponential density, as far as it reaches.
TEST(PosteriorTest, FarBeyondABound) {
  const Drawn drawn = DrawMean({"p", 1.0, 0.0, kUnbounded, true, 1.0}, {-10.0});
  ASSERT_EQ(drawn.error, "");
  // E p of exp(−(p + 10)² / 2) over p > 0: φ(10) / Q(10) − 10.
  ExpectMean(drawn.posterior.parameters[0], 0.0980932);
}

TEST(PosteriorTest, APriorOfALogarithmIsOneOfIt) {
  ParameterEntry entry = {"p", 1.0, 0.0, kUnbounded, true, 1.0};
  entry.prior = Prior{PriorKind::kLogNormal, 2.0, 0.6};
  const ProblemMaker maker = MakerWithPriors<MeanProblem>([=] { return MeanProblem(entry, {}); });
  PosteriorOptions options;
  options.draws = 8000;
  const Drawn drawn = Draw(maker, options);
  ASSERT_EQ(drawn.error, "");
  const ChainStatistics& of = drawn.posterior.parameters[0];
  EXPECT_NEAR(std::log(of.median), std::log(2.0), 0.04);
  EXPECT_NEAR(std::log(of.low), std::log(2.0) - 1.96 * 0.6, 0.1);
  EXPECT_NEAR(std::log(of.high), std::log(2.0) + 1.96 * 0.6, 0.1);
  // It is no density of p, in which the median is smaller by exp(0.36).
  ExpectMean(of, 2.0 * std::exp(0.18));
}

// Next to no observation within two bounds: the density is even.
TEST(PosteriorTest, EvenBetweenBounds) {
  const Drawn drawn = DrawMean({"p", 1.0, 1.0, 1.2, false, 1.0}, {1.1});
  ASSERT_EQ(drawn.error, "");
  const ChainStatistics& of = drawn.posterior.parameters[0];
  ExpectMean(of, 1.1);
  EXPECT_NEAR(of.deviation, 0.2 / std::sqrt(12.0), 0.002);
  EXPECT_NEAR(of.low, 1.005, 0.003);
  EXPECT_NEAR(of.high, 1.195, 0.003);
}

// Huber's loss is part of the density: a Laplace density but for the middle.
TEST(PosteriorTest, TheRobustLoss) {
  const double huber = 0.5;
  const Drawn drawn =
      DrawMean({"p", 0.0, -kUnbounded, kUnbounded, false, 1.0}, {0.2, -0.2}, 8000, huber);
  ASSERT_EQ(drawn.error, "");
  double sum = 0.0, squares = 0.0;
  for (double p = -60.0; p < 60.0; p += 0.001) {
    const Eigen::Vector2d r(p - 0.2, p + 0.2);
    double cost = 0.0;
    for (const double x : r) {
      cost += std::abs(x) > huber ? huber * std::abs(x) - 0.5 * huber * huber : 0.5 * x * x;
    }
    sum += std::exp(-cost);
    squares += p * p * std::exp(-cost);
  }
  ExpectMean(drawn.posterior.parameters[0], 0.0);
  EXPECT_NEAR(drawn.posterior.parameters[0].deviation / std::sqrt(squares / sum), 1.0, 0.06);
}

// Several blocks with weights and their own parameters; the same bits for any number of threads.
TEST(PosteriorTest, RecordingsOnAnyNumberOfThreads) {
  const ProblemMaker maker = [] {
    auto problem = std::make_shared<DecayProblem>(3, 1U);
    problem->weights = {2.0, 1.0, 0.5};
    return problem;
  };
  PosteriorOptions options;
  options.threads = 1;
  const Drawn one = Draw(maker, options);
  ASSERT_EQ(one.error, "");
  for (const int threads : {2, 7}) {
    options.threads = threads;
    EXPECT_EQ(Draw(maker, options).posterior.draws, one.posterior.draws) << threads;
  }
  options.seed = 1;
  EXPECT_NE(Draw(maker, options).posterior.draws, one.posterior.draws);
  // The density is next to normal.
  for (size_t k = 0; k < 5; ++k) {
    const ChainStatistics& of = one.posterior.parameters[k];
    const double deviation = one.fit.uncertainty.standard_deviation[static_cast<Eigen::Index>(k)];
    EXPECT_NEAR(of.mean, one.fit.estimate[static_cast<Eigen::Index>(k)], 0.2 * deviation);
    EXPECT_NEAR(of.deviation / deviation, 1.0, 0.12);
    EXPECT_GT(of.ess_bulk, 400.0);
  }
  EXPECT_EQ(one.posterior.divergences, 0);
}

TEST(PosteriorTest, FewDrawsAreKeptOfMany) {
  const Drawn drawn = DrawMean({"p", 0.0, -kUnbounded, kUnbounded, false, 1.0}, {1.0}, 10);
  EXPECT_EQ(drawn.posterior.draws.rows(), 10);
  EXPECT_EQ(drawn.posterior.transitions, 1000);
  EXPECT_EQ(drawn.posterior.chain_of, (std::vector<int>{0, 0, 1, 1, 1, 2, 2, 3, 3, 3}));
}

TEST(PosteriorTest, WhatIsNotDeterminedIsRefused) {
  ParameterEntry entry = {"p", 1.0, 0.0, kUnbounded, false, 1.0};
  MeanProblem problem(entry, {1.0});
  FitResult fit = Fit({}, &problem, {});
  fit.uncertainty.confidence_95[0].reset();
  fit.uncertainty.messages[0] = "not determined";
  Posterior posterior;
  std::string error;
  EXPECT_FALSE(SamplePosterior(
      {}, {}, fit, FreeCoordinates(problem.entries(), {}),
      [&] { return std::make_shared<MeanProblem>(entry, std::vector<double>{1.0}); }, {}, {},
      &posterior, &error));
  EXPECT_EQ(error,
            "the observations do not determine 'p': expected a prior of it, or lower and upper");
}

/// An observation of e^−p, of which that of a large p is 0.
class SaturatingProblem : public MeanProblem {
 public:
  using MeanProblem::MeanProblem;
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives /*derivatives*/, BlockEvaluation* evaluation) override {
    const double weight = 5.0;
    evaluation->residuals = Eigen::VectorXd::Constant(1, weight * (std::exp(-p[0]) - 0.3));
    evaluation->jacobian = RowMatrixXd::Constant(1, 1, -weight * std::exp(-p[0]));
    return true;
  }
};

// Its density tends to e^−1.125 of the largest: it has no finite integral.
TEST(PosteriorTest, ADensityThatDoesNotFallIsRefused) {
  const auto error_with = [](double upper, std::optional<Prior> prior) {
    ParameterEntry entry = {"p", 1.0, 0.0, upper, false, 1.0};
    entry.prior = prior;
    return Draw(MakerWithPriors<SaturatingProblem>([=] { return SaturatingProblem(entry, {0.0}); }))
        .error;
  };
  EXPECT_NE(error_with(kUnbounded, {})
                .find("the observations do not determine 'p' towards large "
                      "values, at which the cost stays at 1.125"),
            std::string::npos)
      << error_with(kUnbounded, {});
  EXPECT_EQ(error_with(10.0, {}), "");
  EXPECT_EQ(error_with(kUnbounded, Prior{PriorKind::kGaussian, 1.0, 1.0}), "");
}

/// An observation of p².
class SquareProblem : public MeanProblem {
 public:
  using MeanProblem::MeanProblem;
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives /*derivatives*/, BlockEvaluation* evaluation) override {
    evaluation->residuals = Eigen::VectorXd::Constant(1, 20.0 * (p[0] * p[0] - 1.0));
    evaluation->jacobian = RowMatrixXd::Constant(1, 1, 40.0 * p[0]);
    return true;
  }
};

// Modes at ±1, forty deviations from each other: a chain that begins within the bounds finds the
// other one, and chains then do not agree.
TEST(PosteriorTest, AModeFarFromTheEstimateIsFoundWithinBounds) {
  const auto draw = [](double lower, double upper) {
    const ParameterEntry entry = {"p", 0.8, lower, upper, false, 1.0};
    return Draw(MakerWithPriors<SquareProblem>([=] { return SquareProblem(entry, {0.0}); }));
  };
  const Drawn both = draw(-3.0, 3.0);
  EXPECT_LT(both.posterior.draws.minCoeff(), -0.9);
  EXPECT_GT(both.posterior.draws.maxCoeff(), 0.9);
  ASSERT_FALSE(both.posterior.warnings.empty());
  EXPECT_NE(both.posterior.warnings[0].find("the chains do not agree"), std::string::npos)
      << both.posterior.warnings[0];
  const Drawn one = draw(0.0, 3.0);
  EXPECT_GT(one.posterior.draws.minCoeff(), 0.8);
  EXPECT_LT(one.posterior.parameters[0].r_hat, 1.02);
}

// Where a run fails on one side of the estimate it is said how often that ended a trajectory.
TEST(PosteriorTest, DivergencesAreCountedAndSaid) {
  class Failing : public MeanProblem {
   public:
    Failing() : MeanProblem({"p", 1.0, -kUnbounded, kUnbounded, false, 1.0}, {1.0}) {}
    bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                       BlockDerivatives derivatives, BlockEvaluation* evaluation) override {
      return p[0] < 1.5 && MeanProblem::EvaluateBlock(block, p, method, derivatives, evaluation);
    }
  };
  const Drawn drawn = Draw([] { return std::make_shared<Failing>(); });
  ASSERT_EQ(drawn.error, "");
  EXPECT_GT(drawn.posterior.divergences, 0);
  EXPECT_LT(drawn.posterior.draws.maxCoeff(), 1.5);
  ASSERT_FALSE(drawn.posterior.warnings.empty());
  EXPECT_NE(drawn.posterior.warnings[0].find("transitions diverged"), std::string::npos);
}

}  // namespace
}  // namespace tangible
