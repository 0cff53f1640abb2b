// SPDX-License-Identifier: Apache-2.0
//
// A box at rest on two feet, whose friction the feet can share in many ways.
#include "tangible/lcp/contact/contact_inner_impulses.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/contact_problems.h"

namespace tangible {
namespace {

constexpr double kClosed = 1e-10;

// Mass 2 kg, gyration 1, weight impulse 4 N s, pushed with `push` N s at the height of the floor;
// feet at x = −1 and 1.
ContactProblem<double> SupportedBox(double push, double friction) {
  ContactProblem<double> problem;
  problem.num_bodies = 1;
  problem.mass = {2.0, 2.0, 2.0};
  problem.load = {push, -4.0, 0.0};
  for (const double x : {-1.0, 1.0}) {
    problem.contacts.push_back(testing::FloorContact(0, x, 0.0, friction));
  }
  return problem;
}

// The solution at rest in which the first foot bears as much friction as it can.
ContactSolution<double> FirstAtItsLimit(double push, double friction) {
  ContactSolution<double> solution;
  solution.motion = {0.0, 0.0, 0.0};
  solution.normal_impulse = {2.0, 2.0};
  solution.tangent_impulse = {-2.0 * friction, 2.0 * friction - push};
  solution.modes = {ContactMode::kSlidingPositive, ContactMode::kSticking};
  return solution;
}

// A third foot at `x` that bears nothing.
void AddIdleFoot(double x, double friction, ContactMode mode, ContactProblem<double>* problem,
                 ContactSolution<double>* solution) {
  problem->contacts.push_back(testing::FloorContact(0, x, 0.0, friction));
  solution->normal_impulse.push_back(0.0);
  solution->tangent_impulse.push_back(0.0);
  solution->modes.push_back(mode);
}

TEST(InnerImpulsesTest, BothFeetAreInsideTheirConesWhereThatIsPossible) {
  const ContactProblem<double> problem = SupportedBox(1.5, 0.5);
  ContactSolution<double> solution = FirstAtItsLimit(1.5, 0.5);
  InnerImpulses inner;
  ASSERT_TRUE(inner.Choose(problem, kClosed, &solution));
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(solution.modes[i], ContactMode::kSticking);
    EXPECT_NEAR(solution.normal_impulse[i], 2.0, 1e-12);
    EXPECT_LT(std::abs(solution.tangent_impulse[i]), 0.99);
  }
  EXPECT_NEAR(solution.tangent_impulse[0] + solution.tangent_impulse[1], -1.5, 1e-12);
  EXPECT_EQ(solution.motion, std::vector<double>(3, 0.0));
}

TEST(InnerImpulsesTest, NothingChangesWhereTheSumIsAtItsLimit) {
  const ContactProblem<double> problem = SupportedBox(2.0, 0.5);
  ContactSolution<double> solution = FirstAtItsLimit(2.0, 0.5);
  solution.modes[1] = ContactMode::kSlidingPositive;
  const ContactSolution<double> before = solution;
  InnerImpulses inner;
  EXPECT_FALSE(inner.Choose(problem, kClosed, &solution));
  EXPECT_EQ(solution.modes, before.modes);
  EXPECT_EQ(solution.tangent_impulse, before.tangent_impulse);
}

TEST(InnerImpulsesTest, NothingIsSearchedWhereNoContactIsAtALimit) {
  const ContactProblem<double> problem = SupportedBox(1.5, 0.5);
  ContactSolution<double> solution = FirstAtItsLimit(1.5, 0.5);
  solution.tangent_impulse = {-0.75, -0.75};
  solution.modes[0] = ContactMode::kSticking;
  InnerImpulses inner;
  EXPECT_FALSE(inner.Choose(problem, kClosed, &solution));
}

// A third foot between them that bears nothing, and need not.
TEST(InnerImpulsesTest, AFootWithoutLoadGetsItsShare) {
  ContactProblem<double> problem = SupportedBox(0.0, 0.0);
  ContactSolution<double> solution = FirstAtItsLimit(0.0, 0.0);
  solution.modes = {ContactMode::kClosed, ContactMode::kClosed};
  AddIdleFoot(0.5, 0.0, ContactMode::kOpen, &problem, &solution);
  InnerImpulses inner;
  ASSERT_TRUE(inner.Choose(problem, kClosed, &solution));
  double torque = 0.0;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(solution.modes[i], ContactMode::kClosed);
    EXPECT_GT(solution.normal_impulse[i], 0.01);
    torque += problem.contacts[i].normal_a[2] * solution.normal_impulse[i];
  }
  EXPECT_NEAR(torque, 0.0, 1e-12);
}

// Sliding contacts keep their friction: the two feet share a slip of 0.25 m/s.
TEST(InnerImpulsesTest, AContactThatSlidesStaysAtItsLimit) {
  ContactProblem<double> problem = SupportedBox(2.5, 0.5);
  ContactSolution<double> solution = FirstAtItsLimit(2.0, 0.5);
  solution.motion = {0.25, 0.0, 0.0};
  solution.modes[1] = ContactMode::kSlidingPositive;
  AddIdleFoot(0.0, 0.5, ContactMode::kSlidingPositive, &problem, &solution);
  InnerImpulses inner;
  ASSERT_TRUE(inner.Choose(problem, kClosed, &solution));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(solution.modes[i], ContactMode::kSlidingPositive);
    EXPECT_GT(solution.normal_impulse[i], 0.01);
    EXPECT_NEAR(solution.tangent_impulse[i], -0.5 * solution.normal_impulse[i], 1e-12);
  }
}

}  // namespace
}  // namespace tangible
