// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/cost_run.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/verification/cost/tape_gradient.h"

namespace tangible::cost {
namespace {

CostOptions Quick() {
  CostOptions options;
  options.parameters = {1, 3};
  options.steps = {5};
  options.repeat_seconds = 0.005;
  return options;
}

bool IsBuilt(CostMethod method) {
  if (method == CostMethod::kTape) return TapeIsBuilt();
  const bool jets = method == CostMethod::kImplicitJets || method == CostMethod::kUnrolledJets;
  return !jets || WidestJetBuilt() > 0;
}

TEST(RunCostsTest, FillsEveryCell) {
  long last = 0;
  const std::vector<CostCell> cells = RunCosts(Quick(), [&](long done) { last = done; });
  EXPECT_EQ(static_cast<long>(cells.size()), NumCells(Quick()));
  EXPECT_EQ(last, NumCells(Quick()));
  for (const CostCell& cell : cells) {
    const std::string name = NameOf(cell.method);
    EXPECT_FALSE(cell.failed) << name << ": " << cell.instead;
    if (!IsBuilt(cell.method)) {
      EXPECT_EQ(cell.instead, "not built") << name;
      continue;
    }
    ASSERT_TRUE(cell.measured()) << name << ": " << cell.instead;
    EXPECT_FALSE(cell.seconds.empty());
    EXPECT_EQ(cell.seconds.size(), cell.rollout_seconds.size()) << name;
    EXPECT_GT(cell.ratio(), 0.0) << name;
    EXPECT_GT(cell.peak_bytes, 1000000U) << name;
    const bool adjoint =
        cell.method == CostMethod::kAdjoint || cell.method == CostMethod::kAdjointWithCheckpoints;
    EXPECT_EQ(cell.tape_bytes > 0, adjoint) << name;
  }
}

TEST(RunCostsTest, WhatIsOverItsBudgetSaysSo) {
  CostOptions options = Quick();
  options.parameters = {1, 3, 100};
  options.steps = {2000};
  options.budget.seconds = 0.001;
  for (const CostCell& cell : RunCosts(options, [](long) {})) {
    EXPECT_FALSE(cell.measured());
    EXPECT_FALSE(cell.failed);
    EXPECT_EQ(cell.instead, IsBuilt(cell.method) ? "over 0.001 s" : "not built");
  }
}

TEST(MeasureCellTest, AGradientThatDiffersIsNotTimed) {
  CostOptions options = Quick();
  std::vector<double> reference, gradient;
  ASSERT_TRUE(MeasureCell(options, CostMethod::kAdjoint, 3, 5, {}, &reference).measured());
  ASSERT_EQ(reference.size(), 3U);
  reference[1] += 1e-7 * std::abs(reference[0]);
  const CostCell cell = MeasureCell(options, CostMethod::kTangent, 3, 5, reference, &gradient);
  EXPECT_TRUE(cell.failed);
  EXPECT_TRUE(cell.seconds.empty());
  EXPECT_EQ(cell.instead.find("differs from the adjoint by "), 0U) << cell.instead;
}

TEST(MeasureCellTest, ABudgetTooSmallForTheTapeFails) {
  CostOptions options = Quick();
  options.tape_budget = 1000;
  std::vector<double> gradient;
  const CostCell cell =
      MeasureCell(options, CostMethod::kAdjointWithCheckpoints, 1, 5, {}, &gradient);
  EXPECT_TRUE(cell.failed);
  EXPECT_NE(cell.instead.find("budget of 1000 bytes"), std::string::npos) << cell.instead;
}

TEST(GradientDifferenceTest, IsRelativeToTheLargestInItsScale) {
  EXPECT_EQ(GradientDifference({1.0, 2.0}, {1.0, 2.0}, {1.0, 1.0}), 0.0);
  EXPECT_EQ(GradientDifference({0.0}, {0.0}, {1.0}), 0.0);
  EXPECT_DOUBLE_EQ(GradientDifference({1.0, 3.0}, {1.0, 2.0}, {10.0, 1.0}), 0.1);
  EXPECT_EQ(GradientDifference({NAN}, {1.0}, {1.0}), HUGE_VAL);
  EXPECT_EQ(GradientDifference({1.0}, {HUGE_VAL}, {1.0}), HUGE_VAL);
}

TEST(StatisticsTest, Least) {
  EXPECT_EQ(Least({3.0, 1.0, 2.0}), 1.0);
  EXPECT_TRUE(std::isnan(Least({})));
}

}  // namespace
}  // namespace tangible::cost
