// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/extreme_case.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace tangible::extremes {
namespace {

TEST(FigureTest, HoldsWithinItsBoundOnBothSides) {
  EXPECT_TRUE((Figure{"x", 1.0, 1.0, "m", ""}.holds()));
  EXPECT_TRUE((Figure{"x", -1.0, 1.0, "m", ""}.holds()));
  EXPECT_FALSE((Figure{"x", 1.1, 1.0, "m", ""}.holds()));
  EXPECT_FALSE((Figure{"x", -1.1, 1.0, "m", ""}.holds()));
  EXPECT_TRUE((Figure{"x", 0.0, 0.0, "m", ""}.holds()));
  EXPECT_FALSE((Figure{"x", 1e-300, 0.0, "m", ""}.holds()));
}

TEST(FigureTest, AReportedFigureMustBeFinite) {
  EXPECT_TRUE((Figure{"x", 1e300, kReported, "m", ""}.holds()));
  EXPECT_FALSE((Figure{"x", std::nan(""), kReported, "m", ""}.holds()));
  EXPECT_FALSE((Figure{"x", HUGE_VAL, kReported, "m", ""}.holds()));
  EXPECT_FALSE((Figure{"x", -HUGE_VAL, kReported, "m", ""}.holds()));
  EXPECT_FALSE((Figure{}.holds()));  // never measured
}

GradientFinding Good() {
  GradientFinding gradient;
  gradient.taken = gradient.finite = true;
  gradient.adjoint = 1e-12;
  gradient.differences = 1e-7;
  gradient.verdict = "trustworthy";
  return gradient;
}

TEST(GradientFindingTest, HoldsWhereMethodsAgree) {
  EXPECT_TRUE(GradientFinding().holds());  // not taken
  EXPECT_TRUE(Good().holds());
  GradientFinding gradient = Good();
  gradient.finite = false;
  EXPECT_FALSE(gradient.holds());
  gradient = Good();
  gradient.message = "unsolved";
  EXPECT_FALSE(gradient.holds());
  gradient = Good();
  gradient.adjoint = 2e-9;
  EXPECT_FALSE(gradient.holds());
  gradient.adjoint = kNotMeasured;
  EXPECT_FALSE(gradient.holds());
  gradient = Good();
  gradient.differences = 2e-5;
  EXPECT_FALSE(gradient.holds());
  gradient.differences = kNotMeasured;
  EXPECT_TRUE(gradient.holds());
}

TEST(GradientFindingTest, ANamedKinkMayDisagreeButNotBeNoNumber) {
  GradientFinding gradient = Good();
  gradient.verdict = "near a kink: 1 degenerate row";
  gradient.adjoint = gradient.differences = 1.0;
  EXPECT_TRUE(gradient.holds());
  gradient.finite = false;
  EXPECT_FALSE(gradient.holds());
}

TEST(GradientFindingTest, ItsBoundFollowsTheConditionWithinLimits) {
  GradientFinding gradient = Good();
  EXPECT_EQ(gradient.adjoint_bound(), kAdjointTolerance);
  gradient.condition = 1e9;
  EXPECT_NEAR(gradient.adjoint_bound(), 2.22e-7, 1e-9);
  gradient.condition = 1e20;
  EXPECT_EQ(gradient.adjoint_bound(), 1e-6);
}

TEST(SerialiseTest, KeepsEveryBit) {
  Finding finding;
  finding.figures = {{"a \"quoted\" name", 0.1 + 0.2, kReported, "m", "because"},
                     {"not a number", std::nan(""), 1e-300, "1", ""}};
  finding.gradient = Good();
  finding.gradient.condition = 1.0 / 3.0;
  finding.note = "line\nline";
  Finding read;
  ASSERT_TRUE(Deserialise(Serialise(finding), &read));
  ASSERT_EQ(read.figures.size(), 2u);
  EXPECT_EQ(read.figures[0].what, finding.figures[0].what);
  EXPECT_EQ(read.figures[0].value, 0.1 + 0.2);
  EXPECT_EQ(read.figures[0].bound, kReported);
  EXPECT_EQ(read.figures[0].reason, "because");
  EXPECT_TRUE(std::isnan(read.figures[1].value));
  EXPECT_EQ(read.figures[1].bound, 1e-300);
  EXPECT_EQ(read.gradient.adjoint, 1e-12);
  EXPECT_EQ(read.gradient.condition, 1.0 / 3.0);
  EXPECT_EQ(read.gradient.verdict, "trustworthy");
  EXPECT_TRUE(read.gradient.taken && read.gradient.finite);
  EXPECT_EQ(read.note, finding.note);
}

TEST(SerialiseTest, WhatIsNotAFindingIsRefused) {
  Finding finding;
  EXPECT_FALSE(Deserialise("", &finding));
  EXPECT_FALSE(Deserialise("[]", &finding));
  EXPECT_FALSE(Deserialise("{\"figures\": [[1]]}", &finding));
  const std::string good = Serialise(Finding());
  EXPECT_FALSE(Deserialise(good.substr(0, good.size() / 2), &finding));
}

TEST(AllCasesTest, NamesAreUniqueAndGroupsTogether) {
  std::set<std::string> names, groups;
  std::string group;
  for (const ExtremeCase& one : AllCases()) {
    EXPECT_TRUE(names.insert(one.name + ", " + one.stepping).second) << one.name;
    EXPECT_TRUE(one.stepping == "fixed" || one.stepping == "event") << one.name;
    if (one.group != group) {
      EXPECT_TRUE(groups.insert(one.group).second) << one.group << " stands in two places";
    }
    group = one.group;
  }
  EXPECT_GT(names.size(), 200u);
  EXPECT_EQ(groups.size(), 11u);
}

}  // namespace
}  // namespace tangible::extremes
