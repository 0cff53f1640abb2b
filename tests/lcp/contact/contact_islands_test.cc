// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_islands.h"

#include <gtest/gtest.h>

#include "../../support/contact_problems.h"

namespace tangible {
namespace {

// Stacks of discs on a floor, `tall` discs each, side by side but apart, the discs of all stacks in
// turn; one body that touches nothing, and two on a joint.
ContactProblem<double> Stacks(std::mt19937_64* random, int stacks, int tall) {
  std::vector<double> twists;
  for (int i = 0; i < stacks * tall; ++i) {
    twists.insert(twists.end(), {testing::Draw(random, -0.3, 0.3), testing::Draw(random, -1.0, 0.0),
                                 testing::Draw(random, -0.5, 0.5)});
  }
  twists.insert(twists.end(), {0.1, 0.2, 0.3, 1.0, -1.0, 0.5, 0.0, 2.0, -0.5});
  ContactProblem<double> p = testing::FreeBodies(twists);
  for (int level = 0; level < tall; ++level) {
    for (int stack = 0; stack < stacks; ++stack) {
      const int upper = level * stacks + stack;
      ContactBlock<double> c = testing::FloorContact(upper, 0.0, -0.5, 0.4);
      if (level > 0) {
        c.b = upper - stacks;
        c.normal_b = {0.0, -1.0, 0.0};
        c.tangent_b = {-1.0, 0.0, 0.5};
      }
      p.contacts.push_back(c);
    }
  }
  JointBlock<double> pin;
  pin.a = p.num_bodies - 2;
  pin.b = p.num_bodies - 1;
  pin.rows = 2;
  pin.row_a[0] = {1.0, 0.0, 0.2};
  pin.row_a[1] = {0.0, 1.0, 0.4};
  pin.row_b[0] = {-1.0, 0.0, 0.1};
  pin.row_b[1] = {0.0, -1.0, 0.3};
  pin.rhs[0] = pin.rhs[1] = 0.0;
  p.joints.push_back(pin);
  return p;
}

TEST(IslandSolverTest, WhatIsApartIsSolvedAsTogether) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 40; ++trial) {
    const ContactProblem<double> p = Stacks(&random, 2 + trial % 4, 1 + trial % 3);
    ContactSolution<double> together = testing::EmptySolution(p);
    ContactSolution<double> apart = together;
    ContactSolver solver;
    ASSERT_TRUE(solver.Solve(p, ContactSolverOptions(), &together).solved);
    IslandSolver islands;
    EXPECT_EQ(islands.Partition(p), 2 + trial % 4);
    ContactSolverReport report;
    ASSERT_TRUE(islands.Solve(p, ContactSolverOptions(), &apart, &report));
    EXPECT_EQ(apart.modes, together.modes);
    int worst = -1;
    EXPECT_LT(NaturalResidual(p, apart, &worst), 1e-12);
    // Both solve to 1e-10 of the speeds.
    for (size_t i = 0; i < apart.motion.size(); ++i)
      EXPECT_NEAR(apart.motion[i], together.motion[i], 1e-10);
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      EXPECT_NEAR(apart.normal_impulse[i], together.normal_impulse[i], 1e-10);
      EXPECT_NEAR(apart.tangent_impulse[i], together.tangent_impulse[i], 1e-10);
    }
  }
}

TEST(IslandSolverTest, TheBitsDoNotDependOnThreadsOrEarlierProblems) {
  std::mt19937_64 random(4);
  IslandSolver reused(3);
  for (int trial = 0; trial < 10; ++trial) {
    const ContactProblem<double> p = Stacks(&random, 30, 3);  // enough for threads
    ContactSolution<double> first = testing::EmptySolution(p);
    ContactSolverReport report;
    IslandSolver one(1);
    one.Partition(p);
    ASSERT_TRUE(one.Solve(p, ContactSolverOptions(), &first, &report));
    ContactSolution<double> second = testing::EmptySolution(p);
    reused.Partition(p);
    ASSERT_TRUE(reused.Solve(p, ContactSolverOptions(), &second, &report));
    EXPECT_EQ(first.motion, second.motion);
    EXPECT_EQ(first.normal_impulse, second.normal_impulse);
    EXPECT_EQ(first.tangent_impulse, second.tangent_impulse);
    EXPECT_EQ(first.joint_impulse, second.joint_impulse);
  }
}

// Two floors of one body that drive it both ways: no speed satisfies them.
TEST(IslandSolverTest, AnIslandWithoutSolutionLeavesTheGuess) {
  std::mt19937_64 random(5);
  ContactProblem<double> p = Stacks(&random, 3, 1);
  ContactBlock<double> ceiling = testing::FloorContact(1, 0.0, 0.5, 0.0, -1.0);
  ceiling.normal_a = {0.0, -1.0, 0.0};
  p.contacts.push_back(ceiling);
  p.contacts[1].c_n = -1.0;
  ContactSolution<double> solution = testing::EmptySolution(p);
  IslandSolver islands;
  islands.Partition(p);
  ContactSolverReport report;
  EXPECT_FALSE(islands.Solve(p, ContactSolverOptions(), &solution, &report));
  EXPECT_EQ(solution.motion, testing::EmptySolution(p).motion);
  EXPECT_TRUE(report.worst_contact == 1 || report.worst_contact == 3) << report.worst_contact;
  EXPECT_EQ(report.fallbacks.interior_point, 1);  // of the island that leaned on it
  EXPECT_EQ(report.fallbacks.dense, 1);
}

}  // namespace
}  // namespace tangible
