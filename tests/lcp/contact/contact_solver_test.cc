// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "../../support/contact_problems.h"
#include "../../support/sanitizers.h"
#include "../../support/step_cases.h"

namespace tangible {
namespace {

using testing::EmptySolution;
using testing::FloorContact;
using testing::FreeBodies;

constexpr SolverChoice kChoices[] = {SolverChoice::kAuto, SolverChoice::kInteriorPoint,
                                     SolverChoice::kLemke};

ContactSolverReport Solve(const ContactProblem<double>& problem, SolverChoice choice,
                          ContactSolution<double>* solution) {
  *solution = EmptySolution(problem);
  ContactSolver solver;
  ContactSolverOptions options;
  options.choice = choice;
  return solver.Solve(problem, options, solution);
}

// A box that is thrown onto the floor, with its corners' contacts each so many times over.
ContactProblem<double> Box(double vx, double friction, int copies) {
  ContactProblem<double> p = FreeBodies({vx, -1.0, 0.0});
  for (int k = 0; k < copies; ++k) {
    p.contacts.push_back(FloorContact(0, -0.5, -0.1, friction));
    p.contacts.push_back(FloorContact(0, 0.5, -0.1, friction));
  }
  return p;
}

// Of friction whose limit is given, as in a joint, beside contacts: every solver, the same motion.
TEST(ContactSolverTest, FrictionWithAGivenLimit) {
  std::mt19937_64 random(1);
  int sticking = 0, sliding = 0;
  for (int trial = 0; trial < 50; ++trial) {
    ContactProblem<double> problem = testing::RandomContactProblem(&random, 4, 5);
    for (const size_t i : {1, 3}) {
      ContactBlock<double>& c = problem.contacts[i];
      c.normal_a = c.normal_b = {0.0, 0.0, 0.0};
      c.c_n = 0.0;
      c.friction = testing::Draw(&random, 0.1, 3.0);
      c.has_friction = c.limit_given = c.driven = true;
      c.offset = 0.1;
    }
    std::vector<double> motion;
    for (const SolverChoice choice : kChoices) {
      ContactSolution<double> solution;
      const ContactSolverReport report = Solve(problem, choice, &solution);
      ASSERT_TRUE(report.solved) << trial;
      if (motion.empty()) motion = solution.motion;
      for (size_t k = 0; k < motion.size(); ++k) {
        EXPECT_NEAR(solution.motion[k], motion[k], 1e-8) << trial;
      }
      for (const size_t i : {1, 3}) {
        const ContactBlock<double>& c = problem.contacts[i];
        const double limit = 0.1 * c.friction;
        const double slip =
            RowDot(c.a, c.tangent_a, c.b, c.tangent_b, solution.motion.data()) + c.c_t;
        const double impulse = solution.tangent_impulse[i];
        EXPECT_NEAR(solution.normal_impulse[i], 0.1, 1e-14);
        if (std::abs(slip) < 1e-9) {
          EXPECT_LE(std::abs(impulse), limit * (1.0 + 1e-9));
          ++sticking;
        } else {
          EXPECT_NEAR(impulse, slip > 0.0 ? -limit : limit, 1e-9);
          ++sliding;
        }
      }
    }
  }
  EXPECT_GT(sticking, 15);
  EXPECT_GT(sliding, 15);
}

TEST(ContactSolverTest, RedundantContactsOfABox) {
  for (const SolverChoice choice : kChoices) {
    for (const int copies : {1, 2, 4}) {
      ContactSolution<double> solution;
      const ContactSolverReport report = Solve(Box(0.9, 0.3, copies), choice, &solution);
      ASSERT_TRUE(report.solved);
      EXPECT_LE(report.residual, 1e-10);
      EXPECT_NEAR(solution.motion[0], 0.6, 1e-12);
      EXPECT_NEAR(solution.motion[1], 0.0, 1e-12);
      EXPECT_NEAR(solution.motion[2], 0.0, 1e-12);
      double sum = 0.0;
      for (const double impulse : solution.normal_impulse) {
        EXPECT_GE(impulse, -1e-12);
        sum += impulse;
      }
      EXPECT_NEAR(sum, 1.0, 1e-12);
    }
  }
}

TEST(ContactSolverTest, FrictionOfAMillionSticks) {
  ContactSolution<double> solution;
  ASSERT_TRUE(Solve(Box(0.9, 1e6, 1), SolverChoice::kAuto, &solution).solved);
  EXPECT_NEAR(solution.motion[0], 0.0, 1e-12);
}

TEST(ContactSolverTest, AllChoicesFindTheSameTwistOfRandomProblems) {
  std::mt19937_64 random(11);
  int compared = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const ContactProblem<double> p = testing::RandomContactProblem(&random, 4, 5);
    ContactSolution<double> solutions[3];
    bool solved[3];
    for (int k = 0; k < 3; ++k) {
      const ContactSolverReport report = Solve(p, kChoices[k], &solutions[k]);
      solved[k] = report.solved;
      int worst = 0;
      if (report.solved) {
        // Success is by the residual, recomputed.
        EXPECT_LE(NaturalResidual(p, solutions[k], &worst), 1e-10);
        EXPECT_NE(report.rung, Rung::kNone);
      }
    }
    EXPECT_TRUE(solved[0]) << trial;  // little friction: there is one solution
    for (int k = 1; k < 3; ++k) {
      if (!solved[0] || !solved[k] || solutions[0].modes != solutions[k].modes) continue;
      for (size_t i = 0; i < solutions[0].motion.size(); ++i) {
        EXPECT_NEAR(solutions[0].motion[i], solutions[k].motion[i], 1e-9);
      }
      ++compared;
    }
  }
  EXPECT_GT(compared, 60);
}

// Redundant rows and much friction lead through the whole portfolio.
TEST(ContactSolverTest, WhatASolveLeansOnIsCounted) {
  std::mt19937_64 random(7);
  ContactFallbacks sum;
  for (int trial = 0; trial < (testing::kSanitized ? 10 : 30); ++trial) {
    ContactProblem<double> p = testing::RandomContactProblem(&random, 6, 16);
    for (ContactBlock<double>& contact : p.contacts) contact.friction *= 15.0;
    ContactSolution<double> solution;
    const ContactSolverReport report = Solve(p, SolverChoice::kAuto, &solution);
    const ContactFallbacks& f = report.fallbacks;
    // One method after the other, and the one that ended it is the last.
    EXPECT_GE(f.pivoting, f.interior_point) << trial;
    EXPECT_GE(f.interior_point, f.lemke) << trial;
    EXPECT_GE(f.lemke, f.dense) << trial;
    if (report.solved) {
      EXPECT_EQ(report.rung > Rung::kPivotingFromGuess, f.interior_point > 0) << trial;
      EXPECT_EQ(report.rung > Rung::kPivotingFromInteriorPoint, f.lemke > 0) << trial;
      EXPECT_EQ(report.rung == Rung::kModeChanges || report.rung == Rung::kDescent, f.pivoting == 0)
          << NameOf(report.rung);
    } else {
      EXPECT_EQ(report.rung, Rung::kNone) << NameOf(report.rung);
    }
    sum.Add(f);
    if (trial >= 3) continue;
    // What is asked for is no fall-back.
    EXPECT_EQ(Solve(p, SolverChoice::kInteriorPoint, &solution).fallbacks.interior_point, 0);
    EXPECT_EQ(Solve(p, SolverChoice::kLemke, &solution).fallbacks.lemke, 0);
  }
  EXPECT_LT(sum.pivoting, 90);  // at most three paths a problem
  EXPECT_LT(sum.interior_point, sum.pivoting);
  EXPECT_GT(sum.dense, 0);
  EXPECT_GT(sum.extrapolation, 0);
  EXPECT_GT(sum.regularised, 0);
  ContactSolution<double> solution;
  const ContactFallbacks none = Solve(Box(0.9, 0.3, 1), SolverChoice::kAuto, &solution).fallbacks;
  EXPECT_EQ(none.pivoting + none.interior_point + none.lemke + none.dense + none.extrapolation +
                none.regularised + none.whole_system,
            0);
}

TEST(ContactSolverTest, AWrongGuessIsPutRightInOneChange) {
  for (const double vx : {1.0, -1.0}) {
    ContactProblem<double> p = FreeBodies({vx, -1.0, 0.0});
    p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.3));
    for (const ContactMode guess : {ContactMode::kSticking, ContactMode::kOpen}) {
      ContactSolution<double> solution = EmptySolution(p);
      solution.modes[0] = guess;
      ContactSolver solver;
      const ContactSolverReport report = solver.Solve(p, {}, &solution);
      EXPECT_LE(report.rung, Rung::kPivotingFromGuess);
      EXPECT_EQ(report.factorisations, 2);
      EXPECT_NEAR(solution.motion[0], 0.7 * vx, 1e-15);
    }
  }
}

TEST(ContactSolverTest, TwoPointsOfATurningBodyDoNotBothStick) {
  // Two corners at heights that differ by 1e-6, of a body that must turn: one sticks, one slides.
  ContactProblem<double> p = FreeBodies({0.0, -1.0, 0.0});
  p.contacts.push_back(FloorContact(0, -0.5, -0.1, 2.0, 0.0));
  p.contacts.push_back(FloorContact(0, 0.5, -0.1 + 1e-6, 2.0, 1e-3));
  ContactSolution<double> solution;
  const ContactSolverReport report = Solve(p, SolverChoice::kAuto, &solution);
  ASSERT_TRUE(report.solved);
  EXPECT_NEAR(solution.motion[2], -1e-3, 1e-12);
  EXPECT_NE(solution.modes[0] == ContactMode::kSticking,
            solution.modes[1] == ContactMode::kSticking);
}

TEST(ContactSolverTest, ContradictoryJointsAreUnsolved) {
  for (const bool contact : {false, true}) {
    ContactProblem<double> p = FreeBodies({0.0, -1.0, 0.0});
    p.redundant_joints = true;
    for (int k = 0; k < 2; ++k) {
      JointBlock<double> joint;
      joint.a = 0;
      joint.rows = 1;
      joint.row_a[0] = {1.0, 0.0, 0.0};
      joint.row_b[0] = {0.0, 0.0, 0.0};
      joint.rhs[0] = k;
      p.joints.push_back(joint);
    }
    if (contact) p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.5));
    ContactSolution<double> solution;
    const ContactSolverReport report = Solve(p, SolverChoice::kAuto, &solution);
    EXPECT_FALSE(report.solved);
    EXPECT_GT(report.residual, 1e-3);
  }
}

TEST(ContactSolverTest, NaturalResidualSeesEachKindOfError) {
  const ContactProblem<double> p = Box(0.9, 0.3, 1);
  ContactSolution<double> solution;
  ASSERT_TRUE(Solve(p, SolverChoice::kAuto, &solution).solved);
  int worst = 0;
  const auto residual = [&](auto change) {
    ContactSolution<double> changed = solution;
    change(&changed);
    return NaturalResidual(p, changed, &worst);
  };
  EXPECT_LT(residual([](auto*) {}), 1e-14);
  EXPECT_GT(residual([](auto* s) { s->motion[1] -= 1e-3; }), 1e-4);
  EXPECT_GT(residual([](auto* s) { s->normal_impulse[0] -= 0.6; }), 1e-2);
  EXPECT_GT(residual([](auto* s) { s->tangent_impulse[1] *= -1.0; }), 1e-2);
}

TEST(ContactSolverTest, DegenerateContactsAreFound) {
  // A body that just touches: no speed, no impulse.
  ContactProblem<double> p = FreeBodies({1.0, 0.0, 0.0});
  p.contacts.push_back(FloorContact(0, 0.0, 0.0, 0.5));
  ContactSolution<double> solution;
  ASSERT_TRUE(Solve(p, SolverChoice::kAuto, &solution).solved);
  std::vector<int> degenerate;
  FindDegenerateContacts(p, solution, 1e-9, &degenerate);
  EXPECT_EQ(degenerate, std::vector<int>{0});
  p.load[1] = -1.0;
  ASSERT_TRUE(Solve(p, SolverChoice::kAuto, &solution).solved);
  FindDegenerateContacts(p, solution, 1e-9, &degenerate);
  EXPECT_TRUE(degenerate.empty());
}

// A step case of ../shared as a contact problem: rows of body b minus those of body a.
ContactProblem<double> ProblemOf(const StepCase& step) {
  const MixedLcp<double>& lcp = step.problem();
  ContactProblem<double> p;
  p.num_bodies = static_cast<int>(lcp.p.size() / 3);
  for (Eigen::Index i = 0; i < lcp.p.size(); ++i) {
    p.mass.push_back(lcp.M(i, i));
    p.load.push_back(lcp.p[i]);
  }
  const nlohmann::json& contacts = step.data()["contacts"];
  const Eigen::Index count = static_cast<Eigen::Index>(contacts.size());
  const bool friction = lcp.G.rows() > count;
  for (Eigen::Index k = 0; k < count; ++k) {
    ContactBlock<double> c;
    c.a = contacts[k]["a"].get<int>();
    c.b = contacts[k]["b"].get<int>();
    const auto part = [&](Eigen::Index row, int body) -> RowPart<double> {
      if (body < 0 || row < 0) return {0.0, 0.0, 0.0};
      return {lcp.G(row, 3 * body), lcp.G(row, 3 * body + 1), lcp.G(row, 3 * body + 2)};
    };
    const Eigen::Index tangent = friction ? count + 2 * k : -1;
    c.normal_a = part(k, c.a);
    c.normal_b = part(k, c.b);
    c.tangent_a = part(tangent, c.a);
    c.tangent_b = part(tangent, c.b);
    c.c_n = lcp.c[k];
    c.c_t = 0.0;
    c.friction = friction ? lcp.F(3 * count + k, k) : 0.0;
    c.has_friction = c.friction > 0.0;
    p.contacts.push_back(c);
  }
  return p;
}

TEST(ContactSolverTest, ExactStepCases) {
  int solved = 0;
  for (const StepCase& step : StepCases()) {
    ContactSolution<double> solution;
    const ContactProblem<double> p = ProblemOf(step);
    ASSERT_TRUE(Solve(p, SolverChoice::kAuto, &solution).solved) << step.id();
    for (size_t i = 0; i < solution.motion.size(); ++i) {
      EXPECT_NEAR(solution.motion[i], step.data()["v_plus"][i].get<double>(), 1e-12) << step.id();
    }
    ++solved;
  }
  EXPECT_GT(solved, 10);
}

}  // namespace
}  // namespace tangible
