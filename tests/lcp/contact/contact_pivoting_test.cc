// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_pivoting.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "../../support/contact_problems.h"
#include "tangible/lcp/system/contact_residual.h"

namespace tangible {
namespace {

using testing::EmptySolution;
using testing::FloorContact;
using testing::FreeBodies;
using From = ContactPivoting::From;

constexpr double kDelta = 1e-8;

bool Follow(const ContactProblem<double>& p, From from, ContactSolution<double>* solution,
            int* factorisations) {
  ContactPivoting pivoting;
  ContactSystem system;
  *factorisations = 0;
  return pivoting.Solve(p, from, kDelta, 200, &system, solution, factorisations);
}

// What δ leaves of the rows, δ r M⁻¹ rᵀ |λ|, in the residual's scale; twice, for rounding.
double Bound(const ContactProblem<double>& p, const ContactSolution<double>& solution) {
  double bound = 0.0;
  const ContactScales scales(p, solution);
  for (size_t i = 0; i < p.contacts.size(); ++i) {
    const ContactValues values = Evaluate(p, scales, p.contacts[i], solution.motion.data());
    bound = std::max({bound, values.mobility_n * solution.normal_impulse[i] / values.scale_n,
                      values.mobility_t * std::abs(solution.tangent_impulse[i]) /
                          std::max(values.scale_t, values.scale_n)});
  }
  return 2.0 * kDelta * bound + 1e-14;
}

TEST(ContactPivotingTest, SolvesRandomProblemsFromAnyModes) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const ContactProblem<double> p = testing::RandomContactProblem(&random, 4, 6);
    ContactSolution<double> open = EmptySolution(p);
    int factorisations = 0;
    ASSERT_TRUE(Follow(p, From::kOpen, &open, &factorisations)) << trial;
    int worst = 0;
    EXPECT_LE(NaturalResidual(p, open, &worst), Bound(p, open)) << trial;
    ContactSolution<double> other = EmptySolution(p);
    for (size_t i = 0; i < other.modes.size(); ++i) {
      if (p.contacts[i].has_friction) {
        other.modes[i] = static_cast<ContactMode>(random() % 4);
      }
    }
    if (Follow(p, From::kModes, &other, &factorisations)) {
      EXPECT_LE(NaturalResidual(p, other, &worst), Bound(p, other)) << trial;
    }
  }
}

TEST(ContactPivotingTest, RightModesTakeOneFactorisationAndWrongOnesAPivotEach) {
  // Five bodies on a floor, each by one contact; all stick.
  ContactProblem<double> p;
  p = FreeBodies(std::vector<double>(15, 0.0));
  for (int i = 0; i < 5; ++i) {
    p.load[3 * i + 1] = -1.0 - 0.1 * i;
    p.contacts.push_back(FloorContact(i, 0.0, 0.0, 0.5));
  }
  ContactSolution<double> solution = EmptySolution(p);
  solution.modes.assign(5, ContactMode::kSticking);
  int factorisations = 0;
  ASSERT_TRUE(Follow(p, From::kModes, &solution, &factorisations));
  EXPECT_EQ(factorisations, 1);
  // An open contact that closes slides at first and then sticks.
  solution = EmptySolution(p);
  solution.modes.assign(5, ContactMode::kSticking);
  solution.modes[2] = ContactMode::kOpen;
  ASSERT_TRUE(Follow(p, From::kModes, &solution, &factorisations));
  EXPECT_GT(factorisations, 1);
  EXPECT_LE(factorisations, 4);
  EXPECT_NEAR(solution.normal_impulse[2], 1.2, 100 * kDelta);
}

TEST(ContactPivotingTest, RedundantSupportsCarryAnEccentricLoad) {
  // Three supports in a line under a load at 0.9 of the last: the impulses of least norm pull.
  for (const double friction : {0.0, 0.5}) {
    ContactProblem<double> p = FreeBodies({0.0, -1.0, -9.0});
    for (const double arm : {-1.0, 0.0, 1.0}) {
      p.contacts.push_back(FloorContact(0, arm, -0.5, friction));
    }
    for (const From from : {From::kOpen, From::kModes}) {
      ContactSolution<double> solution = EmptySolution(p);
      solution.modes.assign(3, friction > 0.0 ? ContactMode::kSticking : ContactMode::kClosed);
      int factorisations = 0;
      ASSERT_TRUE(Follow(p, from, &solution, &factorisations));
      const std::vector<double>& n = solution.normal_impulse;
      for (const double impulse : n) {
        EXPECT_GE(impulse, -1e-9);
      }
      EXPECT_NEAR(n[0] + n[1] + n[2], 1.0, 1e-6);
      EXPECT_NEAR(n[2] - n[0], 0.9, 1e-6);
    }
  }
}

TEST(ContactPivotingTest, NoSolutionIsARay) {
  // A body between a floor and a ceiling that come nearer.
  ContactProblem<double> p = FreeBodies({0.0, 0.0, 0.0});
  p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.0, -1.0));
  p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.0, -1.0));
  p.contacts[1].normal_a = {0.0, -1.0, 0.0};
  ContactSolution<double> solution = EmptySolution(p);
  int factorisations = 0;
  int worst = 0;
  // The proximal problem has a solution, with impulses of 1 / δ; it is none of the problem.
  if (Follow(p, From::kOpen, &solution, &factorisations)) {
    EXPECT_GT(NaturalResidual(p, solution, &worst), 0.1);
  }
}

TEST(ContactPivotingTest, ScatterMakesAnotherPathAndIsTakenBack) {
  std::mt19937_64 random(7);
  const ContactProblem<double> p = testing::RandomContactProblem(&random, 8, 12);
  ContactPivoting pivoting;
  ContactSystem system;
  int factorisations = 0;
  const auto follow = [&](std::uint64_t seed) {
    pivoting.SetScatter(seed);
    ContactSolution<double> solution = EmptySolution(p);
    factorisations = 0;
    EXPECT_TRUE(pivoting.Solve(p, From::kOpen, kDelta, 500, &system, &solution, &factorisations));
    int worst = 0;
    EXPECT_LE(NaturalResidual(p, solution, &worst), 1e-6);
    return solution;
  };
  const ContactSolution<double> usual = follow(0);
  const int usual_length = factorisations;
  int others = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    follow(seed);
    others += factorisations == usual_length ? 0 : 1;
  }
  EXPECT_GT(others, 0);
  EXPECT_EQ(follow(0).motion, usual.motion);
  EXPECT_EQ(factorisations, usual_length);
}

}  // namespace
}  // namespace tangible
