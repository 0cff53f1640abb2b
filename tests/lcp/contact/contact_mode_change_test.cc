// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_mode_change.h"

#include <gtest/gtest.h>

#include "../../support/contact_problems.h"

namespace tangible {
namespace {

constexpr double kTolerance = 1e-10;

// A body of mass 1 on a floor, μ 0.5, its centre's speed given; turning is left out of it.
struct Case {
  Case(double vx, double vy) : p(testing::FreeBodies({vx, vy, 0.0})) {
    p.contacts.push_back(testing::FloorContact(0, 0.0, 0.0, 0.5));
    s = testing::EmptySolution(p);
    s.motion = {vx, vy, 0.0};
  }
  ModeChange Judge(ContactMode mode, double normal, double tangent) {
    const ContactScales scales(p, s);
    const ContactValues values = Evaluate(p, scales, p.contacts[0], s.motion.data());
    return Contradiction(p.contacts[0], values, mode, normal, tangent, 1.0, kTolerance);
  }
  ContactProblem<double> p;
  ContactSolution<double> s;
};

TEST(ContactModeChangeTest, WhatApproachesCloses) {
  // It stops, or slides, by the impulses that it would take alone.
  EXPECT_EQ(Case(0.4, -1.0).Judge(ContactMode::kOpen, 0.0, 0.0).mode, ContactMode::kSticking);
  EXPECT_EQ(Case(0.6, -1.0).Judge(ContactMode::kOpen, 0.0, 0.0).mode,
            ContactMode::kSlidingPositive);
  EXPECT_EQ(Case(-0.6, -1.0).Judge(ContactMode::kOpen, 0.0, 0.0).mode,
            ContactMode::kSlidingNegative);
  EXPECT_GT(Case(0.6, -1.0).Judge(ContactMode::kOpen, 0.0, 0.0).violation, 0.1);
  Case smooth(0.6, -1.0);
  smooth.p.contacts[0].has_friction = false;
  EXPECT_EQ(smooth.Judge(ContactMode::kOpen, 0.0, 0.0).mode, ContactMode::kClosed);
  EXPECT_EQ(Case(0.6, 1.0).Judge(ContactMode::kOpen, 0.0, 0.0).violation, 0.0);
}

TEST(ContactModeChangeTest, ImpulsesAndSlipAreJudgedByTheirMode) {
  Case rest(0.0, 0.0);
  rest.p.load[1] = -1.0;
  EXPECT_EQ(rest.Judge(ContactMode::kSticking, 1.0, 0.49).violation, 0.0);
  EXPECT_EQ(rest.Judge(ContactMode::kSticking, -0.1, 0.0).mode, ContactMode::kOpen);
  EXPECT_EQ(rest.Judge(ContactMode::kSticking, 1.0, 0.51).mode, ContactMode::kSlidingNegative);
  EXPECT_EQ(rest.Judge(ContactMode::kSticking, 1.0, -0.51).mode, ContactMode::kSlidingPositive);
  Case slides(0.2, 0.0);
  EXPECT_EQ(slides.Judge(ContactMode::kSlidingPositive, 1.0, -0.5).violation, 0.0);
  EXPECT_EQ(slides.Judge(ContactMode::kSlidingNegative, 1.0, 0.5).mode, ContactMode::kSticking);
}

TEST(ContactModeChangeTest, ImpulsesAreMovedToTheFirstLimit) {
  ContactProblem<double> p = testing::FreeBodies({0.0, -1.0, 0.0});
  p.contacts.push_back(testing::FloorContact(0, -0.5, 0.0, 0.0));
  p.contacts.push_back(testing::FloorContact(0, 0.5, 0.0, 0.5));
  ContactSolution<double> before = testing::EmptySolution(p);
  before.modes = {ContactMode::kClosed, ContactMode::kSticking};
  before.normal_impulse = {1.0, 1.0};
  ContactSolution<double> after = before;
  after.normal_impulse = {0.9, 1.1};
  // The first falls by 0.1 a step: nine more bring it to 0.
  ExtrapolateImpulses(p, before, &after);
  EXPECT_NEAR(after.normal_impulse[0], 0.0, 1e-5);
  EXPECT_LT(after.normal_impulse[0], 0.0);
  EXPECT_NEAR(after.normal_impulse[1], 2.0, 1e-5);
  // The second meets the limit of friction first: 0.4 + 0.05 k = 0.5 + 0.0 k.
  after.normal_impulse = {0.99, 1.0};
  before.tangent_impulse = {0.0, 0.35};
  after.tangent_impulse = {0.0, 0.4};
  ExtrapolateImpulses(p, before, &after);
  EXPECT_NEAR(after.tangent_impulse[1], 0.5, 1e-6);
}

}  // namespace
}  // namespace tangible
