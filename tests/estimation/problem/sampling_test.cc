// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/sampling.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible {
namespace {

Observation At(double time, int body) {
  Observation observation;
  observation.time = time;
  observation.body = body;
  return observation;
}

TEST(SamplingTest, TimesOnStepsReadOneStateAndOthersTwo) {
  SimulationSettings settings;
  settings.dt = 0.1;
  settings.duration = 0.25;  // the last step is half as long
  // 3 * 0.1 - 0.1 is not 0.2 in binary.
  const SamplePlan plan({At(0.0, 0), At(0.125, 0), At(3 * 0.1 - 0.1, 0), At(0.24, 0), At(0.25, 0)},
                        settings);
  ASSERT_EQ(plan.num_samples(), 5);
  EXPECT_EQ(plan.last_step(), 3);
  EXPECT_EQ(plan.samples()[0].step, 0);
  EXPECT_EQ(plan.samples()[0].part, 0.0);
  EXPECT_EQ(plan.samples()[1].step, 1);
  EXPECT_NEAR(plan.samples()[1].part, 0.25, 1e-12);
  EXPECT_EQ(plan.samples()[2].step, 2);
  EXPECT_EQ(plan.samples()[2].part, 0.0);
  EXPECT_EQ(plan.samples()[3].step, 2);
  EXPECT_NEAR(plan.samples()[3].part, 0.8, 1e-12);
  EXPECT_EQ(plan.samples()[4].step, 3);
  double sums[5] = {};
  for (long k = 0; k <= plan.last_step(); ++k) {
    for (const SampleShare& share : plan.SharesAt(k)) {
      sums[share.sample] += share.weight;
    }
  }
  for (const double sum : sums) {
    EXPECT_DOUBLE_EQ(sum, 1.0);
  }
}

TEST(SamplingTest, CoordinatesOfOneBodyAtOneTimeShareASample) {
  Observation y = At(0.3, 1);
  y.coordinate = Coordinate::kY;
  const SamplePlan plan({At(0.3, 1), y, At(0.3, 0), At(0.3, 1)}, SimulationSettings());
  EXPECT_EQ(plan.num_samples(), 2);
  EXPECT_EQ(plan.sample_of(), (std::vector<int>{0, 0, 1, 0}));
}

TEST(SamplingTest, PointsTurnWithTheirBody) {
  const double pose[3] = {1.0, 2.0, 0.5 * M_PI};
  const Vector2<double> at(0.25, -0.5);
  EXPECT_NEAR(Predict(Coordinate::kX, pose, at).value, 1.5, 1e-15);
  EXPECT_NEAR(Predict(Coordinate::kY, pose, at).value, 2.25, 1e-15);
  EXPECT_EQ(Predict(Coordinate::kAngle, pose, at).value, 0.5 * M_PI);
}

TEST(SamplingTest, DerivativesAreThoseOfDifferences) {
  const double pose[3] = {1.0, 2.0, 0.7};
  const Vector2<double> at(0.25, -0.5);
  const double h = 1e-6;
  for (const Coordinate coordinate : {Coordinate::kX, Coordinate::kY, Coordinate::kAngle}) {
    const Prediction prediction = Predict(coordinate, pose, at);
    // Central differences of smooth functions of order 1: error h² / 6 and rounding 1e-16 / h.
    const double tolerance = 1e-9;
    for (int i = 0; i < 3; ++i) {
      double low[3] = {pose[0], pose[1], pose[2]};
      double high[3] = {pose[0], pose[1], pose[2]};
      low[i] -= h;
      high[i] += h;
      const double difference =
          (Predict(coordinate, high, at).value - Predict(coordinate, low, at).value) / (2.0 * h);
      EXPECT_NEAR(prediction.by_pose[i], difference, tolerance);
    }
    for (int i = 0; i < 2; ++i) {
      Vector2<double> low = at;
      Vector2<double> high = at;
      low[i] -= h;
      high[i] += h;
      const double difference =
          (Predict(coordinate, pose, high).value - Predict(coordinate, pose, low).value) /
          (2.0 * h);
      EXPECT_NEAR(prediction.by_at[i], difference, tolerance);
    }
  }
}

}  // namespace
}  // namespace tangible
