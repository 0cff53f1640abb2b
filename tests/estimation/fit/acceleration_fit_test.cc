// SPDX-License-Identifier: Apache-2.0
//
// A fit from what a phone shows that swings as a pendulum (acceleration.h), and one of a servo from
// the angle that it turns by.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/fit.h"

namespace tangible {
namespace {

constexpr char kPhone[] = R"({"name": "phone on a string", "bodies": [
  {"name": "phone", "shape": {"box": {"size": [0.07, 0.15]}}, "mass": 0.2, "inertia": 5e-4,
   "position": [0, -0.8]}],
  "joints": [{"name": "pin", "type": "revolute", "bodies": ["phone", "world"], "anchor": [0, 0],
              "angle": 0.5, "damping": 0.002}],
  "simulation": {"dt": 0.01, "duration": 4, "stepping": "event"}})";

constexpr double kMass = 0.2, kInertia = 5e-4, kGravity = 9.81;
constexpr double kLength = 1.1, kDamping = 0.006, kAngle = 0.7;

/// Readings at 50 Hz, by an integration of the pendulum's equation with steps of 0.1 ms:
///   (I + m L²) θ'' = −m g L sin θ − c θ',   x = L θ'' + g sin θ,   y = L θ'² + g cos θ
std::vector<Observation> Record(double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto rate = [](double angle, double omega) {
    return (-kMass * kGravity * kLength * std::sin(angle) - kDamping * omega) /
           (kInertia + kMass * kLength * kLength);
  };
  const double h = 1e-4;
  double angle = kAngle;
  double omega = 0.0;
  std::vector<Observation> observations;
  for (int k = 0; k <= 30000; ++k) {
    if (k % 200 == 0) {
      Observation one;
      one.time = h * k;
      one.body = 0;
      one.sigma = 0.02;
      one.coordinate = Coordinate::kAx;
      one.value =
          kLength * rate(angle, omega) + kGravity * std::sin(angle) + noise * normal(random);
      observations.push_back(one);
      one.coordinate = Coordinate::kAy;
      one.value = kLength * omega * omega + kGravity * std::cos(angle) + noise * normal(random);
      observations.push_back(one);
    }
    // The midpoint rule, whose error is of the order 1e-9.
    const double middle_angle = angle + 0.5 * h * omega;
    const double middle_omega = omega + 0.5 * h * rate(angle, omega);
    angle += h * middle_omega;
    omega += h * rate(middle_angle, middle_omega);
  }
  return observations;
}

FitResult FitPhone(const std::vector<Observation>& observations) {
  FitParameter length;
  length.name = "length";
  length.initial = 0.8;
  length.lower = 0.1;
  length.upper = 3.0;
  length.sets = {{"bodies/phone/position/y", -1.0}};
  ParameterizedScene scene;
  ParameterError error;
  EXPECT_TRUE(scene.Create(
      MakeScene(kPhone), {},
      {length, Parameter("joints/pin/damping", 0.002), Parameter("joints/pin/angle", 0.5)}, &error))
      << error.what;
  Channel phone;
  phone.body_frame = true;
  phone.gravity = true;
  RolloutResiduals residuals(scene, observations, {phone});
  return Fit(FitOptions(), &residuals, {});
}

TEST(AccelerationFitTest, APhoneShowsLengthAndDamping) {
  const double truth[3] = {kLength, kDamping, kAngle};
  const FitResult exact = FitPhone(Record(0.0, 1));
  ASSERT_EQ(exact.status, FitStatus::kConverged) << exact.message;
  EXPECT_EQ(exact.message.find("callback"), std::string::npos) << exact.message;
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(exact.estimate[i], truth[i], 1e-6 * truth[i]) << i;

  const FitResult noisy = FitPhone(Record(0.02, 2));
  ASSERT_EQ(noisy.status, FitStatus::kConverged) << noisy.message;
  for (int i = 0; i < 3; ++i) {
    const double deviation = noisy.uncertainty.standard_deviation[i];
    EXPECT_LT(std::abs(noisy.estimate[i] - truth[i]), 3.5 * deviation) << i;
    EXPECT_LT(deviation, 0.03 * truth[i]) << i;  // 2.3 % of the damping
    std::printf("%s: %.6g ± %.2g\n",
                i == 0   ? "length"
                : i == 1 ? "damping"
                         : "angle",
                noisy.estimate[i], deviation);
  }
}

constexpr char kTurned[] = R"({"name": "servo", "bodies": [
  {"name": "horn", "mass": 1, "inertia": 0.05, "position": [0, 0]}],
  "joints": [{"name": "axle", "type": "revolute", "bodies": ["horn", "world"], "anchor": [0, 0],
              "effort": {"target": 1.2, "stiffness": 2, "damping": 0.1, "limit": 1.2}}],
  "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})";

/// I θ'' = −k (θ − 1.2) − d θ' within ± L, by the midpoint rule with steps of 0.1 ms, at 50 Hz.
std::vector<Observation> Turn(double stiffness, double damping, double limit) {
  const auto rate = [&](double angle, double omega) {
    return std::clamp(-stiffness * (angle - 1.2) - damping * omega, -limit, limit) / 0.05;
  };
  const double h = 1e-4;
  double angle = 0.0, omega = 0.0;
  std::vector<Observation> observations;
  for (int k = 0; k <= 10000; ++k) {
    if (k % 200 == 0) {
      Observation one;
      one.time = h * k;
      one.body = 0;
      one.coordinate = Coordinate::kAngle;
      one.sigma = 1e-3;
      one.value = angle;
      observations.push_back(one);
    }
    const double middle_angle = angle + 0.5 * h * omega;
    const double middle_omega = omega + 0.5 * h * rate(angle, omega);
    angle += h * middle_omega;
    omega += h * rate(middle_angle, middle_omega);
  }
  return observations;
}

TEST(ServoFitTest, TheAngleShowsStiffnessDampingAndLimit) {
  const std::string effort = "joints/axle/effort/";
  const double truth[3] = {3.0, 0.15, 1.5};
  ParameterizedScene scene;
  ParameterError error;
  ASSERT_TRUE(scene.Create(MakeScene(kTurned), {},
                           {Parameter(effort + "stiffness", 2.0),
                            Parameter(effort + "damping", 0.1), Parameter(effort + "limit", 1.2)},
                           &error))
      << error.what;
  RolloutResiduals residuals(scene, Turn(truth[0], truth[1], truth[2]));
  const FitResult fit = Fit(FitOptions(), &residuals, {});
  ASSERT_EQ(fit.status, FitStatus::kConverged) << fit.message;
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(fit.estimate[i], truth[i], 1e-5 * truth[i]) << i;
}

}  // namespace
}  // namespace tangible
