// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/reference_planar.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible {
namespace {

constexpr double kStrikeRounding = 1e-15;  // of numbers of size 1

Course Continuous(Real duration) {
  Course course;
  course.stepping = Stepping::kEvent;
  course.duration = duration;
  return course;
}

double KineticEnergy(const PlanarMotion& body, const StruckBox& box) {
  return static_cast<double>(0.5L * box.mass *
                                 (body.x.speed * body.x.speed + body.y.speed * body.y.speed) +
                             0.5L * box.inertia * body.turn.speed * body.turn.speed);
}

// A box at 45° with half sides of 0.1 √2 and 0: its corner is 0.1 before and below the centre.
StruckBox Rod() {
  StruckBox box;
  box.half_width = 0.1L * std::sqrt(2.0L);
  box.half_height = 0.0L;
  box.mass = 1.0L;
  box.inertia = 0.01L;
  box.face = 1.1L;
  return box;
}

PlanarMotion Flying(Real angle) {
  PlanarMotion start;
  start.x.speed = 1.0L;
  start.turn.position = angle;
  return start;
}

// Without friction: W_nn = 1 / m + 0.1² / I = 2, so that an impulse of (1 + e) / 2 acts after 1 s.
TEST(ReferencePlanarTest, AFrictionlessCornerReboundsAndTurnsTheRod) {
  StruckBox box = Rod();
  box.surface.restitution = 0.5L;
  for (const ImpactLaw law : {ImpactLaw::kNewton, ImpactLaw::kPoisson}) {
    box.law = law;
    const PlanarMotion end = StrikeWall(Flying(-std::atan(1.0L)), box, 1.25L);
    EXPECT_NEAR(static_cast<double>(end.x.speed), 1.0 - 0.75, kStrikeRounding);
    EXPECT_NEAR(static_cast<double>(end.x.position), 1.0 + 0.25 * 0.25, kStrikeRounding);
    EXPECT_NEAR(static_cast<double>(end.turn.speed), -0.1 * 0.75 / 0.01, 10.0 * kStrikeRounding);
  }
}

// When and where the corner strikes depends on the angle, and so do both of Poisson's phases.
TEST(ReferencePlanarTest, AnImpactsDerivativeIsThatOfDifferences) {
  StruckBox box = Rod();
  box.surface.restitution = 0.5L;
  box.friction = 0.25L;
  box.law = ImpactLaw::kPoisson;
  const auto end = [&](Real angle) {
    PlanarMotion start = Flying(angle);
    start.y.speed = 0.5L;
    start.turn.speed = 0.25L;
    return StrikeWall(start, box, 1.25L);
  };
  constexpr long double kStep = 1e-5L;
  const PlanarMotion one = end(Real(-0.7L, 1.0L));
  const PlanarMotion up = end(-0.7L + kStep);
  const PlanarMotion down = end(-0.7L - kStep);
  const auto expect = [&](const Coordinate& of, const Coordinate& plus, const Coordinate& minus) {
    EXPECT_NEAR(static_cast<double>(of.position.rate),
                static_cast<double>((plus.position - minus.position) / (2.0L * kStep)), 1e-8);
    EXPECT_NEAR(static_cast<double>(of.speed.rate),
                static_cast<double>((plus.speed - minus.speed) / (2.0L * kStep)), 1e-8);
  };
  expect(one.x, up.x, down.x);
  expect(one.y, up.y, down.y);
  expect(one.turn, up.turn, down.turn);
  EXPECT_GT(abs(one.turn.speed.rate), 0.1L);
}

// W = [2 −1; −1 2], and the corner slips with 0.5 m/s. It sticks in the compression,
// λ¹ = (1 / 2, 0), and in the decompression, λ² = e (1 / 2, 1 / 4). By Newton's law λ = (1, 1 / 4).
TEST(ReferencePlanarTest, PoissonsPhasesActOneAfterTheOther) {
  StruckBox box = Rod();
  box.surface.restitution = 0.75L;
  box.friction = 2.0L;
  PlanarMotion start = Flying(-std::atan(1.0L));
  start.y.speed = 0.5L;
  const PlanarMotion newton = StrikeWall(start, box, 1.0L);
  EXPECT_NEAR(static_cast<double>(newton.x.speed), 0.0, 10.0 * kStrikeRounding);
  EXPECT_NEAR(static_cast<double>(newton.y.speed), 0.75, 10.0 * kStrikeRounding);
  box.law = ImpactLaw::kPoisson;
  const PlanarMotion end = StrikeWall(start, box, 1.0L);
  EXPECT_NEAR(static_cast<double>(end.x.speed), 1.0 - 0.5 * 1.75, 10.0 * kStrikeRounding);
  EXPECT_NEAR(static_cast<double>(end.y.speed), 0.5 + 0.25 * 0.75, 10.0 * kStrikeRounding);
  EXPECT_LT(KineticEnergy(end, box), KineticEnergy(start, box));
}

// The slip of the corner goes on: |λt| = μ λn.
TEST(ReferencePlanarTest, ACornerThatSlides) {
  StruckBox box = Rod();
  box.friction = 0.25L;
  PlanarMotion start = Flying(-std::atan(1.0L));
  start.y.speed = 10.0L;
  const PlanarMotion end = StrikeWall(start, box, 1.0L);
  const Real normal = 1.0L / (2.0L + 0.25L);  // W_nn − μ W_nt with W_nt = −1
  EXPECT_NEAR(static_cast<double>(end.x.speed), static_cast<double>(1.0L - normal),
              kStrikeRounding);
  EXPECT_NEAR(static_cast<double>(end.y.speed), static_cast<double>(10.0L - 0.25L * normal),
              10.0 * kStrikeRounding);
}

TEST(ReferencePlanarTest, ADiscFallsOffTheEndOfAFace) {
  const PlanarMotion end =
      SlideOffFace({0.0L, 2.0L}, {0.1L, 0.0L}, 0.1L, 1.0L, 10.0L, Surface(), Continuous(0.75L));
  EXPECT_NEAR(static_cast<double>(end.x.position), 1.5, kStrikeRounding);
  EXPECT_NEAR(static_cast<double>(end.y.position), 0.1 - 5.0 * 0.0625, kStrikeRounding);
  EXPECT_NEAR(static_cast<double>(end.y.speed), -2.5, kStrikeRounding);
}

// On the edge the face still holds it in that step; from 0.5 m beyond nothing does.
TEST(ReferencePlanarTest, AFixedStepFallsFromTheStepAfterTheEdge) {
  Course course;
  course.dt = 0.25L;
  course.duration = 1.0L;
  course.steps = 4;
  const PlanarMotion end =
      SlideOffFace({0.0L, 2.0L}, {0.1L, 0.0L}, 0.1L, 1.0L, 10.0L, Surface(), course);
  EXPECT_NEAR(static_cast<double>(end.y.speed), -2.5, kStrikeRounding);
  EXPECT_NEAR(static_cast<double>(end.y.position), 0.1 - 0.625, kStrikeRounding);
}

}  // namespace
}  // namespace tangible
