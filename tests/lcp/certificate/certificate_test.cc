// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/certificate/certificate.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible {
namespace {

std::string VerdictOf(Certificate certificate) {
  SetVerdict(certificate);
  return certificate.verdict;
}

TEST(CertificateTest, MergeKeepsTheWorseAndAddsCounts) {
  Certificate total{.margin_min = 0.5,
                    .margin_where = "step 1",
                    .degenerate_rows = 1,
                    .redundant_rows = 2,
                    .condition = 10.0,
                    .linear_residual = 1e-15,
                    .mode_switches = 3,
                    .events = 4,
                    .fallbacks = 5,
                    .one_sided = "first"};
  SetVerdict(total);
  Merge({.margin_min = 0.25,
         .margin_where = "step 2",
         .degenerate_rows = 10,
         .redundant_rows = 20,
         .condition = 5.0,
         .linear_residual = 1e-14,
         .mode_switches = 30,
         .events = 40,
         .fallbacks = 50,
         .one_sided = "second",
         .discontinuous = "a jump"},
        total);
  EXPECT_EQ(total.margin_min, 0.25);
  EXPECT_EQ(total.margin_where, "step 2");
  EXPECT_EQ(total.degenerate_rows, 11);
  EXPECT_EQ(total.redundant_rows, 22);
  EXPECT_EQ(total.condition, 10.0);
  EXPECT_EQ(total.linear_residual, 1e-14);
  EXPECT_EQ(total.mode_switches, 33);
  EXPECT_EQ(total.events, 44);
  EXPECT_EQ(total.fallbacks, 55);
  EXPECT_EQ(total.one_sided, "first");
  EXPECT_EQ(total.discontinuous, "a jump");
  EXPECT_EQ(total.verdict, "");
  Merge({.margin_min = 0.75, .margin_where = "step 3"}, total);
  EXPECT_EQ(total.margin_where, "step 2");
}

TEST(CertificateTest, EachReasonIsAVerdict) {
  EXPECT_EQ(VerdictOf({}), "trustworthy");
  EXPECT_EQ(VerdictOf({.margin_min = kNearKinkMargin}), "trustworthy");
  EXPECT_EQ(VerdictOf({.margin_min = 1e-7, .margin_where = "row 2"}),
            "near a kink: margin 1.0e-07 at row 2");
  EXPECT_EQ(VerdictOf({.margin_min = 0.0, .margin_where = "row 2", .degenerate_rows = 2}),
            "near a kink: kink of 2 rows at row 2");
  EXPECT_EQ(VerdictOf({.one_sided = "an impact at a boundary"}),
            "one-sided: an impact at a boundary");
  EXPECT_EQ(VerdictOf({.discontinuous = "a corner"}), "discontinuous: a corner");
}

TEST(CertificateTest, AJumpIsSaidBeforeAllElse) {
  const std::string verdict = VerdictOf({.margin_min = 0.0,
                                         .degenerate_rows = 2,
                                         .one_sided = "an impact",
                                         .discontinuous = "a corner"});
  EXPECT_EQ(verdict.rfind("discontinuous: a corner", 0), 0u) << verdict;
}

TEST(CertificateTest, AOneSidedDerivativeDoesNotHideAKink) {
  EXPECT_EQ(VerdictOf({.margin_min = 1e-7, .margin_where = "row 2", .one_sided = "an impact"}),
            "near a kink: margin 1.0e-07 at row 2; one-sided: an impact");
}

TEST(CertificateTest, ALinearSystemThatWasNotSolvedIsNotTrusted) {
  EXPECT_EQ(VerdictOf({.linear_residual = kLinearResidualLimit}), "trustworthy");
  EXPECT_EQ(VerdictOf({.linear_residual = 2e-3}),
            "near a kink: linear systems solved to 2.0e-03 only");
  EXPECT_NE(VerdictOf({.linear_residual = NAN}), "trustworthy");
  EXPECT_EQ(VerdictOf({.condition = kConditionLimit}), "trustworthy");
  EXPECT_EQ(VerdictOf({.condition = 4e20}), "near a kink: condition 4.0e+20 of a linear system");
  EXPECT_EQ(VerdictOf({.condition = HUGE_VAL}), "near a kink: a singular linear system");
  EXPECT_EQ(VerdictOf({.linear_residual = std::nan("")}),
            "near a kink: linear systems that were not solved");
}

// The prefix is no class of verdicts: what follows it is the verdict of the same reasons.
TEST(CertificateTest, TheDiscreteMapIsAPrefix) {
  for (const Certificate& own :
       {Certificate{}, Certificate{.discontinuous = "a corner"},
        Certificate{.margin_min = 1e-7, .margin_where = "row 2", .one_sided = "an impact"}}) {
    Certificate of_map = own;
    of_map.discrete_map = "step 3, t = 0.3 s: contact of a and b, made";
    EXPECT_EQ(VerdictOf(of_map), "of the discrete map: " + VerdictOf(own));
    EXPECT_EQ(WithoutDiscreteMap(VerdictOf(of_map)), VerdictOf(own));
    EXPECT_EQ(WithoutDiscreteMap(VerdictOf(own)), VerdictOf(own));
    SetVerdict(of_map);
    EXPECT_EQ(IsTrustworthyMap(of_map), VerdictOf(own) == "trustworthy");
    EXPECT_EQ(AdviceOf(own), "");
    EXPECT_NE(AdviceOf(of_map).find("step 3, t = 0.3 s"), std::string::npos);
    EXPECT_NE(AdviceOf(of_map).find(R"("stepping": "event")"), std::string::npos);
  }
}

TEST(CertificateTest, MergedStepsAreOfTheDiscreteMapIfOneIs) {
  Certificate total;
  Merge({.discrete_map = "step 3", .discrete_impact = "step 4"}, total);
  Merge({.discrete_map = "step 5"}, total);
  Merge({}, total);
  SetVerdict(total);
  EXPECT_EQ(total.discrete_map, "step 3");
  EXPECT_EQ(total.discrete_impact, "step 4");
  EXPECT_EQ(total.verdict, "of the discrete map: trustworthy");
}

}  // namespace
}  // namespace tangible
