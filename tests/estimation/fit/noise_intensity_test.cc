// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/noise_intensity.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/variance_components.h"

namespace tangible {
namespace {

NoiseTerm Term(const std::string& body, const std::string& joint, NoiseCoordinate coordinate,
               std::optional<double> intensity, double correlation_time = 0.0) {
  NoiseTerm term;
  term.body = body;
  term.joint = joint;
  term.coordinate = coordinate;
  term.intensity = intensity;
  term.correlation_time = correlation_time;
  return term;
}

struct Fitted {
  FitResult result;
  VarianceComponents components;
};

Fitted FitOf(const FitInput& input) {
  ParameterError error;
  int fault = 0;
  const std::unique_ptr<RecordingsProblem> problem = MakeProblem(input, &error, &fault);
  EXPECT_NE(problem, nullptr) << error.what;
  Fitted fitted;
  fitted.result = FitWithComponents(input.options(), problem.get(), {}, &fitted.components);
  EXPECT_EQ(fitted.result.status, FitStatus::kConverged) << fitted.result.message;
  return fitted;
}

/// A pendulum whose hinge rubs, which the model does not know.
struct Rubbing {
  static constexpr double kFriction = 0.06;  // N m
  FitProblem problem;

  explicit Rubbing(unsigned seed) {
    std::string text = kPendulum;
    text.replace(text.find("\"duration\": 2"), 13, "\"duration\": 6");
    problem.scene = MakeScene(text);
    Scene real = problem.scene;
    real.joints[0].friction = kFriction;
    problem.observations = Observe(real, 1, 1e-3, seed);
    problem.parameters = {Parameter("joints/pin/angle", 0.9), Parameter("joints/pin/rate", 0.0),
                          Parameter("bodies/bob/inertia", 0.03)};
  }
};

TEST(NoiseIntensityTest, TheSmoothedForceIsTheOneThatTheModelMisses) {
  Rubbing rubbing(3);
  const Fitted without = FitOf(InputOf(rubbing.problem));
  rubbing.problem.process_noise = {Term("", "pin", NoiseCoordinate::kAngle, std::nullopt, 0.3)};
  const Fitted with = FitOf(InputOf(rubbing.problem));
  const double truth = 0.02;
  const double error_without = std::abs(without.result.estimate[2] - truth);
  const double error_with = std::abs(with.result.estimate[2] - truth);
  EXPECT_LT(error_with, 0.2 * error_without) << error_without;
  EXPECT_LT(error_with, 3.0 * with.result.uncertainty.standard_deviation[2]);
  // As large as the friction.
  EXPECT_GT(with.components.forces[0].intensity, 0.5 * Rubbing::kFriction);
  EXPECT_LT(with.components.forces[0].intensity, 2.0 * Rubbing::kFriction);
  const SmoothedRun& run = with.components.smoothed[0];
  double off = 0.0;
  int count = 0;
  for (Eigen::Index k = 0; k < run.forces.rows(); ++k) {
    if (std::abs(run.rates(k, 0)) < 1.0) continue;  // where it turns, the smoothed force follows
    const double real = run.rates(k, 0) > 0.0 ? -Rubbing::kFriction : Rubbing::kFriction;
    off += (run.forces(k, 0) - real) * (run.forces(k, 0) - real);
    ++count;
  }
  ASSERT_GT(count, 100);
  EXPECT_LT(std::sqrt(off / count), 0.4 * Rubbing::kFriction);
  EXPECT_NEAR(with.result.uncertainty.reduced_chi_square, 1.0, 0.15);
  EXPECT_GT(without.result.uncertainty.reduced_chi_square, 10.0);
}

TEST(NoiseIntensityTest, TheResultDoesNotDependOnThreads) {
  Rubbing rubbing(4);
  rubbing.problem.process_noise = {Term("", "pin", NoiseCoordinate::kAngle, std::nullopt, 0.3)};
  FitInput input = InputOf(rubbing.problem);
  input.scopes.assign(3, {ParameterScope::Kind::kOwn, PriorKind::kGaussian, {}});
  input.scopes[2].kind = ParameterScope::Kind::kShared;
  input.recordings.push_back(input.recordings[0]);
  input.recordings[1].problem = Rubbing(5).problem;
  input.recordings[1].problem.process_noise = rubbing.problem.process_noise;
  input.recordings[0].name = "first";
  input.recordings[1].name = "second";
  std::vector<Fitted> all;
  for (const int threads : {1, 2, 3}) {
    for (RecordingInput& one : input.recordings) one.problem.options.threads = threads;
    all.push_back(FitOf(input));
  }
  for (const Fitted& one : all) {
    EXPECT_EQ(one.result.estimate, all[0].result.estimate);
    EXPECT_EQ(one.components.forces[0].intensity, all[0].components.forces[0].intensity);
    EXPECT_EQ(one.components.smoothed[1].forces, all[0].components.smoothed[1].forces);
  }
}

TEST(NoiseIntensityTest, WhereTheModelIsRightNoForceIsSeen) {
  FitProblem problem;
  problem.scene = MakeScene(kPendulum);
  problem.observations = Observe(problem.scene, 1, 1e-3, 6);
  problem.parameters = {Parameter("joints/pin/angle", 0.9), Parameter("bodies/bob/inertia", 0.03)};
  problem.process_noise = {Term("", "pin", NoiseCoordinate::kAngle, std::nullopt, 0.3)};
  const Fitted fitted = FitOf(InputOf(problem));
  const NoiseIntensity& force = fitted.components.forces[0];
  // Chance may show a small one.
  EXPECT_LT(force.intensity, 0.02);
  EXPECT_NEAR(fitted.result.estimate[1], 0.02,
              4.0 * fitted.result.uncertainty.standard_deviation[1]);
}

/// Intervals contain the parameter as often as they say, with forces as the model has them, of an
/// intensity that is estimated too.
TEST(NoiseIntensityTest, IntervalsCover) {
  const Scene scene = MakeScene(R"({"name": "sled", "gravity": [0, 0], "bodies": [
    {"name": "sled", "mass": 2, "inertia": 1, "position": [0, 0], "velocity": [3, 0],
     "linear_damping": 0.8}], "simulation": {"dt": 0.05, "duration": 5}})");
  const double intensity = 0.3;  // N √s
  const int replicas = NumReplicas();
  int covered = 0;
  int intensities = 0;
  double without_covered = 0;
  for (int i = 0; i < replicas; ++i) {
    std::mt19937 random(static_cast<unsigned>(100 + i));
    std::normal_distribution<double> normal(0.0, 1.0);
    FitProblem problem;
    problem.scene = scene;
    double x = 0.0;
    double v = 3.0;
    for (int k = 0; k <= 100; ++k) {
      problem.observations.push_back(
          {0.05 * k, 0, -1, Coordinate::kX, x + 5e-3 * normal(random), 5e-3});
      // The damping is implicit.
      v = (2.0 * v + 0.05 * intensity / std::sqrt(0.05) * normal(random)) / (2.0 + 0.05 * 0.8);
      x += 0.05 * v;
    }
    problem.parameters = {Parameter("bodies/sled/linear_damping", 0.5),
                          Parameter("bodies/sled/velocity/x", 2.5)};
    problem.options.starts = 1;
    const auto contains = [](const ConfidenceInterval& interval, double truth) {
      return interval && interval->first <= truth && truth <= interval->second;
    };
    const Fitted plain = FitOf(InputOf(problem));
    without_covered += contains(plain.result.uncertainty.confidence_95[0], 0.8) ? 1 : 0;
    problem.process_noise = {Term("sled", "", NoiseCoordinate::kX, std::nullopt)};
    const Fitted fitted = FitOf(InputOf(problem));
    covered += contains(fitted.result.uncertainty.confidence_95[0], 0.8) ? 1 : 0;
    intensities += contains(fitted.components.forces[0].interval, intensity) ? 1 : 0;
    EXPECT_EQ(fitted.result.intervals[0].method, "sigma");
  }
  // Three deviations of a binomial below 95 %, and an estimated intensity costs a little.
  const double least = 0.94 - 3.0 * std::sqrt(0.05 * 0.95 / replicas);
  EXPECT_GE(covered, least * replicas);
  EXPECT_GE(intensities, least * replicas);
  EXPECT_LT(without_covered, 0.5 * replicas);
}

}  // namespace
}  // namespace tangible
