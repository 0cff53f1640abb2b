// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/sensor_noise.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/variance_components.h"

namespace tangible {
namespace {

/// A ball in the air by two sensors: both say a sigma of 1 cm, but one has 3 cm and the other 1 mm.
struct TwoSensors {
  Scene scene = MakeScene(kFallingBall);
  Instruments instruments;
  std::vector<Channel> channels;
  std::vector<Observation> observations;
  std::vector<FitParameter> parameters = {Parameter("gravity/y", -9.0),
                                          Parameter("bodies/ball/velocity/x", 1.5),
                                          Parameter("bodies/ball/velocity/y", 2.5)};

  explicit TwoSensors(unsigned seed) {
    instruments.sensors = {{"rough", 0.0, 1.0, 0.0, 0.0, true}, {"fine", 0.0, 1.0, 0.0, 0.0, true}};
    channels = {{.sensor = 0}, {.sensor = 1}};
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    for (const Observation& exact : Observe(scene, 2, 0.0, 1)) {
      if (exact.coordinate == Coordinate::kAngle) {
        continue;
      }
      Observation observation = exact;
      observation.channel = observation.coordinate == Coordinate::kX ? 0 : 1;
      observation.value += (observation.channel == 0 ? 0.03 : 0.001) * normal(random);
      observation.sigma = 0.01;
      observations.push_back(observation);
    }
  }

  RecordingsProblem Residuals() const {
    ParameterizedScene parameterized;
    ParameterError error;
    EXPECT_TRUE(parameterized.Create(scene, {}, parameters, &error, instruments)) << error.what;
    return RecordingsProblem(RolloutResiduals(parameterized, observations, channels));
  }
};

TEST(SensorNoiseTest, EachSensorHasItsOwn) {
  TwoSensors problem(7);
  RecordingsProblem residuals = problem.Residuals();
  VarianceComponents noise_components;
  const FitResult result = FitWithComponents(FitOptions(), &residuals, {}, &noise_components);
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  const std::vector<SensorNoise>& noise = noise_components.noise;
  ASSERT_EQ(noise.size(), 2u);
  EXPECT_EQ(noise[0].name, "rough");
  EXPECT_EQ(noise[0].count, 51);
  EXPECT_NEAR(noise[0].factor, 3.0, 3.0 * noise[0].deviation);
  EXPECT_NEAR(noise[1].factor, 0.1, 3.0 * noise[1].deviation);
  EXPECT_NEAR(noise[0].deviation, noise[0].factor / std::sqrt(2.0 * noise[0].redundancy), 1e-12);
  // Three parameters are taken from both together.
  EXPECT_NEAR(noise[0].redundancy + noise[1].redundancy, 102.0 - 3.0, 1e-3);
  // Then the residuals are as large as sigma says, of each sensor.
  double sums[2] = {};
  for (int i = 0; i < residuals.num_rows(0); ++i) {
    sums[residuals.run(0)->observations()[i].channel] += result.residuals[i] * result.residuals[i];
  }
  EXPECT_NEAR(sums[0], noise[0].redundancy, 1e-2 * noise[0].redundancy);
  EXPECT_NEAR(sums[1], noise[1].redundancy, 1e-2 * noise[1].redundancy);
  EXPECT_NEAR(result.uncertainty.reduced_chi_square, 1.0, 1e-2);
  EXPECT_NEAR(result.estimate[0], -9.81, 4.0 * result.uncertainty.standard_deviation[0]);

  // It does not matter where sigma began.
  TwoSensors other(7);
  for (Observation& observation : other.observations) {
    observation.sigma *= observation.channel == 0 ? 20.0 : 0.2;
  }
  RecordingsProblem again = other.Residuals();
  VarianceComponents found_components;
  const FitResult same = FitWithComponents(FitOptions(), &again, {}, &found_components);
  ASSERT_EQ(same.status, FitStatus::kConverged) << same.message;
  const std::vector<SensorNoise>& found = found_components.noise;
  EXPECT_NEAR(20.0 * found[0].factor, noise[0].factor, 1e-2 * noise[0].deviation);
  EXPECT_NEAR(0.2 * found[1].factor, noise[1].factor, 1e-2 * noise[1].deviation);
}

TEST(SensorNoiseTest, OutliersDoNotMoveItWithHubersLoss) {
  TwoSensors problem(3);
  for (size_t i = 0; i < problem.observations.size(); i += 17) {
    problem.observations[i].value += 5.0;
  }
  RecordingsProblem residuals = problem.Residuals();
  VarianceComponents noise_components;
  FitOptions options;
  options.huber = 2.0;
  const FitResult result = FitWithComponents(options, &residuals, {}, &noise_components);
  ASSERT_EQ(result.status, FitStatus::kConverged) << result.message;
  const std::vector<SensorNoise>& noise = noise_components.noise;
  EXPECT_NEAR(noise[0].factor, 3.0, 1.5);
  EXPECT_NEAR(noise[1].factor, 0.1, 0.05);
}

// Residuals that are rounding show no noise.
TEST(SensorNoiseTest, WhatIsSeenWithoutNoiseHasNoSigma) {
  TwoSensors problem(1);
  size_t i = 0;
  for (const Observation& exact : Observe(problem.scene, 2, 0.0, 1)) {
    if (exact.coordinate != Coordinate::kAngle) problem.observations[i++].value = exact.value;
  }
  RecordingsProblem residuals = problem.Residuals();
  VarianceComponents noise_components;
  const FitResult result = FitWithComponents(FitOptions(), &residuals, {}, &noise_components);
  EXPECT_EQ(result.status, FitStatus::kNotConverged);
  EXPECT_EQ(result.message,
            "the sigma of sensor \"rough\" cannot be estimated: its observations leave no "
            "residuals");
  EXPECT_EQ(noise_components.noise[0].factor, 1.0);
}

TEST(SensorNoiseTest, ASensorWithoutResidualsIsSaid) {
  TwoSensors problem(1);
  problem.observations.resize(2);
  problem.parameters.resize(2);
  problem.observations[0].time = problem.observations[1].time = 0.5;
  RecordingsProblem residuals = problem.Residuals();
  VarianceComponents noise_components;
  const FitResult result = FitWithComponents(FitOptions(), &residuals, {}, &noise_components);
  EXPECT_EQ(result.status, FitStatus::kNotConverged);
  EXPECT_NE(result.message.find("the sigma of sensor \"rough\" cannot be estimated"),
            std::string::npos)
      << result.message;
}

}  // namespace
}  // namespace tangible
