// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/random_effects.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/variance_components.h"

namespace tangible {
namespace {

/// A value θ_b of each block, seen once with a deviation of kSigma, around a shared μ.
class MeansProblem : public LeastSquaresProblem {
 public:
  static constexpr double kSigma = 0.5;
  explicit MeansProblem(std::vector<double> seen) : seen_(std::move(seen)) {
    entries_.assign(seen_.size() + 1, {"x", 1.0, -HUGE_VAL, HUGE_VAL});
  }
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 1; }
  int num_blocks() const override { return static_cast<int>(seen_.size()); }
  int num_own(int) const override { return 1; }
  int num_rows(int) const override { return 1; }
  std::vector<RowPlace> Places(int) const override { return {{}}; }
  bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod, BlockDerivatives,
                     BlockEvaluation* evaluation) override {
    evaluation->residuals = Eigen::VectorXd::Constant(1, (p[1] - seen_[block]) / kSigma);
    evaluation->jacobian = Eigen::RowVector2d(0.0, 1.0 / kSigma);
    return true;
  }

 private:
  std::vector<double> seen_;
  std::vector<ParameterEntry> entries_;
};

// With v_b = τ² + s_b² of each block's value z_b, and their mean m weighed by 1 / v_b,
//
//   ln L(τ) = −½ Σ ln v_b − ½ ln Σ 1 / v_b − ½ Σ (z_b − m)² / v_b + a constant
//
// Gaussian: z_b is what is seen and s_b its deviation, wherever the problem is linearised.
// Log-normal: z_b = ln θ_b + (seen − θ_b) / θ_b and s_b is relative to θ_b, in the linear problem.
TEST(SpreadLikelihoodTest, IsThatOfTheMeansOfGroups) {
  for (const PriorKind kind : {PriorKind::kGaussian, PriorKind::kLogNormal}) {
    const bool gaussian = kind == PriorKind::kGaussian;
    const std::vector<double> seen = {1.0, 3.5, 2.0, -0.5, 4.0, 2.5};
    const Eigen::VectorXd at = Eigen::VectorXd::LinSpaced(7, 1.5, gaussian ? -2.0 : 4.0);
    MeansProblem problem(seen);
    RandomEffect effect{"x", kind, 0, {1, 2, 3, 4, 5, 6}};
    std::vector<BlockFactor> factors;
    std::vector<double> values;
    std::vector<double> deviations;
    for (int b = 0; b < problem.num_blocks(); ++b) {
      BlockEvaluation block;
      problem.EvaluateBlock(b, Eigen::Vector2d(at[0], at[b + 1]), GradientMethod::kTangent,
                            BlockDerivatives::kCompute, &block);
      factors.push_back(Reduce(block, Eigen::Vector2d::Ones(), 1, 1, 1.0, 0.0));
      const double scale = gaussian ? 1.0 : at[b + 1];
      const double origin = gaussian ? at[b + 1] : std::log(at[b + 1]);
      values.push_back(origin + (seen[b] - at[b + 1]) / scale);
      deviations.push_back(MeansProblem::kSigma / scale);
    }
    const SpreadLikelihood likelihood(BlockLayout(problem), factors, {effect}, at,
                                      std::vector<bool>(7, true));
    const auto exact = [&](double spread) {
      double weights = 0.0;
      double weighed = 0.0;
      double logarithms = 0.0;
      for (size_t b = 0; b < values.size(); ++b) {
        const double v = spread * spread + deviations[b] * deviations[b];
        weights += 1.0 / v;
        weighed += values[b] / v;
        logarithms += std::log(v);
      }
      SpreadLikelihood::Value value;
      for (size_t b = 0; b < values.size(); ++b) {
        value.twice_cost += std::pow(values[b] - weighed / weights, 2) /
                            (spread * spread + deviations[b] * deviations[b]);
      }
      value.likelihood = -0.5 * (logarithms + std::log(weights) + value.twice_cost);
      return value;
    };
    const double shift = likelihood.At({1.0}).likelihood - exact(1.0).likelihood;
    const double infinite = likelihood.At({1e8}).twice_cost;
    for (const double spread : {1e-3, 0.1, 0.7, 1.5, 20.0}) {
      const SpreadLikelihood::Value value = likelihood.At({spread});
      const SpreadLikelihood::Value wanted = exact(spread);
      EXPECT_NEAR(value.likelihood - shift, wanted.likelihood, 1e-8 * std::abs(wanted.likelihood))
          << spread;
      EXPECT_NEAR(value.twice_cost - infinite, wanted.twice_cost, 1e-8 * wanted.twice_cost)
          << spread;
    }
    std::sort(deviations.begin(), deviations.end());
    EXPECT_NEAR(likelihood.RangeOf(0).first, 1e-3 * deviations[3], 1e-12);
  }
}

constexpr double kSpeed = 2.0;
constexpr double kSpread = 0.3;

/// Throws of a ball whose speed, or its logarithm, varies; each speed is seen to about 0.1 m/s.
RecordingsProblem Throws(int count, double spread, unsigned seed, std::optional<double> given = {},
                         PriorKind kind = PriorKind::kGaussian) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  Scene scene = MakeScene(kFallingBall);
  scene.simulation.duration = 0.2;
  std::vector<RecordedRun> runs;
  for (int b = 0; b < count; ++b) {
    const double away = spread * normal(random);
    scene.bodies[0].velocity = {
        kind == PriorKind::kGaussian ? kSpeed + away : kSpeed * std::exp(away), 3.0};
    std::vector<Observation> observations;
    for (Observation observation : Observe(scene, 5, 0.0, 1)) {
      if (observation.coordinate != Coordinate::kX) continue;
      observation.sigma = 0.03;
      observation.value += 0.03 * normal(random);
      observations.push_back(observation);
    }
    FitParameter speed = Parameter("bodies/ball/velocity/x", 1.5);
    if (kind == PriorKind::kLogNormal) speed.lower = 0.0;
    runs.push_back(
        {"take " + std::to_string(b), 1.0, MakeResiduals(scene, {}, {speed}, observations)});
  }
  ParameterScope scope{ParameterScope::Kind::kVaries, kind, given};
  return RecordingsProblem(std::move(runs), {scope});
}

FitResult FitThrows(RecordingsProblem* problem, VarianceComponents* components) {
  FitOptions options;
  options.certificate = CertificatePass::kSkip;
  options.held_test = HeldTest::kSkip;
  options.threads = 1;
  return FitWithComponents(options, problem, {}, components);
}

bool Contains(const ConfidenceInterval& interval, double x) {
  return interval && interval->first <= x && x <= interval->second;
}

// Speeds that are each seen with a deviation s have S = Σ (y_b − mean)² = (τ² + s²) χ², with B − 1
// degrees of freedom: τ² + s² is S over their number, and its ends are S over quantiles of χ².
TEST(RandomEffectsTest, ASpreadAndItsIntervalAreThoseOfChiSquare) {
  constexpr int kCount = 10;
  constexpr double kQuantiles[] = {19.0227678, 2.7003895};  // of 0.975 and 0.025, for 9
  VarianceComponents components;
  RecordingsProblem wide = Throws(kCount, kSpread, 9, 1e6);
  const FitResult alone = FitThrows(&wide, &components);
  const Eigen::ArrayXd seen = alone.estimate.tail(kCount).array();
  const double sum = (seen - seen.mean()).square().sum();
  const double s = alone.uncertainty.standard_deviation[1];
  RecordingsProblem problem = Throws(kCount, kSpread, 9);
  FitThrows(&problem, &components);
  const SpreadEstimate& spread = components.spreads[0];
  ASSERT_TRUE(spread.interval);
  // What a fit leaves at convergence is a thousandth of τ.
  EXPECT_NEAR(spread.spread, std::sqrt(sum / (kCount - 1) - s * s), 1e-3 * spread.spread);
  EXPECT_NEAR(spread.interval->first, std::sqrt(sum / kQuantiles[0] - s * s),
              1e-3 * spread.interval->first);
  EXPECT_NEAR(spread.interval->second, std::sqrt(sum / kQuantiles[1] - s * s),
              1e-3 * spread.interval->second);
}

// The bounds are four standard deviations of a count below 95 % (100 replicas: 2.2 each).
TEST(RandomEffectsTest, IntervalsOfSpreadAndMeanContainTheTruth) {
  constexpr int kReplicas = 100;
  int spreads = 0;
  int means = 0;
  double sum = 0.0;
  double squared_errors = 0.0;
  for (unsigned seed = 0; seed < kReplicas; ++seed) {
    RecordingsProblem problem = Throws(10, kSpread, 100 + seed);
    VarianceComponents components;
    const FitResult result = FitThrows(&problem, &components);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    ASSERT_EQ(components.spreads.size(), 1u);
    const SpreadEstimate& spread = components.spreads[0];
    EXPECT_EQ(spread.recordings, 10);
    spreads += Contains(spread.interval, kSpread) ? 1 : 0;
    means += Contains(result.uncertainty.confidence_95_robust[0], kSpeed) ? 1 : 0;
    sum += spread.spread * spread.spread;
    // Each recording's value is drawn towards the shared one.
    squared_errors += std::pow(result.estimate[0] - kSpeed, 2);
  }
  EXPECT_GE(spreads, 95 - 9);
  EXPECT_GE(means, 95 - 9);
  // The variance has no bias: its deviation is 0.5 of itself, a tenth of that the mean's.
  EXPECT_NEAR(sum / kReplicas, kSpread * kSpread, 4.0 * 0.05 * kSpread * kSpread);
  EXPECT_LT(squared_errors / kReplicas, 2.0 * (kSpread * kSpread + 0.01) / 10.0);
}

// Log-normal: the shared value is the median. 20 replicas of 95 %: 19 with a deviation of 1.
TEST(RandomEffectsTest, SpreadsOfLogarithmsContainTheTruth) {
  constexpr int kReplicas = 20;
  int spreads = 0;
  int medians = 0;
  double sum = 0.0;
  double sum_of_logarithms = 0.0;
  for (unsigned seed = 0; seed < kReplicas; ++seed) {
    RecordingsProblem problem = Throws(10, kSpread, 900 + seed, {}, PriorKind::kLogNormal);
    VarianceComponents components;
    const FitResult result = FitThrows(&problem, &components);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    const SpreadEstimate& spread = components.spreads[0];
    EXPECT_EQ(spread.kind, PriorKind::kLogNormal);
    EXPECT_TRUE(spread.limited);
    // It ends at sqrt(9 / 2.7) times what is seen, which is above twice the truth in 1e-4.
    EXPECT_TRUE(spread.interval && spread.interval->second < 4.0 * kSpread);
    spreads += Contains(spread.interval, kSpread) ? 1 : 0;
    medians += Contains(result.uncertainty.confidence_95_robust[0], kSpeed) ? 1 : 0;
    sum += spread.spread * spread.spread;
    sum_of_logarithms += std::log(result.estimate[0] / kSpeed);
  }
  EXPECT_GE(spreads, 19 - 4);
  EXPECT_GE(medians, 19 - 4);
  // A variance of ten values deviates by about half of itself, its mean over replicas by 0.11.
  EXPECT_NEAR(sum / kReplicas, kSpread * kSpread, 4.0 * 0.11 * kSpread * kSpread);
  // ln of the median deviates by about kSpread / sqrt(10).
  EXPECT_NEAR(sum_of_logarithms / kReplicas, 0.0, 4.0 * kSpread / std::sqrt(10.0 * kReplicas));
}

// A take that is best explained by drag below 0 has a logarithm without a limit, and so has the
// spread.
TEST(RandomEffectsTest, ASpreadThatNothingLimitsHasNoInterval) {
  std::vector<RecordedRun> runs;
  for (const double pulled : {-0.02, 0.12}) {
    Scene scene = MakeScene(kFallingBall);
    std::vector<Observation> observations;
    for (Observation observation : Observe(scene, 10, 0.0, 1)) {
      if (observation.coordinate != Coordinate::kX) continue;
      observation.sigma = 0.01;
      observation.value += pulled * observation.time * observation.time;
      observations.push_back(observation);
    }
    FitParameter drag = Parameter("bodies/ball/linear_damping", 0.1);
    drag.scale = ParameterScale::kLogarithmic;
    runs.push_back({std::to_string(pulled), 1.0, MakeResiduals(scene, {}, {drag}, observations)});
  }
  ParameterScope scope{ParameterScope::Kind::kVaries, PriorKind::kLogNormal, {}};
  RecordingsProblem problem(std::move(runs), {scope});
  VarianceComponents components;
  FitOptions options;
  options.held_test = HeldTest::kSkip;
  options.threads = 1;
  const FitResult result = FitWithComponents(options, &problem, {}, &components);
  EXPECT_EQ(result.status, FitStatus::kNotConverged);
  EXPECT_EQ(result.message,
            "the observations do not limit the spread of "
            "\"bodies/ball/linear_damping\"");
  EXPECT_FALSE(components.spreads[0].interval);
  EXPECT_FALSE(components.spreads[0].limited);
  EXPECT_EQ(std::count(result.uncertainty.warnings.begin(), result.uncertainty.warnings.end(),
                       "the observations do not limit the spread of 'bodies/ball/linear_damping' "
                       "from above, and it has no interval"),
            1);
  EXPECT_NE(result.certificate.verdict, "");
}

TEST(RandomEffectsTest, WithoutASpreadTheRecordingsAreOne) {
  int none = 0;
  int contain_zero = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    RecordingsProblem problem = Throws(6, 0.0, 500 + seed);
    VarianceComponents components;
    const FitResult result = FitThrows(&problem, &components);
    ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
    const SpreadEstimate& spread = components.spreads[0];
    ASSERT_TRUE(spread.interval);
    contain_zero += spread.interval->first == 0.0 ? 1 : 0;
    if (spread.spread == 0.0) {
      ++none;
      // All have the shared value, to a thousandth of its deviation.
      for (int b = 1; b <= 6; ++b) EXPECT_NEAR(result.estimate[b], result.estimate[0], 1e-4);
    }
  }
  // χ² with 5 degrees of freedom is below 5 in 58 % of all cases; below its 0.975 quantile in 97.5.
  EXPECT_GE(none, 5);
  EXPECT_LT(none, 20);
  EXPECT_GE(contain_zero, 17);
}

// A spread that is given is a prior around an unknown mean: the estimate of each recording is the
// mean of its own and the shared value, weighed by 1 / s² and 1 / τ².
TEST(RandomEffectsTest, ValuesAreDrawnTowardsTheSharedOne) {
  RecordingsProblem given = Throws(5, kSpread, 9, 0.1);
  RecordingsProblem wide = Throws(5, kSpread, 9, 1e6);
  VarianceComponents components;
  const FitResult drawn = FitThrows(&given, &components);
  EXPECT_FALSE(components.spreads[0].estimated);
  EXPECT_FALSE(components.spreads[0].interval);
  EXPECT_EQ(components.spreads[0].spread, 0.1);
  const FitResult alone = FitThrows(&wide, &components);
  const double s = alone.uncertainty.standard_deviation[1];
  const double part = 0.01 / (0.01 + s * s);
  EXPECT_GT(s, 0.02);
  for (int b = 1; b <= 5; ++b) {
    EXPECT_NEAR(drawn.estimate[b],
                drawn.estimate[0] + part * (alone.estimate[b] - drawn.estimate[0]), 1e-6);
  }
  EXPECT_NEAR(drawn.estimate[0], alone.estimate.tail(5).mean(), 1e-6);
}

}  // namespace
}  // namespace tangible
