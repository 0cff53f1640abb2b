// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/contact_case.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tangible/verification/corpus/recomputed.h"

namespace tangible::corpus {
namespace {

TEST(ContactCaseTest, TheSameSeedMakesTheSameProblemAndAnotherDoesNot) {
  for (const std::string& kind : ContactKinds()) {
    const ContactCase one = MakeContactCase(kind, 5, 3, 40);
    EXPECT_EQ(one.problem.load, MakeContactCase(kind, 5, 3, 40).problem.load);
    EXPECT_NE(one.problem.load, MakeContactCase(kind, 6, 3, 40).problem.load);
    EXPECT_EQ(one.name, kind + " 3");
  }
}

TEST(ContactCaseTest, SizesFrictionAndMassesAreWhatTheKindSays) {
  size_t largest = 0;
  double heaviest = 0.0, roughest = 0.0;
  for (int i = 0; i < 200; ++i) {
    for (const std::string& kind : ContactKinds()) {
      const ContactProblem<double> p = MakeContactCase(kind, 1, i, 100).problem;
      EXPECT_GE(p.contacts.size(), 1U);
      largest = std::max(largest, p.contacts.size());
      for (const double m : p.mass) heaviest = std::max(heaviest, m);
      for (const ContactBlock<double>& c : p.contacts) {
        roughest = std::max(roughest, c.friction);
        EXPECT_EQ(c.has_friction, c.friction > 0.0);
        EXPECT_LE(c.friction, kind == "high friction" ? 1e6 : 2.0);
        // What theory asks for where nothing is drawn.
        if (kind == "stack" || kind == "scattered" || kind == "redundant" || kind == "joints" ||
            kind == "mass ratio" || kind == "high friction") {
          EXPECT_GE(c.c_n, 0.0);
          EXPECT_EQ(c.c_t, 0.0);
        }
      }
    }
  }
  EXPECT_GT(largest, 90U);
  EXPECT_LE(largest, 100U);
  EXPECT_GT(heaviest, 1e8);
  EXPECT_GT(roughest, 1e5);
}

TEST(ContactCaseTest, DrawnSolutionsSolve) {
  int drawn = 0;
  for (int i = 0; i < 50; ++i) {
    for (const char* kind : {"restitution", "frictionless"}) {
      const ContactCase one = MakeContactCase(kind, 2, i, 60);
      EXPECT_LE(RecomputedResidual(one.problem, one.drawn), 1e-14) << one.name;
      ++drawn;
    }
  }
  EXPECT_EQ(drawn, 100);
}

TEST(ContactCaseTest, WallsThatComeCloserAreAProof) {
  for (int i = 0; i < 50; ++i) {
    const ContactCase one = MakeContactCase("infeasible", 2, i, 30);
    EXPECT_EQ(one.known, Known::kInfeasible);
    const MixedLcp<double> form = OneSidedForm(one.problem);
    // One on the normal rows of the squeezed, which all come first.
    VectorX<double> farkas = VectorX<double>::Zero(form.num_v() + form.num_z());
    Eigen::Index at = form.num_v();
    for (int k = 0; k <= one.problem.num_bodies; ++k) {
      farkas[at] = 1.0;
      at += one.problem.contacts[k].has_friction ? 4 : 1;
    }
    EXPECT_TRUE(ProvesInfeasible(form, farkas)) << one.name;
  }
}

TEST(ContactCaseTest, TheOneSidedFormHasTheSameSolution) {
  for (int i = 0; i < 20; ++i) {
    const ContactCase one = MakeContactCase("restitution", 3, i, 20);
    const MixedLcp<double> form = OneSidedForm(one.problem);
    LcpSolution<double> solution;
    solution.v = Eigen::Map<const VectorX<double>>(one.drawn.motion.data(), form.num_v());
    solution.y = VectorX<double>::Zero(0);
    solution.z = VectorX<double>::Zero(form.num_z());
    Eigen::Index at = 0;
    for (size_t k = 0; k < one.problem.contacts.size(); ++k) {
      const ContactBlock<double>& c = one.problem.contacts[k];
      solution.z[at] = one.drawn.normal_impulse[k];
      if (c.has_friction) {
        const double t = one.drawn.tangent_impulse[k];
        solution.z[at + 1] = std::max(0.0, t);
        solution.z[at + 2] = std::max(0.0, -t);
        solution.z[at + 3] =
            std::abs(RowDot(c.a, c.tangent_a, c.b, c.tangent_b, one.drawn.motion.data()) + c.c_t);
      }
      at += c.has_friction ? 4 : 1;
    }
    EXPECT_LE(RecomputedResidual(form, solution.v, solution.y, solution.z), 1e-13) << one.name;
    EXPECT_EQ(FromOneSided(one.problem, solution).normal_impulse, one.drawn.normal_impulse);
    EXPECT_EQ(FromOneSided(one.problem, solution).tangent_impulse, one.drawn.tangent_impulse);
  }
}

}  // namespace
}  // namespace tangible::corpus
