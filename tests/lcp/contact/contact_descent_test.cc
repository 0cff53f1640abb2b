// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_descent.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "../../support/contact_problems.h"
#include "tangible/lcp/contact/contact_solver.h"
#include "tangible/lcp/system/contact_residual.h"
#include "tangible/lcp/system/mode_solve.h"

namespace tangible {
namespace {

using testing::Draw;
using testing::EmptySolution;
using testing::FreeBodies;

// Rows of discs of radius 0.5 above each other, each between two of the row below, that fall at
// different speeds: nearly every contact closes, and most of them slide or roll.
ContactProblem<double> FallingDiscs(std::mt19937_64* random, int columns, int rows,
                                    double friction) {
  std::vector<double> twists;
  for (int i = 0; i < columns * rows; ++i) {
    twists.insert(twists.end(),
                  {Draw(random, -0.1, 0.1), Draw(random, -1.0, 0.0), Draw(random, -0.2, 0.2)});
  }
  ContactProblem<double> p = FreeBodies(twists);
  const auto touch = [&](int a, int b, double nx, double ny) {
    ContactBlock<double> c;
    c.a = a;
    c.b = b;
    c.normal_a = {nx, ny, 0.0};
    c.normal_b = {-nx, -ny, 0.0};
    c.tangent_a = {ny, -nx, 0.5};
    c.tangent_b = {-ny, nx, 0.5};
    c.c_n = Draw(random, 0.0, 0.05);
    c.c_t = 0.0;
    c.friction = friction;
    c.has_friction = friction > 0.0;
    p.contacts.push_back(c);
  };
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < columns; ++i) {
      const int disc = columns * row + i;
      if (row == 0) {
        touch(disc, -1, 0.0, 1.0);
        continue;
      }
      const int below = columns * (row - 1);
      const int other = i + (row % 2 == 0 ? -1 : 1);
      const double side = row % 2 == 0 ? 1.0 : -1.0;
      touch(disc, below + i, side * -0.5, std::sqrt(0.75));
      if (other >= 0 && other < columns) {
        touch(disc, below + other, side * 0.5, std::sqrt(0.75));
      } else {
        touch(disc, -1, side, 0.0);
      }
    }
  }
  return p;
}

// Whether a descent from all contacts open ends in modes whose exact solution solves the problem.
bool Solves(const ContactProblem<double>& p) {
  ContactDescent descent;
  ContactSystem system;
  ModeSolve exact;
  ContactSolution<double> solution = EmptySolution(p);
  int factorisations = 0;
  const bool settled = descent.Solve(p, &system, &solution, &factorisations);
  for (size_t i = 0; i < p.contacts.size(); ++i) {
    EXPECT_GE(solution.normal_impulse[i], 0.0);
    EXPECT_LE(std::abs(solution.tangent_impulse[i]),
              p.contacts[i].friction * solution.normal_impulse[i] * (1.0 + 1e-14));
  }
  EXPECT_GT(factorisations, 0);
  if (!settled || !exact.Solve(p, &solution, &system, &solution)) {
    return false;
  }
  int worst = 0;
  return NaturalResidual(p, solution, &worst) <= kLcpTolerance;
}

TEST(ContactDescentTest, FindsTheModesOfFallingDiscs) {
  std::mt19937_64 random(5);
  for (const double friction : {0.0, 0.3, 0.8}) {
    int solved = 0;
    for (int trial = 0; trial < 20; ++trial) {
      solved += Solves(FallingDiscs(&random, 5, 6, friction)) ? 1 : 0;
    }
    EXPECT_GE(solved, friction == 0.0 ? 20 : 6) << friction;
  }
}

TEST(ContactDescentTest, JointsAndDampersAreRowsToo) {
  std::mt19937_64 random(9);
  int solved = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const ContactProblem<double> p = testing::RandomContactProblem(&random, 8, 14);
    EXPECT_FALSE(p.joints.empty());
    EXPECT_FALSE(p.dampers.empty());
    solved += Solves(p) ? 1 : 0;
  }
  EXPECT_GE(solved, 36);
}

// From a step to the next speeds change everywhere a little, and with them many modes.
TEST(ContactDescentTest, SolvesTheNextStepOfAPile) {
  std::mt19937_64 random(6);
  int by_descent = 0;
  int factorisations = 0;
  for (int trial = 0; trial < 20; ++trial) {
    ContactProblem<double> p = FallingDiscs(&random, 5, 5, 0.3);
    ContactSolution<double> solution = EmptySolution(p);
    ContactSolver solver;
    ASSERT_TRUE(solver.Solve(p, {}, &solution).solved) << trial;
    for (double& momentum : p.load) {
      momentum += Draw(&random, -0.05, 0.05);
    }
    const ContactSolverReport report = solver.Solve(p, {}, &solution);
    EXPECT_TRUE(report.solved) << trial;
    int worst = 0;
    EXPECT_LE(NaturalResidual(p, solution, &worst), kLcpTolerance) << trial;
    by_descent += report.rung == Rung::kDescent ? 1 : 0;
    factorisations += report.factorisations;
  }
  EXPECT_GE(by_descent, 10);
  EXPECT_LT(factorisations, 20 * 40);
}

}  // namespace
}  // namespace tangible
