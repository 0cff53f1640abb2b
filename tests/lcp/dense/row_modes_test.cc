// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/row_modes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/small_problems.h"

namespace tangible {
namespace {

using testing::ListOf;
using testing::OneBodyOnContacts;
using testing::PointOf;

/// Speeds (along, up) of a mass of 1; rows λn, λ+, λ−, γ with friction 0.5.
MixedLcp<double> FrictionProblem(double p_along, double p_up) {
  MixedLcp<double> problem;
  problem.M = MatrixX<double>::Identity(2, 2);
  problem.p = ListOf({p_along, p_up});
  problem.G = MatrixX<double>::Zero(4, 2);
  problem.G(0, 1) = 1.0;
  problem.G(1, 0) = 1.0;
  problem.G(2, 0) = -1.0;
  problem.F = MatrixX<double>::Zero(4, 4);
  problem.F(1, 3) = problem.F(2, 3) = 1.0;
  problem.F.row(3) << 0.5, -1.0, -1.0, 0.0;
  problem.c = VectorX<double>::Zero(4);
  ConformEmptyBlocks(problem);
  return problem;
}

TEST(RowModesTest, AForceIsActiveASlackInactive) {
  const RowModes pressed = ClassifyRows(OneBodyOnContacts(1, -1.0), PointOf({0.0}, {1.0}));
  EXPECT_EQ(pressed.modes[0], RowMode::kActive);
  const RowModes apart = ClassifyRows(OneBodyOnContacts(1, 1.0), PointOf({1.0}, {0.0}));
  EXPECT_EQ(apart.modes[0], RowMode::kInactive);
  for (const RowModes& rows : {pressed, apart}) {
    EXPECT_EQ(rows.num_kinks, 0);
    EXPECT_EQ(rows.kink_weight[0], 0.0);
    EXPECT_EQ(rows.margin_row, 0);
    EXPECT_GT(rows.margin_min, 0.1);
  }
}

TEST(RowModesTest, AContactThatJustTouchesIsAKink) {
  MixedLcp<double> problem = OneBodyOnContacts(1, 0.0);
  problem.M(0, 0) = 4.0;
  const RowModes rows = ClassifyRows(problem, PointOf({0.0}, {0.0}));
  EXPECT_EQ(rows.modes[0], RowMode::kKink);
  EXPECT_EQ(rows.num_kinks, 1);
  EXPECT_EQ(rows.margin_min, 0.0);
  EXPECT_EQ(rows.margin_row, 0);
  EXPECT_DOUBLE_EQ(rows.kink_weight[0], 0.25);  // G M⁻¹ Gᵀ
}

TEST(RowModesTest, FrictionRowsOfABodyAtRestAreActive) {
  const RowModes rows =
      ClassifyRows(FrictionProblem(0.0, -1.0), PointOf({0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}));
  EXPECT_EQ(rows.modes, (std::vector<RowMode>{RowMode::kActive, RowMode::kActive, RowMode::kActive,
                                              RowMode::kInactive}));
  EXPECT_EQ(rows.num_kinks, 0);
  EXPECT_GT(rows.margin_min, 0.1);
}

TEST(RowModesTest, FrictionRowsOfAnOpenContactAreInactive) {
  // γ may be any number >= 1 here: it is lowered to where it starts to matter.
  const RowModes rows =
      ClassifyRows(FrictionProblem(1.0, 1.0), PointOf({1.0, 1.0}, {0.0, 0.0, 0.0, 7.0}));
  EXPECT_NEAR(rows.point.z[3], 1.0, 1e-15);
  for (const int row : {0, 1, 2}) EXPECT_EQ(rows.modes[row], RowMode::kInactive) << row;
  EXPECT_EQ(rows.num_kinks, 0);
}

TEST(RowModesTest, TheMarginIsTheSmallestOfTheRows) {
  MixedLcp<double> problem;
  problem.M = MatrixX<double>::Identity(2, 2);
  problem.p = ListOf({-1.0, -1e-8});
  problem.G = MatrixX<double>::Identity(2, 2);
  problem.F = MatrixX<double>::Zero(2, 2);
  problem.c = VectorX<double>::Zero(2);
  ConformEmptyBlocks(problem);
  const RowModes rows = ClassifyRows(problem, PointOf({0.0, 0.0}, {1.0, 1e-8}));
  EXPECT_EQ(rows.margin_row, 1);
  // z over the largest z.
  EXPECT_NEAR(rows.margin_min, 1e-8, 1e-15);
  EXPECT_EQ(rows.num_kinks, 0);
}

TEST(RowModesTest, WithoutRowsThereIsNoMargin) {
  const RowModes rows = ClassifyRows(OneBodyOnContacts(0, 1.0), PointOf({1.0}, {}));
  EXPECT_EQ(rows.margin_row, -1);
  EXPECT_TRUE(std::isinf(rows.margin_min));
}

}  // namespace
}  // namespace tangible
