// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/cost_bounds.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible::cost {
namespace {

CostCell Cell(CostMethod method, int parameters, long steps, double ratio) {
  CostCell cell;
  cell.method = method;
  cell.parameters = parameters;
  cell.steps = steps;
  cell.seconds = {2.0 * ratio, 1.0 * ratio};
  cell.rollout_seconds = {1.0, 5.0};
  return cell;
}

CostCell LongRun() {
  CostCell cell = Cell(CostMethod::kAdjointWithCheckpoints, 8, 10000, 2.5);
  cell.peak_bytes = 50u << 20;
  cell.runs_again = 1.0;
  return cell;
}

std::vector<CostCell> Good() {
  return {Cell(CostMethod::kAdjoint, 1, 1000, 1.5),     Cell(CostMethod::kAdjoint, 256, 1000, 1.9),
          Cell(CostMethod::kAdjoint, 256, 10, 9.0),  // shorter than what is bounded
          Cell(CostMethod::kTangent, 8, 1000, 2.9),     Cell(CostMethod::kTangent, 64, 1000, 9.0),
          Cell(CostMethod::kImplicitJets, 8, 1000, 3.9)};
}

TEST(CheckBoundsTest, HoldOfWhatIsGood) {
  const std::vector<CheckedBound> bounds = CheckBounds({}, Good(), LongRun());
  ASSERT_EQ(bounds.size(), 5U);
  EXPECT_EQ(bounds[0].measured, 1.9);
  EXPECT_EQ(bounds[1].measured, 2.9);
  EXPECT_EQ(bounds[3].measured, 50.0);
  for (const CheckedBound& bound : bounds) EXPECT_TRUE(bound.holds()) << bound.what;
  EXPECT_EQ(BrokenBound(bounds, Good()), "");
}

TEST(CheckBoundsTest, EachMayBreak) {
  std::vector<CostCell> cells = Good();
  cells[1].seconds = {2.1, 2.2};
  EXPECT_EQ(BrokenBound(CheckBounds({}, cells, LongRun()), cells),
            "adjoint, any number of parameters: rollouts 2.1, expected at most 2");
  cells = Good();
  cells[3].seconds = {3.1};
  EXPECT_NE(BrokenBound(CheckBounds({}, cells, LongRun()), cells).find("tangent"),
            std::string::npos);
  CostCell run = LongRun();
  run.peak_bytes = 65u << 20;
  EXPECT_NE(BrokenBound(CheckBounds({}, Good(), run), Good()).find("MiB of the process 65"),
            std::string::npos);
  run = LongRun();
  run.runs_again = 2.5;
  EXPECT_NE(BrokenBound(CheckBounds({}, Good(), run), Good()).find("extra rollouts 2.5"),
            std::string::npos);
  run = LongRun();
  run.instead = "over 5 s";
  EXPECT_NE(BrokenBound(CheckBounds({}, Good(), run), Good()).find("(over 5 s)"),
            std::string::npos);
}

TEST(CheckBoundsTest, ImplicitJetsAreBoundedWhereTheirWidthIsBuilt) {
  std::vector<CostCell> cells = Good();
  cells[5].seconds = {4.1};
  const std::vector<CheckedBound> bounds = CheckBounds({}, cells, LongRun());
  EXPECT_EQ(bounds[2].holds(), WidestJetBuilt() != 8);
  EXPECT_EQ(bounds[2].why_not.empty(), WidestJetBuilt() == 8);
}

TEST(CheckBoundsTest, WhatWasNotMeasuredIsNotChecked) {
  const std::vector<CheckedBound> bounds = CheckBounds({}, {}, LongRun());
  EXPECT_EQ(bounds[0].why_not, "no such cell was measured");
  EXPECT_EQ(BrokenBound(bounds, {}), "");
}

TEST(BrokenBoundTest, AFailedCellIsOne) {
  std::vector<CostCell> cells = Good();
  cells[4].failed = true;
  cells[4].instead = "differs from the adjoint by 0.1";
  EXPECT_EQ(BrokenBound(CheckBounds({}, Good(), LongRun()), cells),
            "tangent, 64 parameters, 1000 steps: differs from the adjoint by 0.1");
}

// Ratios p and 4: they cross at 4 parameters, which interpolation in logarithms finds exactly.
TEST(CrossoversTest, AreFoundBetweenWhatWasMeasured) {
  std::vector<CostCell> cells;
  for (const int count : {1, 2, 16}) {
    cells.push_back(Cell(CostMethod::kDifferences, count, 100, count));
    cells.push_back(Cell(CostMethod::kAdjoint, count, 100, 4.0));
    cells.push_back(Cell(CostMethod::kTangent, count, 100, 0.5 * count));
    cells.push_back(Cell(CostMethod::kUnrolledJets, count, 100, 3.0 * count));
  }
  bool found = false;
  for (const Crossover& crossover : Crossovers(cells)) {
    EXPECT_EQ(crossover.steps, 100);
    if (crossover.other == CostMethod::kTangent) {
      EXPECT_EQ(crossover.method, CostMethod::kAdjoint);
      EXPECT_NEAR(crossover.parameters, 8.0, 1e-12);
      found = true;
    } else if (crossover.method == CostMethod::kAdjoint) {
      EXPECT_NEAR(crossover.parameters, 4.0, 1e-12);
      EXPECT_FALSE(crossover.from_the_first);
    } else if (crossover.method == CostMethod::kTangent) {
      EXPECT_EQ(crossover.parameters, 1.0);
      EXPECT_TRUE(crossover.from_the_first);
    } else {
      EXPECT_TRUE(std::isnan(crossover.parameters)) << NameOf(crossover.method);
    }
  }
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace tangible::cost
