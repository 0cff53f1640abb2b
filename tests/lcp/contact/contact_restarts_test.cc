// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "../../support/contact_problems.h"
#include "tangible/verification/corpus/contact_case.h"
#include "tangible/verification/corpus/recomputed.h"

namespace tangible {
namespace {

using corpus::ContactCase;
using corpus::MakeContactCase;
using testing::EmptySolution;
using testing::FloorContact;
using testing::FreeBodies;

constexpr int kMostContacts = 100;

// Drawn speeds, modes and impulses with friction up to 2 that no other method finds: paths that are
// longer than 20 pivots a contact (260, 283), or end in a jam of 11 rows on 9 velocities, which all
// paths from open contacts do (135).
TEST(ContactRestartsTest, SolvesWhatOnePathDoesNot) {
  for (const int index : {135, 260, 283}) {
    const ContactCase one = MakeContactCase("restitution", 1, index, kMostContacts);
    ContactSolution<double> solution = EmptySolution(one.problem);
    ContactSolver solver;
    const ContactSolverReport report = solver.Solve(one.problem, {}, &solution);
    EXPECT_TRUE(report.solved) << one.name;
    EXPECT_EQ(report.rung, Rung::kRestarts) << one.name;
    EXPECT_LE(corpus::RecomputedResidual(one.problem, solution), 1e-10) << one.name;
  }
}

// One whose usual path ends in proximal steps that take turns.
TEST(ContactRestartsTest, SolvesTheSameFromAMisleadingStart) {
  const ContactCase one = MakeContactCase("restitution", 1, 47, kMostContacts);
  ContactSolution<double> solution = EmptySolution(one.problem);
  for (size_t i = 0; i < one.problem.contacts.size(); ++i) {
    const bool friction = one.problem.contacts[i].has_friction;
    solution.modes[i] = friction ? ContactMode::kSticking : ContactMode::kClosed;
    solution.normal_impulse[i] = 100.0;
  }
  ContactSolver solver;
  EXPECT_TRUE(solver.Solve(one.problem, {}, &solution).solved);
  EXPECT_LE(corpus::RecomputedResidual(one.problem, solution), 1e-10);
}

// A body between a floor and a ceiling that come nearer: proved, so that nothing is tried again.
TEST(ContactRestartsTest, WhatIsProvedInfeasibleIsNotTriedAgain) {
  ContactProblem<double> p = FreeBodies({0.0, 0.0, 0.0});
  p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.5, -1.0));
  p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.5, -1.0));
  EXPECT_FALSE(ContactsProvedInfeasible(p));
  p.contacts[1].normal_a = {0.0, -1.0, 0.0};
  EXPECT_TRUE(ContactsProvedInfeasible(p));
  ContactSolution<double> solution = EmptySolution(p);
  ContactSolver solver;
  const ContactSolverReport report = solver.Solve(p, {}, &solution);
  EXPECT_FALSE(report.solved);
  EXPECT_GE(report.worst_contact, 0);
  EXPECT_GT(report.residual, 0.1);
  EXPECT_LT(report.factorisations, 1000);
}

}  // namespace
}  // namespace tangible
