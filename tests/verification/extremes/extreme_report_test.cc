// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/extreme_report.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible::extremes {
namespace {

std::vector<CaseResult> Results() {
  CaseResult good;
  good.group = "first";
  good.name = "good";
  good.stepping = "fixed";
  good.seconds = 0.25;
  good.finding.figures = {{"far from its bound", 1e-9, 1.0, "m", "reason a"},
                          {"near its bound", 0.9, 1.0, "s", "reason b"}};
  good.finding.gradient.taken = good.finding.gradient.finite = true;
  good.finding.gradient.adjoint = 3e-12;
  good.finding.gradient.verdict = "trustworthy";
  CaseResult broken = good;
  broken.name = "broken <b>";
  broken.finding.figures[0].value = 2.0;
  CaseResult known = broken;
  known.name = "known one";
  known.known_reason = "physics of it";
  CaseResult crashed;
  crashed.group = "second";
  crashed.name = "crashed";
  crashed.stepping = "event";
  crashed.message = "ended by signal 11";
  return {good, broken, known, crashed};
}

TEST(ExtremeReportTest, Counts) {
  const Counts counts = Count(Results());
  EXPECT_EQ(counts.holds, 1);
  EXPECT_EQ(counts.known, 1);
  EXPECT_EQ(counts.failed, 2);
  EXPECT_EQ(counts.gradients, 3);
  EXPECT_EQ(SummaryText(counts),
            "4 cases: 1 hold, 1 known not to, 2 fail; 3 gradients, 3 trustworthy");
}

TEST(ExtremeReportTest, TheTableShowsTheFigureNearestItsBound) {
  const std::string text = TableText(Results());
  const size_t row = text.find("  good ");
  ASSERT_NE(row, std::string::npos) << text;
  const std::string line = text.substr(row, text.find('\n', row) - row);
  EXPECT_NE(line.find(" 0.9 "), std::string::npos) << line;
  EXPECT_NE(line.find("holds"), std::string::npos);
  EXPECT_NE(line.find("3e-12"), std::string::npos);
  EXPECT_NE(text.find("far from its bound 2 m, expected at most 1 (reason a)"), std::string::npos);
  EXPECT_NE(text.find("known: physics of it"), std::string::npos);
  EXPECT_NE(text.find("ended by signal 11"), std::string::npos);
  EXPECT_EQ(text.find("nan"), std::string::npos);
}

TEST(ExtremeReportTest, TheFirstFailureIsNoneThatIsKnown) {
  std::vector<CaseResult> results = Results();
  EXPECT_EQ(FirstFailure(results),
            "first, broken <b>, fixed: far from its bound 2 m, expected at most 1 (reason a)");
  results.erase(results.begin() + 1);
  EXPECT_EQ(FirstFailure(results), "second, crashed, event: ended by signal 11");
  results.pop_back();
  EXPECT_EQ(FirstFailure(results), "");
}

TEST(ExtremeReportTest, TheJsonHasEveryFigureAndTheKnownOnes) {
  std::vector<CaseResult> results = Results();
  results[0].finding.figures[0].value = std::nan("");
  const OrderedJson json = ToJson(results);
  EXPECT_EQ(json["summary"]["cases"], 4);
  ASSERT_EQ(json["cases"].size(), 4u);
  EXPECT_EQ(json["cases"][1]["figures"].size(), 2u);
  EXPECT_EQ(json["cases"][1]["figures"][0]["holds"], false);
  EXPECT_TRUE(json["cases"][0]["figures"][0]["value"].is_null());
  EXPECT_EQ(json["cases"][1]["gradient"]["certificate"], "trustworthy");
  EXPECT_TRUE(json["cases"][3]["gradient"].is_null());
  ASSERT_EQ(json["known"].size(), 1u);
  EXPECT_EQ(json["known"][0]["reason"], "physics of it");
}

TEST(ExtremeReportTest, ThePageEscapesAndListsWhatDoesNotHold) {
  const std::string page = Page(Results(), "origin & date");
  EXPECT_NE(page.find("broken &lt;b&gt;"), std::string::npos);
  EXPECT_EQ(page.find("broken <b>"), std::string::npos);
  EXPECT_NE(page.find("What does not hold"), std::string::npos);
  EXPECT_NE(page.find("origin &amp; date"), std::string::npos);
  const std::string all_good = Page({Results()[0]}, "");
  EXPECT_EQ(all_good.find("What does not hold"), std::string::npos);
}

}  // namespace
}  // namespace tangible::extremes
