// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/recomputed.h"

#include <gtest/gtest.h>

#include <limits>

#include "tangible/lcp/dense/problem.h"
#include "tangible/verification/corpus/contact_case.h"

namespace tangible::corpus {
namespace {

TEST(RecomputedTest, EachPartOfAContactSolutionCounts) {
  const ContactCase one = MakeContactCase("restitution", 2, 4, 60);
  ASSERT_LE(RecomputedResidual(one.problem, one.drawn), 1e-14);
  const auto spoiled = [&](auto spoil) {
    ContactSolution<double> x = one.drawn;
    spoil(x);
    return RecomputedResidual(one.problem, x);
  };
  EXPECT_GT(spoiled([](auto& x) { x.motion[0] += 1e-3; }), 1e-8);
  EXPECT_GT(spoiled([](auto& x) { x.motion[0] = std::numeric_limits<double>::quiet_NaN(); }),
            1e300);
  EXPECT_GT(spoiled([](auto& x) { x.motion.pop_back(); }), 1e300);
  for (size_t i = 0; i < one.problem.contacts.size(); ++i) {
    EXPECT_GT(spoiled([i](auto& x) { x.normal_impulse[i] += 1e-3; }), 1e-8) << i;
    EXPECT_GT(spoiled([i](auto& x) { x.tangent_impulse[i] += 1e-3; }), 1e-8) << i;
  }
}

// One body on one contact: momentum is balanced in each, so that the contact's own laws decide.
double OneContact(double speed, double normal, double tangent, double slip) {
  ContactProblem<double> p;
  p.num_bodies = 1;
  p.mass = {1.0, 1.0, 0.1};
  p.load = {slip - tangent, speed - normal, 0.0};
  ContactBlock<double> c;
  c.a = 0;
  c.normal_a = {0, 1, 0};
  c.tangent_a = {1, 0, 0};
  c.normal_b = c.tangent_b = {0, 0, 0};
  c.c_n = c.c_t = 0.0;
  c.friction = 0.5;
  c.has_friction = true;
  p.contacts = {c};
  return RecomputedResidual(p, {{slip, speed, 0.0}, {}, {normal}, {tangent}, {ContactMode::kOpen}});
}

TEST(RecomputedTest, SignoriniAndCoulomb) {
  EXPECT_LE(OneContact(1.0, 0.0, 0.0, 1.0), 1e-15);   // open
  EXPECT_LE(OneContact(0.0, 1.0, 0.3, 0.0), 1e-15);   // sticks
  EXPECT_LE(OneContact(0.0, 1.0, -0.5, 1.0), 1e-15);  // slides
  EXPECT_LE(OneContact(0.0, 1.0, 0.5, -1.0), 1e-15);
  EXPECT_GT(OneContact(-1.0, 0.0, 0.0, 0.0), 0.1);  // penetrates
  EXPECT_GT(OneContact(0.0, -1.0, 0.0, 0.0), 0.1);  // pulls
  EXPECT_GT(OneContact(1.0, 1.0, 0.0, 0.0), 0.1);   // pushes what is apart
  EXPECT_GT(OneContact(0.0, 1.0, 0.6, 0.0), 0.05);  // beyond the cone
  EXPECT_GT(OneContact(0.0, 1.0, 0.5, 1.0), 0.1);   // along the sliding
  EXPECT_GT(OneContact(0.0, 1.0, 0.0, 1.0), 0.1);   // too little
}

TEST(RecomputedTest, MixedProblems) {
  MixedLcp<double> p;
  p.M = MatrixX<double>::Identity(2, 2);
  p.p = Eigen::Vector2d(1.0, -1.0);
  p.A = Eigen::RowVector2d(1.0, 0.0);
  p.b = VectorX<double>::Constant(1, 0.5);
  p.G = Eigen::RowVector2d(0.0, 1.0);
  p.F = MatrixX<double>::Zero(1, 1);
  p.c = VectorX<double>::Zero(1);
  const VectorX<double> y = VectorX<double>::Constant(1, -0.5);
  const VectorX<double> z = VectorX<double>::Constant(1, 1.0);
  EXPECT_LE(RecomputedResidual(p, Eigen::Vector2d(0.5, 0.0), y, z), 1e-15);
  EXPECT_GT(RecomputedResidual(p, Eigen::Vector2d(0.6, 0.0), y, z), 0.01);
  EXPECT_GT(RecomputedResidual(p, Eigen::Vector2d(0.5, 0.1), y, z), 0.01);
  EXPECT_GT(RecomputedResidual(p, Eigen::Vector2d(0.5, 0.0), y, 0.9 * z), 0.01);
  EXPECT_GT(RecomputedResidual(p, Eigen::Vector2d(0.5, 0.0), 0.9 * y, z), 0.01);
  EXPECT_GT(RecomputedResidual(p, VectorX<double>::Zero(3), y, z), 1e300);
}

TEST(RecomputedTest, ProofsOfInfeasibility) {
  // s = −z − 1.
  MixedLcp<double> p;
  p.F = MatrixX<double>::Constant(1, 1, -1.0);
  p.c = VectorX<double>::Constant(1, -1.0);
  ConformEmptyBlocks(p);
  const VectorX<double> one = VectorX<double>::Constant(1, 1.0);
  EXPECT_TRUE(ProvesInfeasible(p, one));
  EXPECT_FALSE(ProvesInfeasible(p, -one));
  EXPECT_FALSE(ProvesInfeasible(p, VectorX<double>()));
  p.F(0, 0) = 1.0;  // z = 1 does
  EXPECT_FALSE(ProvesInfeasible(p, one));
  p.F(0, 0) = -1.0;
  p.c[0] = 1.0;  // z = 0 does
  EXPECT_FALSE(ProvesInfeasible(p, one));
}

}  // namespace
}  // namespace tangible::corpus
