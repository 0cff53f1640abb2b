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
  // Some of it is left, as friction is no Gaussian force, and within the interval.
  EXPECT_LT(error_with, 0.5 * error_without) << error_without;
  EXPECT_LT(error_with, with.result.uncertainty.standard_deviation[2]);
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

// A block slides and stops, as the model has it. From poor initial values random forces follow the
// observations, and the fit with them does not find what one without them finds at once.
TEST(NoiseIntensityTest, PoorInitialValuesAreNoRandomForce) {
  FitProblem problem;
  problem.scene = MakeScene(R"({"gravity": [0, -10], "bodies": [
      {"name": "block", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 1, "position": [0, 0.1],
       "velocity": [2, 0]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "pairs": [{"bodies": ["block", "floor"], "friction": 0.2}],
      "simulation": {"dt": 0.01, "duration": 1.5}})");
  problem.observations = Observe(problem.scene, 5, 1e-3, 1);
  std::erase_if(problem.observations,
                [](const Observation& one) { return one.coordinate != Coordinate::kX; });
  problem.parameters = {Parameter("pairs/block:floor/friction", 0.1),
                        Parameter("bodies/block/velocity/x", 1.5)};
  problem.process_noise = {Term("block", "", NoiseCoordinate::kX, std::nullopt)};
  const Fitted fitted = FitOf(InputOf(problem));
  const double deviation = fitted.result.uncertainty.standard_deviation[0];
  EXPECT_NEAR(fitted.result.estimate[0], 0.2, 4.0 * deviation);
  EXPECT_LT(deviation, 1e-3);
  EXPECT_LT(fitted.components.forces[0].intensity, 0.02);
}

/// A sled that random forces drive, from 3 m/s on.
struct Sled {
  static constexpr double kMass = 2.0;
  static constexpr double kStep = 0.05;
  static constexpr double kSigma = 5e-3;  // m
  double damping = 0.8;
  double intensity = 0.3;  // N √s
  int steps = 100;

  Scene MakeScene() const {
    Scene scene = tangible::MakeScene(R"({"name": "sled", "gravity": [0, 0], "bodies": [
      {"name": "sled", "mass": 2, "inertia": 1, "position": [0, 0], "velocity": [3, 0]}],
      "simulation": {"dt": 0.05, "duration": 1}})");
    scene.bodies[0].linear_damping = damping;
    scene.simulation.duration = kStep * steps;
    return scene;
  }

  std::vector<Observation> Observe(unsigned seed) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    std::vector<Observation> observations;
    double x = 0.0;
    double v = 3.0;
    for (int k = 0; k <= steps; ++k) {
      observations.push_back(
          {kStep * k, 0, -1, Coordinate::kX, x + kSigma * normal(random), kSigma});
      // The damping is implicit.
      v = (kMass * v + kStep * intensity / std::sqrt(kStep) * normal(random)) /
          (kMass + kStep * damping);
      x += kStep * v;
    }
    return observations;
  }

  /// −ln of the density of observations at a damping, by Kalman's filter over x and v.
  double MinusLog(const std::vector<Observation>& observations, double at) const {
    Eigen::Vector2d mean(0.0, 3.0);
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    const double decay = kMass / (kMass + kStep * at);
    const double kick = std::sqrt(kStep) * intensity / (kMass + kStep * at);
    Eigen::Matrix2d map;
    map << 1.0, kStep * decay, 0.0, decay;
    const Eigen::Vector2d driven(kStep * kick, kick);
    double sum = 0.0;
    for (size_t k = 0; k < observations.size(); ++k) {
      if (k > 0) {
        mean = map * mean;
        spread = map * spread * map.transpose() + driven * driven.transpose();
      }
      const double variance = spread(0, 0) + kSigma * kSigma;
      const double off = observations[k].value - mean[0];
      sum += 0.5 * (off * off / variance + std::log(variance));
      const Eigen::Vector2d gain = spread.col(0) / variance;
      mean += gain * off;
      spread -= (gain * spread.row(0)).eval();
    }
    return sum;
  }
};

/// The mode beside the forces would be too small by more than its deviation.
TEST(NoiseIntensityTest, TheEstimateIsTheModeWithTheForcesIntegratedOut) {
  Sled sled;
  sled.steps = 600;
  FitProblem problem;
  problem.scene = sled.MakeScene();
  problem.observations = sled.Observe(7);
  problem.parameters = {Parameter("bodies/sled/linear_damping", 0.5)};
  problem.process_noise = {Term("sled", "", NoiseCoordinate::kX, sled.intensity)};
  const Fitted fitted = FitOf(InputOf(problem));
  const double deviation = fitted.result.uncertainty.standard_deviation[0];
  const auto minus_log = [&](double at) { return sled.MinusLog(problem.observations, at); };
  // The minimum of a parabola through three points, drawn together around it.
  double mode = 0.8;
  for (const double width : {0.1, 0.03, 0.01, 0.003, 0.003}) {
    const double low = minus_log(mode - width);
    const double high = minus_log(mode + width);
    mode += 0.5 * width * (low - high) / (low - 2.0 * minus_log(mode) + high);
  }
  EXPECT_NEAR(fitted.result.estimate[0], mode, 2e-3 * deviation);
  // The slope of D is nearly −(time) / (mass).
  EXPECT_GT(deviation * sled.steps * Sled::kStep / Sled::kMass, 1.0);
}

TEST(NoiseIntensityTest, IntervalsOfADampingCoverItInLongRecordings) {
  Sled sled;
  sled.damping = 0.2;
  sled.steps = 800;
  const int replicas = NumReplicas();
  int covered = 0;
  double off = 0.0;
  for (int i = 0; i < replicas; ++i) {
    FitProblem problem;
    problem.scene = sled.MakeScene();
    problem.observations = sled.Observe(static_cast<unsigned>(300 + i));
    problem.parameters = {Parameter("bodies/sled/linear_damping", 0.5)};
    problem.process_noise = {Term("sled", "", NoiseCoordinate::kX, std::nullopt)};
    const Fitted fitted = FitOf(InputOf(problem));
    const ConfidenceInterval& interval = fitted.result.uncertainty.confidence_95[0];
    ASSERT_TRUE(interval.has_value());
    covered += interval->first <= sled.damping && sled.damping <= interval->second ? 1 : 0;
    off += (fitted.result.estimate[0] - sled.damping) /
           (fitted.result.uncertainty.standard_deviation[0] * std::sqrt(replicas));
  }
  EXPECT_GE(covered, (0.95 - 3.0 * std::sqrt(0.05 * 0.95 / replicas)) * replicas);
  EXPECT_LT(std::abs(off), 3.0);
}

/// Intervals contain the parameter as often as they say, with forces as the model has them, of an
/// intensity that is estimated too.
TEST(NoiseIntensityTest, IntervalsCover) {
  const Sled sled;
  const int replicas = NumReplicas();
  int covered = 0;
  int intensities = 0;
  double without_covered = 0;
  for (int i = 0; i < replicas; ++i) {
    FitProblem problem;
    problem.scene = sled.MakeScene();
    problem.observations = sled.Observe(static_cast<unsigned>(100 + i));
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
    intensities += contains(fitted.components.forces[0].interval, sled.intensity) ? 1 : 0;
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
