// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_decompression.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/contact_problems.h"

namespace tangible {
namespace {

using testing::FloorContact;

struct Solved {
  ContactSolverReport report;
  ContactProblem<double> problem;
  ContactSolution<double> solution;
};

Solved Decompress(const ContactProblem<double>& problem, ContactMode guess) {
  Solved s;
  s.problem = problem;
  s.solution = testing::EmptySolution(problem);
  s.solution.modes.assign(problem.contacts.size(), guess);
  DecompressionSolver solver;
  s.report = solver.Solve({}, &s.problem, &s.solution);
  EXPECT_TRUE(s.report.solved) << s.report.residual;
  return s;
}

// A body of mass 1 and inertia 0.1 that a contact right below its centre, at its height, pushes.
Solved Push(double vx, double vy, double offset, double friction) {
  ContactProblem<double> problem = testing::FreeBodies({vx, vy, 0.0});
  problem.contacts = {FloorContact(0, 0.0, 0.0, friction)};
  problem.contacts[0].offset = offset;
  return Decompress(problem, friction > 0.0 ? ContactMode::kSticking : ContactMode::kClosed);
}

TEST(DecompressionSolverTest, ADrivenContactPushesByItsOffset) {
  const Solved s = Push(0.3, 0.0, 0.7, 0.0);
  EXPECT_TRUE(s.problem.contacts[0].driven);
  EXPECT_DOUBLE_EQ(s.solution.normal_impulse[0], 0.7);
  EXPECT_DOUBLE_EQ(s.solution.motion[1], 0.7);
  EXPECT_DOUBLE_EQ(s.solution.motion[0], 0.3);
}

TEST(DecompressionSolverTest, ItSlidesOrSticksByTheWholeImpulse) {
  const Solved slides = Push(-0.3, 0.0, 0.7, 0.2);
  EXPECT_TRUE(slides.problem.contacts[0].driven);
  EXPECT_EQ(slides.solution.modes[0], ContactMode::kSlidingNegative);
  EXPECT_DOUBLE_EQ(slides.solution.tangent_impulse[0], 0.14);
  EXPECT_DOUBLE_EQ(slides.solution.motion[0], -0.16);
  const Solved sticks = Push(-0.3, 0.0, 0.7, 0.5);
  EXPECT_TRUE(sticks.problem.contacts[0].driven);
  EXPECT_EQ(sticks.solution.modes[0], ContactMode::kSticking);
  EXPECT_NEAR(sticks.solution.tangent_impulse[0], 0.3, 1e-15);
  EXPECT_NEAR(sticks.solution.motion[0], 0.0, 1e-15);
}

TEST(DecompressionSolverTest, WhatWouldApproachClosesWithMoreThanItsOffset) {
  // Corners at ±0.5: each impulse turns the other corner down by 1 − 0.25 / 0.1 = −1.5.
  ContactProblem<double> problem = testing::FreeBodies({0.0, 0.0, 0.0});
  problem.contacts = {FloorContact(0, -0.5, 0.0, 0.0), FloorContact(0, 0.5, 0.0, 0.0)};
  problem.contacts[0].offset = 1.0;
  problem.contacts[1].offset = 0.05;
  const Solved s = Decompress(problem, ContactMode::kClosed);
  EXPECT_TRUE(s.problem.contacts[0].driven);
  EXPECT_FALSE(s.problem.contacts[1].driven);
  EXPECT_EQ(s.solution.modes[1], ContactMode::kClosed);
  EXPECT_NEAR(s.solution.normal_impulse[1], 1.5 / 3.5, 1e-15);
  EXPECT_NEAR(s.solution.motion[1] + 0.5 * s.solution.motion[2], 0.0, 1e-15);
  EXPECT_NEAR(s.solution.motion[1] - 0.5 * s.solution.motion[2], 3.5 - 1.5 * 1.5 / 3.5, 1e-14);
}

TEST(DecompressionSolverTest, AnOffsetThatDoesNotEndAnApproachIsExceeded) {
  const Solved s = Push(0.0, -1.0, 0.7, 0.0);
  EXPECT_FALSE(s.problem.contacts[0].driven);
  EXPECT_DOUBLE_EQ(s.solution.normal_impulse[0], 1.0);
  EXPECT_NEAR(s.solution.motion[1], 0.0, 1e-15);
}

TEST(DecompressionSolverTest, ABodyStoppedInCompressionIsPushedFromBothSides) {
  // Body 1 pushes off body 0 at two points, that from the floor, which does not rebound. What
  // rounding leaves of body 0 says nothing of the speeds.
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 50; ++trial) {
    ContactProblem<double> problem = testing::FreeBodies({0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
    problem.load[1] = testing::Draw(&random, -1e-32, 1e-32);
    problem.load[2] = testing::Draw(&random, -1e-32, 1e-32);
    problem.contacts = {FloorContact(0, -0.115488, 0.0, 0.0), FloorContact(0, 0.115488, 0.0, 0.0),
                        FloorContact(1, -0.06, 0.0, 0.0), FloorContact(1, 0.05, 0.0, 0.0)};
    const double arms[] = {testing::Draw(&random, -0.1, 0.0), testing::Draw(&random, 0.0, 0.1)};
    double push = 0.0;
    for (int k = 0; k < 2; ++k) {
      ContactBlock<double>& contact = problem.contacts[2 + k];
      contact.b = 0;
      contact.normal_b = {0.0, -1.0, -arms[k]};
      contact.offset = testing::Draw(&random, 1.0, 2.0);
      push += contact.offset;
    }
    const Solved s = Decompress(problem, ContactMode::kClosed);
    EXPECT_TRUE(s.problem.contacts[2].driven && s.problem.contacts[3].driven);
    EXPECT_NEAR(s.solution.normal_impulse[0] + s.solution.normal_impulse[1], push, 1e-14);
    EXPECT_NEAR(s.solution.motion[1], 0.0, 1e-14);
    EXPECT_NEAR(s.solution.motion[4], push, 1e-14);
  }
}

// Complementarity recomputed from the data, row by row.
void ExpectSolution(const Solved& s) {
  constexpr double kTolerance = 1e-9;
  const double* v = s.solution.motion.data();
  for (size_t i = 0; i < s.problem.contacts.size(); ++i) {
    const ContactBlock<double>& c = s.problem.contacts[i];
    const double normal = s.solution.normal_impulse[i];
    const double tangent = s.solution.tangent_impulse[i];
    const double speed = RowDot(c.a, c.normal_a, c.b, c.normal_b, v) + c.c_n;
    const double slip = RowDot(c.a, c.tangent_a, c.b, c.tangent_b, v) + c.c_t;
    EXPECT_GE(speed, -kTolerance);
    EXPECT_GE(normal, c.offset - kTolerance);
    EXPECT_NEAR(speed * (normal - c.offset), 0.0, kTolerance);
    EXPECT_EQ(c.driven && c.offset == 0.0, false);
    if (c.has_friction) {
      EXPECT_LE(std::abs(tangent), c.friction * normal + kTolerance);
      EXPECT_NEAR(slip * tangent, -c.friction * normal * std::abs(slip), kTolerance);
    } else {
      EXPECT_EQ(tangent, 0.0);
    }
  }
}

TEST(DecompressionSolverTest, RandomProblemsAreSolvedAsByTheDenseForm) {
  std::mt19937_64 random(11);
  int solved = 0;
  int by_dense = 0;  // where changes of modes do not settle
  int driven = 0;
  int closed = 0;
  for (int trial = 0; trial < 300; ++trial) {
    ContactProblem<double> problem =
        testing::RandomContactProblem(&random, 4 + trial % 3, 5 + trial % 4);
    for (ContactBlock<double>& contact : problem.contacts) {
      contact.offset = random() % 3 == 0 ? 0.0 : testing::Draw(&random, 0.0, 0.4);
    }
    ContactSolution<double> dense = testing::EmptySolution(problem);
    int iterations = 0;
    // Random rows with friction need not have a solution.
    if (!SolveContactsDense(problem, {}, &dense, &iterations)) continue;
    ++solved;
    ExpectSolution({{}, problem, dense});
    const Solved s = Decompress(problem, ContactMode::kOpen);
    ExpectSolution(s);
    by_dense += s.report.rung == Rung::kDense ? 1 : 0;
    double difference = 0.0;
    for (size_t i = 0; i < dense.motion.size(); ++i) {
      difference = std::max(difference, std::abs(dense.motion[i] - s.solution.motion[i]));
    }
    EXPECT_LT(difference, 1e-8) << trial;
    for (size_t i = 0; i < problem.contacts.size(); ++i) {
      driven += s.problem.contacts[i].driven && problem.contacts[i].has_friction ? 1 : 0;
      closed += !s.problem.contacts[i].driven && s.solution.modes[i] != ContactMode::kOpen ? 1 : 0;
    }
  }
  EXPECT_GT(solved, 250);
  EXPECT_GT(by_dense, 1);
  EXPECT_GT(driven, 100);
  EXPECT_GT(closed, 50);
}

TEST(DecompressionSolverTest, AContradictionIsNotASolution) {
  // A wall that moves in at 1 m/s on each side of a body.
  ContactProblem<double> problem = testing::FreeBodies({0.0, 0.0, 0.0});
  problem.contacts = {FloorContact(0, 0.0, 0.0, 0.0, -1.0), FloorContact(0, 0.0, 0.0, 0.0, -1.0)};
  problem.contacts[1].normal_a = {0.0, -1.0, 0.0};
  problem.contacts[0].offset = 0.5;
  ContactSolution<double> solution = testing::EmptySolution(problem);
  DecompressionSolver solver;
  EXPECT_FALSE(solver.Solve({}, &problem, &solution).solved);
}

}  // namespace
}  // namespace tangible
