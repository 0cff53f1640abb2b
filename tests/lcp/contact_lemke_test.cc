// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "contact_problems.h"

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
  EXPECT_NEAR(solution.v[4], 0.0, 1e-13);
}

TEST(ContactLemkeTest, ContradictoryJointsAreTold) {
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

}  // namespace
}  // namespace tangible
