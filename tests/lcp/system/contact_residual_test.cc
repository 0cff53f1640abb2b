// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/contact_residual.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/contact_problems.h"

namespace tangible {
namespace {

using testing::FloorContact;
using Kind = ContactSlack::Kind;

/// A body of mass 1 whose contact is below its centre, at its centre's height: normal and tangent
/// impulses change v_y and v_x alone.
struct Case {
  ContactProblem<double> problem;
  ContactSolution<double> solution;
};

Case MakeCase(double free_x, double free_y, double friction) {
  Case result;
  result.problem = testing::FreeBodies({free_x, free_y, 0.0});
  result.problem.contacts = {FloorContact(0, 0.0, 0.0, friction)};
  result.solution = testing::EmptySolution(result.problem);
  return result;
}

/// The same with impulses that are applied.
Case Solved(double free_x, double free_y, double friction, ContactMode mode, double normal,
            double tangent) {
  Case result = MakeCase(free_x, free_y, friction);
  result.solution.motion = {free_x + tangent, free_y + normal, 0.0};
  result.solution.normal_impulse = {normal};
  result.solution.tangent_impulse = {tangent};
  result.solution.modes = {mode};
  return result;
}

ContactMargin MarginOf(const Case& c) {
  return MarginOfContact(c.problem, c.solution, ContactScales(c.problem, c.solution), 0);
}

double ResidualOf(const Case& c, int* worst) {
  return NaturalResidual(c.problem, c.solution, worst);
}

TEST(ContactResidualTest, ValuesOfAContactAreThoseByHand) {
  ContactProblem<double> problem = testing::FreeBodies({0.0, 0.0, 0.0});
  const ContactBlock<double> contact = FloorContact(0, 0.5, -0.2, 0.3, -0.25);
  ContactSolution<double> solution = testing::EmptySolution(problem);
  solution.motion = {1.0, 2.0, 3.0};
  const double* v = solution.motion.data();
  const ContactValues values = Evaluate(problem, ContactScales(problem, solution), contact, v);
  EXPECT_DOUBLE_EQ(values.s_n, 2.0 + 0.5 * 3.0 - 0.25);
  EXPECT_DOUBLE_EQ(values.slip, 1.0 + 0.2 * 3.0);
  // Scales are no less than the largest term and the constant, and one for both rows of a contact.
  EXPECT_GE(values.scale_n, 2.0 + 0.25);
  EXPECT_DOUBLE_EQ(values.scale_t, values.scale_n);
  EXPECT_DOUBLE_EQ(values.mobility_n, 1.0 + 0.25 / 0.1);
  EXPECT_DOUBLE_EQ(values.mobility_t, 1.0 + 0.04 / 0.1);
  EXPECT_EQ(ImpulseScale({1.0, -3.0, 2.0}), 3.0);
  EXPECT_EQ(ImpulseScale({}), 0.0);
}

// A body at rest that is pushed from both sides: of its speeds 0 is what 0.75 − 0.75 leaves.
TEST(ContactResidualTest, ScalesHoldWhatPassesThroughABodyAtRest) {
  ContactProblem<double> problem = testing::FreeBodies({0.0, 0.0, 0.0, 0.0, -0.75, 0.0});
  problem.contacts = {FloorContact(0, 0.0, 0.0, 0.0, 0.0)};
  ContactSolution<double> solution = testing::EmptySolution(problem);
  solution.motion.assign(6, 0.0);
  solution.normal_impulse = {0.75};
  EXPECT_DOUBLE_EQ(ContactScales(problem, solution).speed[0], 0.75);
  // Not more than all momenta could bring about; without an impulse next to nothing.
  solution.normal_impulse = {1e6};
  EXPECT_DOUBLE_EQ(ContactScales(problem, solution).speed[0], 0.75);
  solution.normal_impulse = {0.0};
  EXPECT_DOUBLE_EQ(ContactScales(problem, solution).speed[0], 0.75e-6);
}

TEST(ContactResidualTest, SolutionsHaveNoneAndFaultsHaveTheirSize) {
  int worst = 7;
  EXPECT_LT(ResidualOf(Solved(0.3, -1.0, 0.5, ContactMode::kSticking, 1.0, -0.3), &worst), 1e-15);
  EXPECT_LT(ResidualOf(Solved(2.0, -1.0, 0.5, ContactMode::kSlidingPositive, 1.0, -0.5), &worst),
            1e-15);
  EXPECT_LT(ResidualOf(Solved(0.0, 1.0, 0.5, ContactMode::kOpen, 0.0, 0.0), &worst), 1e-15);
  // No impulse against an approach at full speed: s / σ = −1.
  EXPECT_DOUBLE_EQ(ResidualOf(Solved(0.0, -1.0, 0.5, ContactMode::kOpen, 0.0, 0.0), &worst), 1.0);
  EXPECT_EQ(worst, 0);
  // Friction 0.8 beyond its limit 0.5, of a scale of 1.
  EXPECT_NEAR(ResidualOf(Solved(0.8, -1.0, 0.5, ContactMode::kSticking, 1.0, -0.8), &worst), 0.3,
              1e-15);
  Case unbalanced = Solved(0.0, -1.0, 0.5, ContactMode::kSticking, 1.0, 0.0);
  unbalanced.solution.normal_impulse[0] = 1.25;
  EXPECT_NEAR(ResidualOf(unbalanced, &worst), 0.25 / 1.25, 1e-15);
  EXPECT_EQ(worst, -1);
  unbalanced.solution.motion[0] = std::nan("");
  EXPECT_EQ(ResidualOf(unbalanced, &worst), HUGE_VAL);
}

// A light body that moves as nothing has pushed it, beside one 1e9 times as heavy.
TEST(ContactResidualTest, ALightBodysMomentumIsNotHiddenByAHeavyOnes) {
  ContactProblem<double> problem;
  problem.num_bodies = 2;
  problem.mass = {1e9, 1e9, 1e8, 1.0, 1.0, 0.1};
  problem.load = {1e9, -1e9, 0.0, 1.0, 0.0, 0.0};
  ContactSolution<double> solution = testing::EmptySolution(problem);
  solution.motion = {1.0, -1.0, 0.0, 1.0, 0.0, 0.0};
  int worst = -1;
  EXPECT_LE(NaturalResidual(problem, solution, &worst), 1e-15);
  solution.motion[3] = 1.0 + 1e-6;
  EXPECT_NEAR(NaturalResidual(problem, solution, &worst), 1e-6, 1e-9);
  solution.motion = {1.0, -1.0, 0.0, 1.0, 0.0, 1e-6};  // rotation at the radius of gyration
  EXPECT_NEAR(NaturalResidual(problem, solution, &worst), 1e-6 * 0.1 / std::sqrt(0.1), 1e-9);
}

TEST(ContactResidualTest, DegenerateAreThoseAtTheBorderOfTwoModes) {
  const auto degenerate = [](const Case& c) {
    std::vector<int> found;
    FindDegenerateContacts(c.problem, c.solution, 1e-9, &found);
    return found;
  };
  const std::vector<int> none;
  const std::vector<int> first = {0};
  EXPECT_EQ(degenerate(Solved(1.0, 0.0, 0.0, ContactMode::kOpen, 0.0, 0.0)), first);
  EXPECT_EQ(degenerate(Solved(1.0, 0.1, 0.0, ContactMode::kOpen, 0.0, 0.0)), none);
  EXPECT_EQ(degenerate(Solved(-0.5, -1.0, 0.5, ContactMode::kSticking, 1.0, 0.5)), first);
  EXPECT_EQ(degenerate(Solved(-0.4, -1.0, 0.5, ContactMode::kSticking, 1.0, 0.4)), none);
  EXPECT_EQ(degenerate(Solved(-0.6, -1.0, 0.5, ContactMode::kSlidingNegative, 1.0, 0.5)), none);
}

/// The same of a decompression with a least impulse.
Case Offset(Case c, double offset, bool driven) {
  c.problem.contacts[0].offset = offset;
  c.problem.contacts[0].driven = driven;
  return c;
}

TEST(ContactResidualTest, AnOffsetShiftsTheNormalImpulse) {
  const Case driven = Offset(Solved(0.0, 0.25, 0.0, ContactMode::kClosed, 0.75, 0.0), 0.75, true);
  const Case closed = Offset(Solved(0.0, -1.0, 0.0, ContactMode::kClosed, 1.0, 0.0), 0.75, false);
  const Case between = Offset(Solved(0.0, -0.75, 0.0, ContactMode::kClosed, 0.75, 0.0), 0.75, true);
  int worst;
  std::vector<int> found;
  for (const Case* c : {&driven, &closed, &between}) {
    EXPECT_LT(ResidualOf(*c, &worst), 1e-15);
    FindDegenerateContacts(c->problem, c->solution, 1e-9, &found);
    EXPECT_EQ(found.size(), c == &between ? 1u : 0u);
  }
  // It pushes less than it must: 0.25 of an impulse of 1.
  EXPECT_NEAR(
      ResidualOf(Offset(Solved(0.0, -1.0, 0.0, ContactMode::kClosed, 1.0, 0.0), 1.25, false),
                 &worst),
      0.25, 1e-15);
  const ContactMargin closing = MarginOf(driven);
  EXPECT_NEAR(closing.value, 1.0, 1e-15);  // of its own speed
  EXPECT_EQ(closing.kind, Kind::kClosing);
  const ContactMargin opening = MarginOf(closed);
  EXPECT_NEAR(opening.value, 0.25, 1e-15);
  EXPECT_EQ(opening.kind, Kind::kOpening);
}

TEST(ContactResidualTest, MarginsAreThoseOfTheNearestMode) {
  const auto expect = [](const Case& c, double value, Kind kind) {
    const ContactMargin margin = MarginOf(c);
    EXPECT_NEAR(margin.value, value, 1e-15);
    EXPECT_EQ(margin.kind, kind);
  };
  expect(Solved(1.0, 0.25, 0.5, ContactMode::kOpen, 0.0, 0.0), 0.25, Kind::kClosing);
  expect(Solved(0.0, -1.0, 0.0, ContactMode::kClosed, 1.0, 0.0), 1.0, Kind::kOpening);
  expect(Solved(0.3, -1.0, 0.5, ContactMode::kSticking, 1.0, -0.3), 0.2, Kind::kFrictionLimit);
  expect(Solved(1.0, -1.0, 0.875, ContactMode::kSlidingPositive, 1.0, -0.875), 0.125,
         Kind::kSlidingSpeed);
  expect(Solved(-1.0, -1.0, 0.875, ContactMode::kSlidingNegative, 1.0, 0.875), 0.125,
         Kind::kSlidingSpeed);
  // Slides fast, hardly pressed: the impulse's scale is that of stopping the whole speed.
  expect(Solved(8.0, -1.0, 0.5, ContactMode::kSlidingPositive, 1.0, -0.5), 0.125, Kind::kOpening);
}

TEST(MostViolatedJointTest, IsTheWorstOfThoseAboveTheShare) {
  ContactProblem<double> problem = testing::FreeBodies({0.0, 0.0, 0.0});
  for (const double rhs : {1.0, 1.5, 1.0}) {
    JointBlock<double> joint;
    joint.a = 0;
    joint.rows = 1;
    joint.row_a[0] = {1.0, 0.0, 0.0};
    joint.rhs[0] = rhs;
    problem.joints.push_back(joint);
  }
  const std::vector<double> v = {1.0, 0.0, 0.0};
  // The second misses by 0.5 of 2.5.
  EXPECT_EQ(MostViolatedJoint(problem, v, v, 0.1), 1);
  EXPECT_EQ(MostViolatedJoint(problem, v, v, 0.3), -1);
  // Beside speeds of 100 that is a share of 0.005.
  EXPECT_EQ(MostViolatedJoint(problem, v, {100.0, 0.0, 0.0}, 0.01), -1);
  EXPECT_EQ(MostViolatedJoint(problem, {}, {}, 0.0), -1);  // nothing was solved
}

}  // namespace
}  // namespace tangible
