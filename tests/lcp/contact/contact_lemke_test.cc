// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "../../support/contact_problems.h"
#include "../../support/sanitizers.h"

namespace tangible {
namespace {

using testing::FloorContact;
using testing::FreeBodies;

TEST(ContactLemkeTest, ModesAndImpulsesOfAPointMass) {
  const struct {
    double vx, friction, tangent;
    ContactMode mode;
  } cases[] = {{1.0, 0.3, -0.3, ContactMode::kSlidingPositive},
               {-1.0, 0.3, 0.3, ContactMode::kSlidingNegative},
               {0.2, 0.3, -0.2, ContactMode::kSticking},
               {0.5, 0.0, 0.0, ContactMode::kClosed}};
  for (const auto& c : cases) {
    ContactProblem<double> p = FreeBodies({c.vx, -1.0, 0.0});
    p.contacts.push_back(FloorContact(0, 0.0, 0.0, c.friction));
    ContactSolution<double> solution = testing::EmptySolution(p);
    int iterations = 0;
    ASSERT_TRUE(SolveContactsByLemke(p, &solution, &iterations));
    EXPECT_GT(iterations, 0);
    EXPECT_EQ(solution.modes[0], c.mode);
    EXPECT_NEAR(solution.normal_impulse[0], 1.0, 1e-14);
    EXPECT_NEAR(solution.tangent_impulse[0], c.tangent, 1e-14);
  }
}

TEST(ContactLemkeTest, JointsAreKept) {
  // Two masses whose heights are joined; one lands.
  ContactProblem<double> p = FreeBodies({0.0, -1.0, 0.0, 0.0, -3.0, 0.0});
  JointBlock<double> joint;
  joint.a = 0;
  joint.b = 1;
  joint.rows = 1;
  joint.row_a[0] = {0.0, 1.0, 0.0};
  joint.row_b[0] = {0.0, -1.0, 0.0};
  joint.rhs[0] = 0.0;
  p.joints.push_back(joint);
  p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.0));
  ContactSolution<double> solution = testing::EmptySolution(p);
  int iterations = 0;
  ASSERT_TRUE(SolveContactsByLemke(p, &solution, &iterations));
  EXPECT_NEAR(solution.normal_impulse[0], 4.0, 1e-13);
  EXPECT_NEAR(solution.joint_impulse[0], -3.0, 1e-13);
  EXPECT_NEAR(solution.motion[4], 0.0, 1e-13);
}

TEST(ContactLemkeTest, ContradictoryJointsAreReported) {
  ContactProblem<double> p = FreeBodies({0.0, -1.0, 0.0});
  for (int k = 0; k < 2; ++k) {
    JointBlock<double> joint;
    joint.a = 0;
    joint.rows = 1;
    joint.row_a[0] = {1.0, 0.0, 0.0};
    joint.row_b[0] = {0.0, 0.0, 0.0};
    joint.rhs[0] = k;
    p.joints.push_back(joint);
  }
  p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.0));
  ContactSolution<double> solution = testing::EmptySolution(p);
  int iterations = 0;
  EXPECT_FALSE(SolveContactsByLemke(p, &solution, &iterations));
}

// Bodies that fall onto the floor, one contact each, as many as said.
ContactProblem<double> FallingBodies(int bodies, int contacts) {
  std::vector<double> twists;
  for (int i = 0; i < bodies; ++i) twists.insert(twists.end(), {0.1, -1.0, 0.0});
  ContactProblem<double> p = FreeBodies(twists);
  for (int i = 0; i < contacts; ++i) p.contacts.push_back(FloorContact(i % bodies, 0.0, 0.0, 0.3));
  return p;
}

// Dense matrices of what is larger are not even made: they would take hundreds of gigabytes.
TEST(ContactLemkeTest, LargeProblemsAreLeftToOtherMethods) {
  const struct {
    int bodies, contacts;
    bool lemke, portfolio;
  } cases[] = {{3, 3, true, true},       {60, 60, true, true},        {61, 61, true, false},
               {101, 101, false, false}, {5, 101, false, false},      {334, 1, false, false},
               {60000, 1, false, false}, {60000, 60000, false, false}};
  for (const auto& c : cases) {
    if (testing::kSanitized && c.lemke && c.bodies > 3) continue;
    const ContactProblem<double> p = FallingBodies(c.bodies, c.contacts);
    ContactSolution<double> solution = testing::EmptySolution(p);
    int iterations = -1;
    EXPECT_EQ(SolveContactsByLemke(p, &solution, &iterations), c.lemke) << c.bodies;
    EXPECT_EQ(iterations > 0, c.lemke);
    EXPECT_EQ(solution.modes[0] != ContactMode::kOpen, c.lemke);
    EXPECT_EQ(FitsDensePortfolio(p), c.portfolio) << c.bodies;
    if (!c.portfolio) {
      EXPECT_FALSE(SolveContactsDense(p, {}, &solution, &iterations));
      EXPECT_EQ(iterations, 0);
    }
    EXPECT_FALSE(ContactsProvedInfeasible(p));
  }
}

// A body between a floor and a ceiling that come nearer, among many that land: what is too large is
// not tried, and not counted.
TEST(ContactLemkeTest, OnlyWhatIsRunIsAFallback) {
  for (const int bodies : {3, 70}) {
    if (testing::kSanitized && bodies > 3) continue;
    ContactProblem<double> p = FallingBodies(bodies, bodies);
    p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.3, -1.0));
    p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.3, -1.0));
    p.contacts.back().normal_a = {0.0, -1.0, 0.0};
    ContactSolution<double> solution = testing::EmptySolution(p);
    ContactSolver solver;
    const ContactSolverReport report = solver.Solve(p, {}, &solution);
    EXPECT_FALSE(report.solved);
    EXPECT_EQ(report.fallbacks.lemke, 1);
    EXPECT_EQ(report.fallbacks.dense, bodies == 3 ? 1 : 0);
    EXPECT_EQ(report.fallbacks.restarts, 0);  // it is proved infeasible
    EXPECT_GT(report.residual, 1e-3);         // beside impulses of all bodies
  }
}

// Lemke's method as the only one that is asked for: where its dense form is too large the report
// still says what is violated and by how much.
TEST(ContactLemkeTest, AProblemTooLargeForItIsUnsolvedAndMeasured) {
  ContactProblem<double> p = FallingBodies(101, 101);
  p.contacts.push_back(FloorContact(7, 0.0, 0.0, 0.3, -1.0));
  p.contacts.back().normal_a = {0.0, -1.0, 0.0};
  ContactSolverOptions options;
  options.choice = SolverChoice::kLemke;
  ContactSolution<double> solution = testing::EmptySolution(p);
  ContactSolver solver;
  const ContactSolverReport report = solver.Solve(p, options, &solution);
  EXPECT_FALSE(report.solved);
  EXPECT_EQ(report.rung, Rung::kNone);
  EXPECT_GE(report.worst_contact, 0);
  EXPECT_GT(report.residual, 0.1);
  EXPECT_EQ(report.fallbacks.dense + report.fallbacks.restarts, 0);
}

}  // namespace
}  // namespace tangible
