// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_interior_point.h"

#include <gtest/gtest.h>

#include "../../support/contact_problems.h"

namespace tangible {
namespace {

using testing::FloorContact;
using testing::FreeBodies;

InteriorPointOutcome RunSolver(const ContactProblem<double>& p, double complementarity,
                               ContactSolution<double>* solution) {
  InteriorPointWorkspace<double> workspace;
  ContactInteriorPointOptions options;
  options.complementarity = complementarity;
  *solution = testing::EmptySolution(p);
  return SolveContactsByInteriorPoint(p, options, &workspace, solution);
}

TEST(ContactInteriorPointTest, SlidingStickingAndOpen) {
  // A point mass on a floor (arm 0): friction takes μ times the normal impulse, or all there is.
  const struct {
    double vx, friction, expected_vx;
    ContactMode mode;
  } cases[] = {{1.0, 0.3, 0.7, ContactMode::kSlidingPositive},
               {-1.0, 0.3, -0.7, ContactMode::kSlidingNegative},
               {0.2, 0.3, 0.0, ContactMode::kSticking},
               {0.5, 0.0, 0.5, ContactMode::kClosed},
               {0.2, 1e3, 0.0, ContactMode::kSticking}};
  for (const auto& c : cases) {
    ContactProblem<double> p = FreeBodies({c.vx, -1.0, 0.0});
    p.contacts.push_back(FloorContact(0, 0.0, 0.0, c.friction));
    ContactSolution<double> solution;
    EXPECT_TRUE(RunSolver(p, 1e-14, &solution).converged);
    EXPECT_NEAR(solution.motion[0], c.expected_vx, 1e-6) << c.friction;
    EXPECT_NEAR(solution.motion[1], 0.0, 1e-6);
    EXPECT_EQ(solution.modes[0], c.mode);
  }
  ContactProblem<double> apart = FreeBodies({1.0, 0.5, 0.0});
  apart.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.3));
  ContactSolution<double> solution;
  EXPECT_TRUE(RunSolver(apart, 1e-14, &solution).converged);
  EXPECT_EQ(solution.modes[0], ContactMode::kOpen);
  EXPECT_NEAR(solution.motion[1], 0.5, 1e-6);
}

TEST(ContactInteriorPointTest, MassRatioOfAMillion) {
  // A light ball between the floor and one a million times heavier that comes down on it.
  ContactProblem<double> p = FreeBodies({0.0, -0.1, 0.0, 0.0, -1.0, 0.0});
  for (int i = 3; i < 6; ++i) {
    p.mass[i] *= 1e6;
    p.load[i] *= 1e6;
  }
  p.contacts.push_back(FloorContact(0, 0.0, -0.1, 0.5));
  ContactBlock<double> upper = FloorContact(1, 0.0, -0.1, 0.5);
  upper.b = 0;
  upper.normal_b = {0.0, -1.0, 0.0};
  upper.tangent_b = {-1.0, 0.0, 0.1};
  p.contacts.push_back(upper);
  ContactSolution<double> solution;
  EXPECT_TRUE(RunSolver(p, 1e-14, &solution).converged);
  EXPECT_NEAR(solution.motion[1], 0.0, 1e-6);
  EXPECT_NEAR(solution.motion[4], 0.0, 1e-6);
  EXPECT_NEAR(solution.normal_impulse[0], 1e6 + 0.1, 1.0);
}

TEST(ContactInteriorPointTest, StopsAtTheComplementarityAskedFor) {
  // One frictionless contact: no friction rows, λ = 1.
  ContactProblem<double> p = FreeBodies({0.0, -1.0, 0.0});
  p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.0));
  ContactSolution<double> loose, tight;
  const InteriorPointOutcome first = RunSolver(p, 1e-4, &loose);
  const InteriorPointOutcome second = RunSolver(p, 1e-14, &tight);
  EXPECT_TRUE(first.converged);
  EXPECT_LE(first.complementarity, 1e-4);
  EXPECT_LE(second.complementarity, 1e-14);
  EXPECT_LT(first.iterations, second.iterations);
  EXPECT_NEAR(tight.normal_impulse[0], 1.0, 1e-12);
}

TEST(ContactInteriorPointTest, NeverNaN) {
  // A floor that moves up and a ceiling that does not: no solution.
  ContactProblem<double> p = FreeBodies({0.0, 0.0, 0.0});
  p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.0, -1.0));
  ContactBlock<double> ceiling = FloorContact(0, 0.0, 0.0, 0.0);
  ceiling.normal_a = {0.0, -1.0, 0.0};
  p.contacts.push_back(ceiling);
  ContactSolution<double> solution;
  EXPECT_FALSE(RunSolver(p, 1e-14, &solution).converged);
  for (const double v : solution.motion) EXPECT_TRUE(std::isfinite(v));
}

template <int N>
void CheckJets() {
  if constexpr (N > 0) {
    // Sliding: v_x⁺ = v_x − μ v, so ∂/∂μ = −1 with a free speed of −1, and ∂/∂p_x = 1.
    ContactProblem<Jet<N>> p;
    p.num_bodies = 1;
    p.mass = {Jet<N>(1.0), Jet<N>(1.0), Jet<N>(0.1)};
    p.load = {Jet<N>(1.0, 0), Jet<N>(-1.0), Jet<N>(0.0)};
    ContactBlock<Jet<N>> c;
    c.a = 0;
    c.normal_a = {Jet<N>(0.0), Jet<N>(1.0), Jet<N>(0.0)};
    c.tangent_a = {Jet<N>(1.0), Jet<N>(0.0), Jet<N>(0.0)};
    c.normal_b = c.tangent_b = {Jet<N>(0.0), Jet<N>(0.0), Jet<N>(0.0)};
    c.c_n = c.c_t = Jet<N>(0.0);
    c.friction = Jet<N>(0.3, 1);
    c.has_friction = true;
    p.contacts.push_back(c);
    InteriorPointWorkspace<Jet<N>> workspace;
    ContactSolution<Jet<N>> solution;
    ContactInteriorPointOptions options;
    options.complementarity = 1e-20;
    EXPECT_TRUE(SolveContactsByInteriorPoint(p, options, &workspace, &solution).converged);
    EXPECT_NEAR(solution.motion[0].a, 0.7, 1e-12);
    EXPECT_NEAR(solution.motion[0].v[0], 1.0, 1e-9);
    EXPECT_NEAR(solution.motion[0].v[1], -1.0, 1e-9);
  } else {
    GTEST_SKIP() << "built without Jets";
  }
}

#define TANGIBLE_LIST_WIDTH(N) N,
constexpr int kWidths[] = {TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_LIST_WIDTH) 0};
#undef TANGIBLE_LIST_WIDTH

TEST(ContactInteriorPointTest, UnrolledJetsOfSliding) { CheckJets<kWidths[0]>(); }

}  // namespace
}  // namespace tangible
