// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/extremes/extreme_run.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>

namespace tangible::extremes {
namespace {

Finding Measured(double value) {
  Finding finding;
  finding.figures.push_back({"figure", value, 1.0, "m", "because"});
  return finding;
}

ExtremeCase Case(const std::string& name, std::function<Finding(Length)> run) {
  return {"group", name, "fixed", std::move(run), 2.0};
}

TEST(RunCaseTest, HandsTheFindingOver) {
  const CaseResult result =
      RunCase(Case("good", [](Length) { return Measured(0.5); }), Length::kShort);
  EXPECT_EQ(result.verdict(), Verdict::kHolds) << result.message;
  ASSERT_EQ(result.finding.figures.size(), 1u);
  EXPECT_EQ(result.finding.figures[0].value, 0.5);
  EXPECT_EQ(result.group, "group");
  EXPECT_GT(result.seconds, 0.0);
}

TEST(RunCaseTest, ABrokenBoundFailsUnlessItIsKnown) {
  ExtremeCase broken = Case("broken", [](Length) { return Measured(2.0); });
  EXPECT_EQ(RunCase(broken, Length::kShort).verdict(), Verdict::kFailed);
  broken.known_reason = "a reason";
  EXPECT_EQ(RunCase(broken, Length::kShort).verdict(), Verdict::kKnown);
  ExtremeCase good = Case("good", [](Length) { return Measured(0.0); });
  good.known_reason = "was fixed since";
  EXPECT_EQ(RunCase(good, Length::kShort).verdict(), Verdict::kHolds);
}

TEST(RunCaseTest, ACrashIsARowThatFailed) {
  const CaseResult crashed =
      RunCase(Case("crash", [](Length) -> Finding { std::abort(); }), Length::kShort);
  EXPECT_EQ(crashed.verdict(), Verdict::kFailed);
  EXPECT_NE(crashed.message.find("signal"), std::string::npos) << crashed.message;
  const CaseResult thrown =
      RunCase(Case("throw", [](Length) -> Finding { throw std::runtime_error("what went wrong"); }),
              Length::kShort);
  EXPECT_EQ(thrown.message, "what went wrong");
  const CaseResult left =
      RunCase(Case("exit", [](Length) -> Finding { _exit(0); }), Length::kShort);
  EXPECT_EQ(left.message, "ended without a result");
}

TEST(RunCaseTest, AnEndlessLoopIsARowThatFailed) {
  ExtremeCase endless = Case("endless", [](Length) {
    volatile bool on = true;
    while (on) {
    }
    return Finding();
  });
  endless.seconds = 0.1;
  const CaseResult result = RunCase(endless, Length::kShort);
  EXPECT_EQ(result.verdict(), Verdict::kFailed);
  EXPECT_NE(result.message.find("does not end within"), std::string::npos) << result.message;
}

TEST(RunCasesTest, KeepTheOrderWithAnyNumberOfThreads) {
  std::vector<ExtremeCase> cases;
  for (int i = 0; i < 12; ++i) {
    cases.push_back(Case("case" + std::to_string(i), [i](Length) { return Measured(i); }));
  }
  for (const int threads : {1, 4}) {
    long last = 0;
    const std::vector<CaseResult> results =
        RunCases(cases, {Length::kShort, threads}, [&](long done) {
          EXPECT_EQ(done, last + 1);
          last = done;
        });
    EXPECT_EQ(last, 12);
    ASSERT_EQ(results.size(), 12u);
    for (int i = 0; i < 12; ++i) {
      ASSERT_EQ(results[i].finding.figures.size(), 1u) << results[i].message;
      EXPECT_EQ(results[i].finding.figures[0].value, i);
    }
  }
}

TEST(RunCasesTest, CasesKnowTheLength) {
  const ExtremeCase one =
      Case("length", [](Length length) { return Measured(length == Length::kLong ? 1.0 : 0.0); });
  EXPECT_EQ(RunCase(one, Length::kShort).finding.figures[0].value, 0.0);
  EXPECT_EQ(RunCase(one, Length::kLong).finding.figures[0].value, 1.0);
}

}  // namespace
}  // namespace tangible::extremes
