// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/reference_motion.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible {
namespace {

Course By(Stepping stepping, Real dt, int steps) {
  Course course;
  course.stepping = stepping;
  course.dt = dt;
  course.duration = steps * dt;
  course.steps = steps;
  return course;
}

constexpr double kRounding = 1e-15;  // of numbers of size 1

// Up a slope with a deceleration of 6 + 8 μ, and down with 6 − 8 μ.
TEST(ReferenceMotionTest, ABlockTurnsBackOnASlope) {
  Load pull;
  pull.constant = -6.0L;
  const Coordinate end =
      Slide({0.0L, 4.0L}, 1.0L, 0.25L * 8.0L, pull, By(Stepping::kEvent, 0.01L, 90));
  EXPECT_NEAR(static_cast<double>(end.position), 16.0 / 16.0 - 2.0 * 0.4 * 0.4, kRounding);
  EXPECT_NEAR(static_cast<double>(end.speed), -4.0 * 0.4, kRounding);
}

TEST(ReferenceMotionTest, ABlockStopsAndStays) {
  const Coordinate end =
      Slide({0.0L, -1.0L}, 2.0L, 2.0L * 0.2L * 10.0L, Load(), By(Stepping::kEvent, 0.01L, 70));
  EXPECT_NEAR(static_cast<double>(end.position), -0.25, kRounding);
  EXPECT_EQ(end.speed, 0.0L);
}

// x = 10/6 (1 − t0)³ from t0 = 0.5 on.
TEST(ReferenceMotionTest, ARampBreaksABlockLoose) {
  Load ramp;
  ramp.times = {0.0L, 2.0L};
  ramp.values = {0.0L, 20.0L};
  const Coordinate end = Slide({0.0L, 0.0L}, 1.0L, 5.0L, ramp, By(Stepping::kEvent, 0.01L, 100));
  EXPECT_NEAR(static_cast<double>(end.position), 10.0 / 48.0, kRounding);
  EXPECT_NEAR(static_cast<double>(end.speed), 1.25, kRounding);
}

TEST(ReferenceMotionTest, AFixedStepHasTheImpulseOfAWindowsOverlap) {
  Load push;
  push.windows = {{0.05L, 0.25L, 3.0L}};
  const Course course = By(Stepping::kFixed, 0.1L, 4);
  const Coordinate end = Slide({0.0L, 0.0L}, 1.0L, 1.0L, push, course);
  // Impulses 0.15, 0.3, 0.15, 0 less friction of 0.1 a step, while it moves.
  EXPECT_NEAR(static_cast<double>(end.speed), 0.2, kRounding);
  EXPECT_NEAR(static_cast<double>(end.position), 0.1 * (0.05 + 0.25 + 0.3 + 0.2), kRounding);
}

TEST(ReferenceMotionTest, ADiscLandsTwiceAndRolls) {
  Surface floor;
  floor.restitution = 0.5L;
  Disc disc;
  disc.along.speed = 3.0L;
  disc.gap = {1.25L, 0.0L};
  // It lands at 0.5 s with 5 m/s, at 1 s with 2.5 m/s: impulses 7.5 and 3.75 of friction 0.1. The
  // slip falls by three times those.
  const Disc end =
      FallAndRoll(disc, 0.2L, 1.0L, 0.02L, 0.1L, 10.0L, floor, By(Stepping::kEvent, 0.1L, 11));
  EXPECT_NEAR(static_cast<double>(end.along.speed), 2.0, kRounding);
  EXPECT_NEAR(static_cast<double>(end.turn.speed), -10.0, 10.0 * kRounding);
  EXPECT_NEAR(static_cast<double>(end.gap.speed), 1.25 - 1.0, kRounding);
}

TEST(ReferenceMotionTest, AFixedStepLandsOnTheSurfaceAndReboundsFromIt) {
  Load weight;
  weight.constant = -10.0L;
  Surface floor;
  const Course course = By(Stepping::kFixed, 0.1L, 2);
  const Coordinate lands = Bounce({0.15L, -1.0L}, 1.0L, floor, weight, course);
  EXPECT_NEAR(static_cast<double>(lands.position), 0.0, kRounding);
  floor.restitution = 0.5L;
  // In the first step the gap of 0.15 is closed by −2 m/s: it rebounds with 0.5 m/s.
  const Coordinate rebounds = Bounce({0.15L, -1.0L}, 1.0L, floor, weight, course);
  EXPECT_NEAR(static_cast<double>(rebounds.speed), -0.5, kRounding);
  EXPECT_NEAR(static_cast<double>(rebounds.position), 0.15, kRounding);
}

// In a surface as the run starts, without a force: it rebounds from where it is, or is pushed out.
TEST(ReferenceMotionTest, ASunkGapReboundsWhereItIs) {
  Surface surface;
  const Course course = By(Stepping::kEvent, 0.1L, 5);
  const Coordinate out = Bounce({-0.01L, -1.0L}, 1.0L, surface, Load(), course);
  EXPECT_EQ(static_cast<double>(out.position), 0.0);
  surface.restitution = 0.5L;
  const Coordinate leaves = Bounce({-0.01L, -1.0L}, 1.0L, surface, Load(), course);
  EXPECT_NEAR(static_cast<double>(leaves.position), -0.01 + 0.5 * 0.5, kRounding);
}

// sqrt and quotients with their rates.
TEST(ReferenceMotionTest, NumbersHaveRates) {
  const Real x(2.0L, 1.0L);
  const Real y = sqrt(x) * x / (x - 1.0L);
  const long double root = std::sqrt(2.0L);
  EXPECT_NEAR(static_cast<double>(y.value), 2.0 * root, kRounding);
  // 1.5 √x / (x − 1) − √x x / (x − 1)².
  EXPECT_NEAR(static_cast<double>(y.rate), 1.5 * root - 2.0 * root, kRounding);
  EXPECT_EQ(abs(-x).rate, 1.0L);
  EXPECT_NEAR(static_cast<double>((sin(x) * sin(x) + cos(x) * cos(x)).value), 1.0, kRounding);
  EXPECT_NEAR(static_cast<double>(sin(x).rate), std::cos(2.0), kRounding);
  EXPECT_NEAR(static_cast<double>(cos(x).rate), -std::sin(2.0), kRounding);
  EXPECT_NEAR(static_cast<double>(exp(0.5L * x).rate), 0.5 * std::exp(1.0), kRounding);
  EXPECT_NEAR(static_cast<double>(hypot(x, Real(1.5L)).rate), 0.8, kRounding);
  EXPECT_LT(-x, x);
}

TEST(ReferenceMotionTest, ALimitIsLeftAsTheForceTurns) {
  Load drive;
  drive.windows = {{-1.0L, 0.5L, -2.0L}, {0.5L, 10.0L, 4.0L}};
  const Coordinate end =
      Bounce({0.09L, 0.0L}, 1.0L, Surface(), drive, By(Stepping::kEvent, 0.1L, 7));
  EXPECT_NEAR(static_cast<double>(end.position), 2.0 * 0.04, kRounding);
  EXPECT_NEAR(static_cast<double>(end.speed), 0.8, kRounding);
}

// With F_k = F it is Coulomb's friction, and a decay of that of e^(−v²) alone has the closed form
// T = ∫ e^(v²) dv, x = ∫ v e^(v²) dv = (e^(v0²) − 1) / 2.
TEST(ReferenceMotionTest, StribecksDecayDelaysAStop) {
  const Stribeck coulomb = {0.5L, 0.5L, 1.0L};
  EXPECT_NEAR(static_cast<double>(TimeToStop(2.0L, coulomb, 0.25L)), 1.0, kRounding);
  const Stribeck law = {1.0L, 0.0L, 1.0L};
  const Coordinate end = SlideByStribeck({0.0L, -0.5L}, 1.0L, law, Load(), 2.0L);
  EXPECT_NEAR(static_cast<double>(end.position), -0.5 * std::expm1(0.25), kRounding);
  EXPECT_EQ(end.speed, 0.0L);
  EXPECT_NEAR(static_cast<double>(TimeToStop(1.0L, law, 0.5L)), 0.5449871041836222, kRounding);
  EXPECT_NEAR(static_cast<double>(TimeToStop(1.0L, law, Real(0.5L, 1.0L)).rate), std::exp(0.25),
              kRounding);
}

// Shortly before the stop it moves as shortly before, and just after.
TEST(ReferenceMotionTest, StribecksMotionIsOneOnBothSidesOfItsStop) {
  const Stribeck law = {1.0L, 0.5L, 2.0L};
  const Real stops = TimeToStop(1.0L, law, 0.5L);
  const Coordinate at = SlideByStribeck({0.0L, 0.5L}, 1.0L, law, Load(), stops);
  const Coordinate before = SlideByStribeck({0.0L, 0.5L}, 1.0L, law, Load(), stops - 1e-3L);
  EXPECT_NEAR(static_cast<double>(before.speed), 1e-3, 1e-10);
  EXPECT_NEAR(static_cast<double>(at.position - before.position), 0.5e-6, 1e-12);
}

// The load is beyond friction by 2 τ: v ≈ τ² until the decay of friction adds to it.
TEST(ReferenceMotionTest, StribecksFrictionIsBrokenByARamp) {
  Load ramp;
  ramp.times = {0.0L, 10.0L};
  ramp.values = {0.0L, -20.0L};
  const Stribeck slow = {1.0L, 0.5L, 1e6L};
  const Coordinate end = SlideByStribeck({0.0L, 0.0L}, 1.0L, slow, ramp, 1.5L);
  EXPECT_NEAR(static_cast<double>(end.speed), -1.0, 1e-12);
  EXPECT_NEAR(static_cast<double>(end.position), -1.0 / 3.0, 1e-12);
  const Stribeck fast = {1.0L, 0.5L, 0.5L};
  EXPECT_LT(SlideByStribeck({0.0L, 0.0L}, 1.0L, fast, ramp, 1.5L).speed, -1.1L);
  EXPECT_EQ(SlideByStribeck({0.0L, 0.0L}, 1.0L, fast, ramp, 0.5L).speed, 0.0L);
}

}  // namespace
}  // namespace tangible
