// SPDX-License-Identifier: Apache-2.0
//
// A point of mass m on a floor, at each kind of kink: the rates in closed form.
#include "tangible/lcp/contact/contact_directional.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/contact_problems.h"

namespace tangible {
namespace {

using Kind = ContactKink::Kind;

constexpr double kMass = 2.0;

// Momentum (px, py) of a point over a floor with normal (0, 1), tangent (1, 0).
ContactProblem<double> Point(double px, double py, double friction, int floors = 1) {
  ContactProblem<double> problem;
  problem.num_bodies = 1;
  problem.mass = {kMass, kMass, 1.0};
  problem.load = {px, py, 0.0};
  for (int i = 0; i < floors; ++i) {
    problem.contacts.push_back(testing::FloorContact(0, 0.0, 0.0, friction));
  }
  return problem;
}

// Its solution with the impulses shared evenly.
ContactSolution<double> SolutionOf(const ContactProblem<double>& problem, double vx, double normal,
                                   double tangent, ContactMode mode) {
  const size_t count = problem.contacts.size();
  ContactSolution<double> solution;
  solution.motion = {vx, 0.0, 0.0};
  solution.normal_impulse.assign(count, normal / static_cast<double>(count));
  solution.tangent_impulse.assign(count, tangent / static_cast<double>(count));
  solution.modes.assign(count, mode);
  return solution;
}

struct Rates {
  double px = 0.0, py = 0.0;  // of the momentum
  double c_n = 0.0;           // of the normal rows
  double friction = 0.0;
};

struct Kinked {
  std::vector<ContactKink> kinks;
  ContactDirectional directional;
  ContactProblem<double> problem;
  ContactSolution<double> solution;

  Kinked(const ContactProblem<double>& p, const ContactSolution<double>& s)
      : problem(p), solution(s) {
    FindKinks(problem, solution, std::vector<bool>(problem.contacts.size(), false), 1e-10, &kinks);
    EXPECT_TRUE(directional.Factor(problem, solution, kinks));
  }

  std::vector<double> Solve(const Rates& rates) {
    std::vector<double> r(3 * static_cast<size_t>(directional.num_blocks()), 0.0);
    r[0] = rates.px;
    r[1] = rates.py;
    for (const int block : directional.blocks()) {
      if (block >= 0) {
        r[3 * block] = -rates.c_n;
      }
    }
    std::vector<double> v_dot;
    EXPECT_EQ(directional.Solve(r, std::vector<double>(kinks.size(), rates.friction), &v_dot),
              ContactDirectional::Status::kSolved);
    v_dot.resize(3, NAN);
    return v_dot;
  }
};

TEST(ContactDirectionalTest, FrictionAtItsLimit) {
  // λn = 4, μ = 0.5, p = (2, −4): friction −2 just holds the point.
  for (const int floors : {1, 2, 3}) {
    const ContactProblem<double> problem = Point(2.0, -4.0, 0.5, floors);
    Kinked kinked(problem, SolutionOf(problem, 0.0, 4.0, -2.0, ContactMode::kSticking));
    for (const ContactKink& kink : kinked.kinks) {
      EXPECT_EQ(kink.kind, Kind::kFrictionLimit);
      EXPECT_EQ(kink.sign, 1.0);
    }
    // It slides with what exceeds the limit: m v̇ = max(0, ṗx − μ λ̇n − μ̇ λn), λ̇n = −ṗy.
    for (const double px : {-1.0, 0.0, 1.0}) {
      for (const double py : {-1.0, 0.5}) {
        for (const double friction : {-0.3, 0.1}) {
          const std::vector<double> v = kinked.Solve({px, py, 0.0, friction});
          const double excess = px + 0.5 * py - 4.0 * friction;
          EXPECT_NEAR(v[0], std::max(0.0, excess) / kMass, 1e-12) << px << " " << py;
          EXPECT_NEAR(v[1], 0.0, 1e-12);
        }
      }
    }
  }
}

TEST(ContactDirectionalTest, LimitToTheOtherSide) {
  const ContactProblem<double> problem = Point(-2.0, -4.0, 0.5);
  Kinked kinked(problem, SolutionOf(problem, 0.0, 4.0, 2.0, ContactMode::kSlidingNegative));
  EXPECT_EQ(kinked.kinks[0].sign, -1.0);
  EXPECT_NEAR(kinked.Solve({1.0, 0.0})[0], 0.0, 1e-12);
  EXPECT_NEAR(kinked.Solve({-1.0, 0.0})[0], -1.0 / kMass, 1e-12);
}

TEST(ContactDirectionalTest, TouchingWhileSliding) {
  for (const int floors : {1, 2}) {
    const ContactProblem<double> problem = Point(6.0, 0.0, 0.5, floors);
    Kinked kinked(problem, SolutionOf(problem, 3.0, 0.0, 0.0, ContactMode::kOpen));
    EXPECT_EQ(kinked.kinks[0].kind, Kind::kTouches);
    // Away: free. Into the floor: λ̇n = −(ṗy + m ċ), and friction −μ λ̇n.
    EXPECT_NEAR(kinked.Solve({0.0, 1.0})[1], 1.0 / kMass, 1e-12);
    const std::vector<double> v = kinked.Solve({0.0, -1.0});
    EXPECT_NEAR(v[0], -0.5 / kMass, 1e-12);
    EXPECT_NEAR(v[1], 0.0, 1e-12);
    EXPECT_NEAR(kinked.Solve({0.0, 0.0, -0.25})[1], 0.25, 1e-12);
    EXPECT_NEAR(kinked.Solve({0.0, 0.0, 0.25})[1], 0.0, 1e-12);
  }
}

TEST(ContactDirectionalTest, TouchingAtRestFollowsCoulombInTheRates) {
  ContactProblem<double> problem = Point(0.0, 0.0, 0.5);
  // Another body gives the impulses and speeds a scale.
  problem.num_bodies = 2;
  problem.mass.insert(problem.mass.end(), {1.0, 1.0, 1.0});
  problem.load.insert(problem.load.end(), {0.0, -1.0, 0.0});
  problem.contacts.push_back(problem.contacts[0]);
  problem.contacts[1].a = 1;
  ContactSolution<double> solution = SolutionOf(problem, 0.0, 0.0, 0.0, ContactMode::kSticking);
  solution.motion.assign(6, 0.0);
  solution.normal_impulse[1] = 1.0;
  Kinked kinked(problem, solution);
  EXPECT_EQ(kinked.kinks[0].kind, Kind::kTouchesAtRest);
  EXPECT_EQ(kinked.kinks[1].kind, Kind::kNone);
  for (const double px : {-1.0, -0.4, 0.0, 0.4, 1.0}) {
    for (const double py : {-1.0, 1.0}) {
      const std::vector<double> v = kinked.Solve({px, py});
      const double held = py < 0.0 ? std::min(0.5, std::abs(px)) : 0.0;
      EXPECT_NEAR(v[0], (px - std::copysign(held, px)) / kMass, 1e-12) << px << " " << py;
      EXPECT_NEAR(v[1], std::max(0.0, py) / kMass, 1e-12) << px << " " << py;
    }
  }
}

TEST(ContactDirectionalTest, FrictionFromZero) {
  const ContactProblem<double> problem = Point(0.0, -4.0, 0.0);
  Kinked kinked(problem, SolutionOf(problem, 0.0, 4.0, 0.0, ContactMode::kClosed));
  EXPECT_EQ(kinked.kinks[0].kind, Kind::kFrictionFromZero);
  for (const double px : {-3.0, -1.0, 0.0, 1.0, 3.0}) {
    // |λ̇t| ≤ μ̇ λn = 2.
    const double held = std::min(2.0, std::abs(px));
    EXPECT_NEAR(kinked.Solve({px, 0.0, 0.0, 0.5})[0], (px - std::copysign(held, px)) / kMass,
                1e-12);
  }
}

TEST(ContactDirectionalTest, FindsNoKinkInsideAMode) {
  const ContactProblem<double> sticks = Point(1.9999, -4.0, 0.5);
  Kinked sticking(sticks, SolutionOf(sticks, 0.0, 4.0, -1.9999, ContactMode::kSticking));
  EXPECT_EQ(sticking.kinks[0].kind, Kind::kNone);
  const ContactProblem<double> slides = Point(3.0, -4.0, 0.5);
  Kinked sliding(slides, SolutionOf(slides, 0.5, 4.0, -2.0, ContactMode::kSlidingPositive));
  EXPECT_EQ(sliding.kinks[0].kind, Kind::kNone);
  EXPECT_NEAR(sliding.Solve({1.0, -1.0})[0], (1.0 - 0.5) / kMass, 1e-12);
}

TEST(ContactDirectionalTest, ReportsAContradiction) {
  // Of two floors under one point only one rises.
  const ContactProblem<double> problem = Point(0.0, -4.0, 0.0, 2);
  const ContactSolution<double> solution = SolutionOf(problem, 1.0, 4.0, 0.0, ContactMode::kClosed);
  ContactDirectional directional;
  ASSERT_TRUE(directional.Factor(problem, solution, std::vector<ContactKink>(2)));
  std::vector<double> r(3 * static_cast<size_t>(directional.num_blocks()), 0.0);
  r[3 * directional.blocks()[0]] = 1.0;
  std::vector<double> v_dot;
  EXPECT_EQ(directional.Solve(r, {0.0, 0.0}, &v_dot), ContactDirectional::Status::kContradiction);
}

}  // namespace
}  // namespace tangible
