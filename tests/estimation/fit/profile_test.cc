// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "../../support/block_problem.h"
#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/minimise.h"

namespace tangible {
namespace {

constexpr double kQuantile = 1.959963984540054;

/// A line y = a + b t observed at t = 0, 1, ... n − 1 with sigma 1: every profile is a parabola.
class LineProblem : public LeastSquaresProblem {
 public:
  explicit LineProblem(int rows) : observed(Eigen::VectorXd::Zero(rows)) {
    constexpr double kUnbounded = std::numeric_limits<double>::infinity();
    entries_ = {{"a", 0.5, -kUnbounded, kUnbounded, false, 1.0},
                {"b", 0.5, -kUnbounded, kUnbounded, false, 1.0}};
  }
  Eigen::VectorXd observed;

  std::vector<ParameterEntry>& mutable_entries() { return entries_; }
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 2; }
  int num_blocks() const override { return 1; }
  int num_own(int /*block*/) const override { return 0; }
  int num_rows(int /*block*/) const override { return static_cast<int>(observed.size()); }
  std::vector<RowPlace> Places(int /*block*/) const override {
    std::vector<RowPlace> places;
    for (int i = 0; i < num_rows(0); ++i) places.push_back({0, static_cast<double>(i), 0.0});
    return places;
  }
  bool EvaluateBlock(int /*block*/, const Eigen::VectorXd& p, GradientMethod /*method*/,
                     BlockDerivatives /*derivatives*/, BlockEvaluation* evaluation) override {
    const Eigen::Index n = observed.size();
    evaluation->residuals.resize(n);
    evaluation->jacobian.resize(n, 2);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double t = static_cast<double>(i);
      evaluation->residuals[i] = p[0] + p[1] * t - observed[i];
      evaluation->jacobian.row(i) << 1.0, t;
    }
    return true;
  }

 private:
  std::vector<ParameterEntry> entries_;
};

FitOptions Asking(const std::vector<std::string>& names) {
  FitOptions options;
  options.profiles = names;
  return options;
}

TEST(ProfileTest, OfAParabolaItIsTheIntervalByDerivatives) {
  LineProblem problem(20);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (double& y : problem.observed) y = normal(random);
  const FitResult fit = Fit(Asking({"a", "b"}), &problem, {});
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  ASSERT_FALSE(fit.uncertainty.DoesNotFit());
  ASSERT_EQ(fit.profiles.size(), 2U);
  for (size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(fit.profiles[k].why, "asked for");
    EXPECT_DOUBLE_EQ(fit.profiles[k].rise, 0.5 * kQuantile * kQuantile);
    ASSERT_EQ(fit.profiles[k].branches.size(), 1U);
    EXPECT_EQ(fit.intervals[k].method, "profile");
    const double deviation = fit.uncertainty.standard_deviation[static_cast<Eigen::Index>(k)];
    // An end is exact to kProfileEnd of a deviation.
    ASSERT_TRUE(fit.intervals[k].low && fit.intervals[k].high);
    EXPECT_NEAR(*fit.intervals[k].low, fit.uncertainty.confidence_95[k]->first, 4e-3 * deviation);
    EXPECT_NEAR(*fit.intervals[k].high, fit.uncertainty.confidence_95[k]->second, 4e-3 * deviation);
  }
  const FitResult without = Fit(FitOptions(), &problem, {});
  EXPECT_TRUE(without.profiles.empty());
  EXPECT_EQ(without.intervals[0].method, "robust");
}

TEST(ProfileTest, WhereTheModelDoesNotFitItIsAsWideAsTheRobustInterval) {
  LineProblem problem(200);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 4.0);
  for (double& y : problem.observed) y = normal(random);
  const FitResult fit = Fit(Asking({"b"}), &problem, {});
  ASSERT_TRUE(fit.uncertainty.DoesNotFit());
  const double deviation = fit.uncertainty.standard_deviation_robust[1];
  EXPECT_NEAR(*fit.intervals[1].low, fit.uncertainty.confidence_95_robust[1]->first,
              4e-3 * deviation);
  EXPECT_NEAR(*fit.intervals[1].high, fit.uncertainty.confidence_95_robust[1]->second,
              4e-3 * deviation);
}

TEST(ProfileTest, AnIntervalThatMeetsABoundEndsThere) {
  LineProblem problem(20);
  problem.observed.setConstant(0.1);
  problem.mutable_entries()[0].lower = 0.0;
  const FitResult fit = Fit(FitOptions(), &problem, {});
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  ASSERT_GE(fit.profiles.size(), 1U);
  EXPECT_EQ(fit.profiles[0].parameter, 0);
  EXPECT_EQ(*fit.intervals[0].low, 0.0);
  EXPECT_NEAR(*fit.intervals[0].high, fit.uncertainty.confidence_95[0]->second, 1e-2);
  EXPECT_LT(fit.uncertainty.confidence_95[0]->first, 0.0);  // which is kept
  // At its bound it has no derivatives, but an interval.
  problem.observed.setConstant(-0.1);
  const FitResult bound = Fit(FitOptions(), &problem, {});
  ASSERT_EQ(bound.estimate[0], 0.0);
  EXPECT_FALSE(bound.uncertainty.confidence_95[0]);
  EXPECT_EQ(*bound.intervals[0].low, 0.0);
  EXPECT_GT(*bound.intervals[0].high, 0.1);
}

// The slope, 0.03, is at its bound 0 in a fifth of all draws. With it held there the other's
// interval would be that of a mean, which is 0.29 off.
TEST(ProfileTest, IntervalsBesideAParameterAtItsBoundContainTheTruth) {
  int at_bound = 0, held = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    LineProblem problem(20);
    problem.mutable_entries()[1].lower = 0.0;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    for (Eigen::Index t = 0; t < 20; ++t) {
      problem.observed[t] = 0.03 * static_cast<double>(t) + normal(random);
    }
    const FitResult fit = Fit(FitOptions(), &problem, {});
    ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
    if (fit.estimate[1] > 0.0) continue;
    ++at_bound;
    EXPECT_EQ(fit.intervals[0].method, "profile") << seed;
    ASSERT_TRUE(fit.intervals[0].low && fit.intervals[0].high) << seed;
    held += *fit.intervals[0].low <= 0.0 && *fit.intervals[0].high >= 0.0 ? 1 : 0;
  }
  EXPECT_GE(at_bound, 25);
  EXPECT_GE(held, (9 * at_bound) / 10) << at_bound;
}

TEST(ProfileTest, TheProblemWithOneHeldIsTheSameOnARidge) {
  DecayProblem problem(3, 5);
  const Eigen::VectorXd p = InitialOf(problem.entries());
  for (const int parameter : {0, 1, 3}) {
    ProblemWithHeld held(parameter, 0.7, &problem);
    Eigen::VectorXd all = p;
    all[parameter] = 0.7;
    EXPECT_EQ(held.All(held.Left(p)), all);
    const BlockLayout layout(held);
    const BlockLayout whole(problem);
    ASSERT_EQ(layout.num_parameters(), whole.num_parameters() - 1);
    for (int block = 0; block < problem.num_blocks(); ++block) {
      BlockEvaluation expected;
      BlockEvaluation got;
      ASSERT_TRUE(problem.EvaluateBlock(block, whole.Local(block, all), GradientMethod::kTangent,
                                        BlockDerivatives::kCompute, &expected));
      ASSERT_TRUE(held.EvaluateBlock(block, layout.Local(block, held.Left(p)),
                                     GradientMethod::kTangent, BlockDerivatives::kCompute, &got));
      EXPECT_EQ(got.residuals, expected.residuals);
      for (int i = 0; i < layout.num_local(block); ++i) {
        const int k = layout.ParameterOf(block, i);
        for (int j = 0; j < whole.num_local(block); ++j) {
          if (whole.ParameterOf(block, j) == (k < parameter ? k : k + 1)) {
            EXPECT_EQ(got.jacobian.col(i), expected.jacobian.col(j)) << parameter << " " << block;
          }
        }
      }
    }
  }
}

// A box on a slope of 10 degrees slides by 2 mm or less in a second where friction is a little
// below tan 10 degrees, and not at all with any larger friction, which costs hardly more.
TEST(ProfileTest, WhereEveryLargerFrictionSticksThereIsNoUpperEnd) {
  const double slope = 10.0 * M_PI / 180.0;
  Scene scene = MakeScene(R"({"bodies": [
    {"name": "box", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 2, "position": [0, 0.05]},
    {"name": "plane", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "pairs": [{"bodies": ["box", "plane"], "friction": 0.1, "restitution": 0}],
    "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  scene.gravity = {9.81 * std::sin(slope), -9.81 * std::cos(slope)};
  const double mu = std::tan(slope) - 1e-4;
  std::vector<Observation> observations;
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 0.004);
  std::vector<double> noise;
  double product = 0.0;
  double square = 0.0;
  for (int i = 0; i <= 25; ++i) {
    const double t = 0.04 * i;
    noise.push_back(normal(random));
    product += noise.back() * t * t;
    square += std::pow(t, 4);
  }
  for (int i = 0; i <= 25; ++i) {
    const double t = 0.04 * i;
    // Without the part of the noise that looks like friction the estimate is the truth.
    const double x = 0.5 * (std::sin(slope) - mu * std::cos(slope)) * 9.81 * t * t +
                     noise[static_cast<size_t>(i)] - product / square * t * t;
    observations.push_back({t, 0, -1, Coordinate::kX, x, 0.004});
  }
  FitParameter friction = Parameter("pairs/box:plane/friction", 0.15);
  friction.lower = 0.0;
  RolloutResiduals residuals = MakeResiduals(scene, {}, {friction}, observations);
  const FitResult fit = Fit(FitOptions(), &residuals, {});
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  ASSERT_TRUE(fit.intervals[0].exists);
  EXPECT_EQ(fit.intervals[0].method, "profile")
      << fit.estimate[0] << " ± " << fit.uncertainty.standard_deviation[0];
  EXPECT_FALSE(fit.intervals[0].high) << *fit.intervals[0].high;
  ASSERT_TRUE(fit.intervals[0].low);
  EXPECT_LT(*fit.intervals[0].low, mu);
  EXPECT_GT(*fit.intervals[0].low, mu - 0.01);
}

/// A ball dropped on a floor, seen by a camera for half a second.
struct Drop {
  static constexpr double kSigma = 0.003;
  static constexpr double kRestitution = 0.06;

  Scene scene = MakeScene(R"({"bodies": [
    {"name": "ball", "shape": {"circle": {"radius": 0.05}}, "mass": 1, "position": [0, 0.3]},
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "pairs": [{"bodies": ["ball", "floor"], "friction": 0, "restitution": 0.3}],
    "simulation": {"dt": 0.01, "duration": 0.6, "stepping": "event"}})");

  /// The height by its closed form: parabolas between impacts at rising times.
  static double Height(double t) {
    constexpr double kGravity = 9.81;
    constexpr double kRest = 0.05;
    const double fall = std::sqrt(2.0 * 0.25 / kGravity);
    if (t < fall) return 0.3 - 0.5 * kGravity * t * t;
    double begin = fall;
    double speed = kRestitution * kGravity * fall;
    while (t > begin + 2.0 * speed / kGravity && speed > 1e-9) {
      begin += 2.0 * speed / kGravity;
      speed *= kRestitution;
    }
    const double s = t - begin;
    return std::max(kRest, kRest + speed * s - 0.5 * kGravity * s * s);
  }
  static std::vector<Observation> Observations(unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, kSigma);
    std::vector<Observation> observations;
    for (int i = 0; i < 18; ++i) {
      const double t = i / 30.0;
      observations.push_back({t, 0, -1, Coordinate::kY, Height(t) + normal(random), kSigma});
    }
    return observations;
  }
  FitResult Run(unsigned seed, double initial) const {
    RolloutResiduals residuals = MakeResiduals(
        scene, {}, {Parameter("pairs/ball:floor/restitution", initial)}, Observations(seed));
    FitOptions options;
    options.starts = 0;
    return Fit(options, &residuals, {});
  }
};

// The cost has several minima, and no derivative where the second impact passes an observation:
// intervals by derivatives contain the truth in half of the draws.
TEST(ProfileTest, IntervalsThroughImpactsContainTheTruth) {
  const Drop drop;
  int by_default = 0;
  int by_sigma = 0;
  constexpr int kDraws = 60;
  for (unsigned seed = 1; seed <= kDraws; ++seed) {
    const FitResult fit = drop.Run(seed, 0.3);
    ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
    const FinalInterval& interval = fit.intervals[0];
    by_default += interval.exists && (!interval.low || *interval.low <= Drop::kRestitution) &&
                          (!interval.high || *interval.high >= Drop::kRestitution)
                      ? 1
                      : 0;
    const ConfidenceInterval& sigma = fit.uncertainty.confidence_95[0];
    by_sigma += sigma && sigma->first <= Drop::kRestitution && sigma->second >= Drop::kRestitution;
    EXPECT_EQ(fit.starts.size(), 3U);
    EXPECT_NE(fit.agreement, "");
  }
  EXPECT_GE(by_default, 55);
  EXPECT_LT(by_sigma, 45);
}

// From a start without a second impact restitution has no effect: the fit begins elsewhere, and
// must not end above where the user began.
TEST(ProfileTest, NoFitEndsAboveItsStart) {
  const Drop drop;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const FitResult fit = drop.Run(seed, 0.001);
    EXPECT_EQ(fit.status, FitStatus::kConverged) << fit.message;
    EXPECT_LE(fit.final_cost, fit.initial_cost * (1.0 + 1e-12)) << seed;
  }
}

}  // namespace
}  // namespace tangible
