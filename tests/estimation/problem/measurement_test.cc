// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/measurement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace tangible {
namespace {

constexpr Coordinate kAll[] = {Coordinate::kX,       Coordinate::kY,  Coordinate::kAngle,
                               Coordinate::kVx,      Coordinate::kVy, Coordinate::kOmega,
                               Coordinate::kDistance};

/// Three places of no special kind, and instruments.
struct Arrangement {
  double states[kPlaces][6] = {{1.0, 2.0, 0.7, -0.4, 0.3, 2.5},
                               {0.2, -1.0, -0.4, 0.6, 1.1, -0.8},
                               {-0.5, 0.4, 1.9, 0.2, -0.7, 0.9}};
  Vector2<double> at[kPlaces] = {{0.25, -0.5}, {0.1, 0.3}, {-0.2, 0.15}};
  Sensor sensor{"s", 0.01, 1.25, -0.5};
  Camera camera{"c", 700.0, 0.3, {0.4, -0.6}};

  ObservedPlaces Places(int count) const {
    ObservedPlaces places;
    for (int i = 0; i < kPlaces; ++i) {
      // A marker has no reference before it.
      if (i < count || (count == 4 && i == 2)) {
        places[i] = {states[i], 0, at[i]};
      }
    }
    if (count == 4) {
      places[1] = {};
    }
    return places;
  }
};

void ExpectDerivative(double* number, double derivative, const char* what,
                      const std::function<double()>& value) {
  const double x = *number;
  const double h = 1e-6;
  *number = x + h;
  const double high = value();
  *number = x - h;
  const double low = value();
  *number = x;
  // Error h² of the third derivative, and rounding of values of about 1000 over h.
  EXPECT_NEAR(derivative, (high - low) / (2.0 * h), 1e-6 * std::max(1.0, std::abs(derivative)))
      << what;
}

void ExpectDerivatives(Coordinate coordinate, int count, bool with_instruments,
                       double radial_length = 0.0) {
  Arrangement a;
  a.camera.aspect = 1.02;
  a.camera.radial_length = radial_length;
  a.camera.radial = radial_length > 0.0 ? -0.03 : 0.0;
  const auto predict = [&] {
    return PredictRecorded(coordinate, a.Places(count), with_instruments ? &a.sensor : nullptr,
                           with_instruments ? &a.camera : nullptr);
  };
  const auto value = [&] { return predict().value; };
  const Prediction prediction = predict();
  for (int place = 0; place < kPlaces; ++place) {
    for (int i = 0; i < 6; ++i) {
      ExpectDerivative(&a.states[place][i], prediction.by_state[place][i], NameOf(coordinate),
                       value);
    }
    for (int i = 0; i < 2; ++i) {
      ExpectDerivative(&a.at[place][i], prediction.by_at[place][i], NameOf(coordinate), value);
    }
  }
  double* const of_sensor[2] = {&a.sensor.gain, &a.sensor.bias};
  for (int i = 0; i < 2; ++i) {
    ExpectDerivative(of_sensor[i], prediction.by_sensor[i], "sensor", value);
  }
  double* const of_camera[kCameraNumbers] = {&a.camera.scale,      &a.camera.rotation,
                                             &a.camera.origin.x(), &a.camera.origin.y(),
                                             &a.camera.aspect,     &a.camera.radial};
  for (int i = 0; i < kCameraNumbers; ++i) {
    ExpectDerivative(of_camera[i], prediction.by_camera[i], "camera", value);
  }
}

TEST(MeasurementTest, PointsTurnWithTheirBody) {
  const double state[6] = {1.0, 2.0, 0.5 * M_PI, 0.1, 0.2, 3.0};
  const Place place{state, 0, {0.25, -0.5}};
  EXPECT_NEAR(PredictPlain(Coordinate::kX, place).value, 1.5, 1e-15);
  EXPECT_NEAR(PredictPlain(Coordinate::kY, place).value, 2.25, 1e-15);
  EXPECT_EQ(PredictPlain(Coordinate::kAngle, place).value, 0.5 * M_PI);
  // v + omega × r with r = (0.5, 0.25).
  EXPECT_NEAR(PredictPlain(Coordinate::kVx, place).value, 0.1 - 3.0 * 0.25, 1e-15);
  EXPECT_NEAR(PredictPlain(Coordinate::kVy, place).value, 0.2 + 3.0 * 0.5, 1e-15);
  EXPECT_EQ(PredictPlain(Coordinate::kOmega, place).value, 3.0);
}

TEST(MeasurementTest, PlainAndRecordedAreTheSameWithoutInstruments) {
  const Arrangement a;
  for (const Coordinate coordinate : kAll) {
    if (coordinate == Coordinate::kDistance) {
      continue;
    }
    const Prediction plain = PredictPlain(coordinate, a.Places(1)[0]);
    const Prediction recorded = PredictRecorded(coordinate, a.Places(1), nullptr, nullptr);
    EXPECT_NEAR(plain.value, recorded.value, 1e-15) << NameOf(coordinate);
    for (int i = 0; i < 6; ++i) {
      EXPECT_NEAR(plain.by_state[0][i], recorded.by_state[0][i], 1e-15) << NameOf(coordinate);
    }
    for (int i = 0; i < 2; ++i) {
      EXPECT_NEAR(plain.by_at[0][i], recorded.by_at[0][i], 1e-15) << NameOf(coordinate);
    }
  }
}

TEST(MeasurementTest, DerivativesAreThoseOfDifferences) {
  for (const Coordinate coordinate : kAll) {
    ExpectDerivatives(coordinate, 1, false);
    ExpectDerivatives(coordinate, 2, false);
    ExpectDerivatives(coordinate, 1, true);
    ExpectDerivatives(coordinate, 2, true);
    ExpectDerivatives(coordinate, 4, true);  // a marker that moves
    for (const int count : {1, 2, 3, 4}) {
      if (count > 1 || coordinate != Coordinate::kDistance) {
        ExpectDerivatives(coordinate, count, true, 1.5);
      }
    }
  }
}

TEST(MeasurementTest, ACameraTurnsShiftsAndScales) {
  Arrangement a;
  a.at[0] = {0.0, 0.0};
  a.at[2] = {0.0, 0.0};
  const auto value = [&](Coordinate coordinate, int count, const Sensor* sensor) {
    return PredictRecorded(coordinate, a.Places(count), sensor, &a.camera).value;
  };
  // Its x axis points up.
  a.camera = {"c", 100.0, 0.5 * M_PI, {0.5, 1.0}};
  EXPECT_NEAR(value(Coordinate::kX, 1, nullptr), 100.0 * (2.0 - 1.0), 1e-12);
  EXPECT_NEAR(value(Coordinate::kY, 1, nullptr), -100.0 * (1.0 - 0.5), 1e-12);
  EXPECT_NEAR(value(Coordinate::kAngle, 1, nullptr), 0.7 - 0.5 * M_PI, 1e-15);
  EXPECT_NEAR(value(Coordinate::kVx, 1, nullptr), 100.0 * 0.3, 1e-12);
  EXPECT_NEAR(value(Coordinate::kOmega, 1, nullptr), 2.5, 1e-15);
  // What the marker does is not seen of the others.
  EXPECT_NEAR(value(Coordinate::kX, 4, nullptr), 100.0 * (2.0 - 0.4 - 1.0), 1e-12);
  EXPECT_NEAR(value(Coordinate::kVx, 4, nullptr), 100.0 * (0.3 + 0.7), 1e-12);
  // gain 1.25, bias −0.5
  EXPECT_NEAR(value(Coordinate::kX, 1, &a.sensor), 125.0 - 0.5, 1e-12);
}

/// The formula by hand: before the lens the image is at (136.5, -40) and moves by (13.65, 5).
TEST(MeasurementTest, ACameraHasAnAspectAndALens) {
  Arrangement a;
  a.at[0] = {0.0, 0.0};
  a.at[1] = {0.0, 0.0};
  double states[2][6] = {{1.8, 0.1, 0.7, 0.13, 0.05, 2.5}, {0.5, 1.0, 0.2, 0.0, 0.0, 0.0}};
  const auto value = [&](Coordinate coordinate, bool relative) {
    ObservedPlaces places;
    places[0] = {states[0], 0, a.at[0]};
    if (relative) places[1] = {states[1], 0, a.at[1]};
    return PredictRecorded(coordinate, places, nullptr, &a.camera).value;
  };
  a.camera = {"c", 100.0, 0.0, {0.5, 0.5}};
  a.camera.aspect = 1.05;
  EXPECT_NEAR(value(Coordinate::kX, false), 136.5, 1e-12);
  EXPECT_NEAR(value(Coordinate::kY, false), -40.0, 1e-12);
  EXPECT_NEAR(value(Coordinate::kVx, false), 13.65, 1e-12);
  EXPECT_NEAR(value(Coordinate::kX, true), 136.5, 1e-12);
  // A lens that adds nothing.
  a.camera.radial_length = 2.0;
  EXPECT_NEAR(value(Coordinate::kX, true), 136.5, 1e-12);
  EXPECT_NEAR(value(Coordinate::kDistance, true), std::hypot(136.5, -90.0), 1e-12);
  a.camera.radial = 0.1;
  const double stretch = 1.0 + 0.1 * (136.5 * 136.5 + 40.0 * 40.0) / (200.0 * 200.0);
  EXPECT_NEAR(value(Coordinate::kX, false), 136.5 * stretch, 1e-12);
  EXPECT_NEAR(value(Coordinate::kY, false), -40.0 * stretch, 1e-12);
  const double rate = 0.1 * 2.0 * (136.5 * 13.65 - 40.0 * 5.0) / (200.0 * 200.0);
  EXPECT_NEAR(value(Coordinate::kVx, false), 13.65 * stretch + 136.5 * rate, 1e-12);
  EXPECT_NEAR(value(Coordinate::kVy, false), 5.0 * stretch - 40.0 * rate, 1e-12);
  // The other point's own image is (0, 50) (1 + 0.1 / 16).
  EXPECT_NEAR(value(Coordinate::kX, true), 136.5 * stretch, 1e-12);
  EXPECT_NEAR(value(Coordinate::kY, true), -40.0 * stretch - 50.0 * (1.0 + 0.1 / 16.0), 1e-12);
  // Neither changes an angle.
  EXPECT_NEAR(value(Coordinate::kAngle, false), 0.7, 1e-15);
  EXPECT_NEAR(value(Coordinate::kAngle, true), 0.5, 1e-15);
  EXPECT_NEAR(value(Coordinate::kOmega, false), 2.5, 1e-15);
}

TEST(MeasurementTest, DistancesHaveADerivativeAt0) {
  Arrangement a;
  std::copy(a.states[0], a.states[0] + 6, a.states[1]);
  a.at[1] = a.at[0];
  const Prediction prediction =
      PredictRecorded(Coordinate::kDistance, a.Places(2), nullptr, nullptr);
  EXPECT_EQ(prediction.value, 0.0);
  EXPECT_EQ(prediction.by_state[0][0], 1.0);
  EXPECT_EQ(prediction.by_state[1][0], -1.0);
}

TEST(MeasurementTest, ClocksAndDelaysSayWhenTheRunIsSeen) {
  Instruments instruments;
  instruments.sensors = {{"s", 0.25}};
  instruments.clocks = {{"c", 2.0, 0.5}};
  EXPECT_EQ(RunTime(instruments, {}, 3.0), 3.0);
  EXPECT_EQ(RunTime(instruments, {.sensor = 0}, 3.0), 2.75);
  EXPECT_EQ(RunTime(instruments, {.clock = 0}, 3.0), 6.5);
  EXPECT_EQ(RunTime(instruments, {.sensor = 0, .clock = 0}, 3.0), 6.25);
  const auto numbers = EnumerateNumbers(&instruments);
  ASSERT_EQ(numbers.size(), 5u);
  EXPECT_EQ(numbers[0].path, "sensors/s/delay");
  EXPECT_EQ(numbers[static_cast<size_t>(instruments.ClockNumber(0))].path, "clocks/c/rate");
  EXPECT_EQ(numbers[4].value, &instruments.clocks[0].offset);
}

}  // namespace
}  // namespace tangible
