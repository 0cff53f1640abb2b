// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/joint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "joint_cases.h"

namespace tangible {
namespace {

using testing::Geometry;
using testing::kPoses;
using testing::kTypes;

JointRows<LocalJet> Evaluate(JointType type) {
  Pose<LocalJet> a(Vector2<LocalJet>(LocalJet(kPoses[0], 0), LocalJet(kPoses[1], 1)),
                   LocalJet(kPoses[2], 2));
  Pose<LocalJet> b(Vector2<LocalJet>(LocalJet(kPoses[3], 3), LocalJet(kPoses[4], 4)),
                   LocalJet(kPoses[5], 5));
  std::vector<LocalJet> numbers;
  for (const double x : Geometry(type)) {
    numbers.emplace_back(x);
  }
  JointRows<LocalJet> rows;
  EvaluateJoint(type, a, b, numbers.data(), &rows);
  return rows;
}

// The rows times pose rates are the rates of C, so each row is ∂C/∂q, but for the prismatic joint's
// first row off its line and its coordinate's row, which hold on C = 0 with what is left of order
// C; these are compared as they are defined: axis and arm turn with b.
TEST(JointTest, RowsAreTheDerivativesOfTheErrors) {
  for (const JointType type : kTypes) {
    const JointRows<LocalJet> rows = Evaluate(type);
    for (int k = 0; k < rows.rows; ++k) {
      for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(rows.row_a[k][i].a, rows.error[k].v[i], 1e-15) << static_cast<int>(type);
        EXPECT_NEAR(rows.row_b[k][i].a, rows.error[k].v[3 + i], 1e-15) << static_cast<int>(type);
      }
      EXPECT_GT(rows.error[k].v.norm(), 0.5);
    }
  }
}

TEST(JointTest, CoordinateRowsAreTheDerivativesOfTheCoordinate) {
  for (const JointType type : {JointType::kRevolute, JointType::kPrismatic, JointType::kRope}) {
    const JointRows<LocalJet> rows = Evaluate(type);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(rows.coordinate_a[i].a, rows.coordinate.v[i], 1e-15);
      EXPECT_NEAR(rows.coordinate_b[i].a, rows.coordinate.v[3 + i], 1e-15);
    }
  }
}

TEST(JointTest, NumbersOfRows) {
  const int expected[] = {2, 2, 3, 1, 1};
  for (int k = 0; k < 5; ++k) {
    EXPECT_EQ(Evaluate(kTypes[k]).rows, expected[k]);
  }
}

TEST(JointTest, ValuesByHand) {
  const Pose<double> a(Vector2<double>(1.0, 2.0), 0.0);
  const Pose<double> b(Vector2<double>(0.0, 0.0), std::acos(0.0));
  JointRows<double> rows;
  const double revolute[] = {0.5, 0.0, 1.0, 0.0, 0.1};
  EvaluateJoint(JointType::kRevolute, a, b, revolute, &rows);
  EXPECT_NEAR(rows.error[0], 1.5, 1e-15);  // b's anchor is at (0, 1)
  EXPECT_NEAR(rows.error[1], 1.0, 1e-15);
  EXPECT_NEAR(rows.coordinate, -std::acos(0.0) - 0.1, 1e-15);
  EvaluateJoint(JointType::kDistance, a, b, revolute, &rows);
  EXPECT_NEAR(rows.error[0], std::hypot(1.5, 1.0) - 0.1, 1e-15);
  // b's axis (1, 0) points along world y.
  const double prismatic[] = {0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0};
  EvaluateJoint(JointType::kPrismatic, a, b, prismatic, &rows);
  EXPECT_NEAR(rows.coordinate, 2.0, 1e-15);
  EXPECT_NEAR(rows.error[0], -1.0, 1e-15);
}

TEST(JointTest, DistanceOfCoincidentAnchorsIsFinite) {
  Pose<LocalJet> pose(Vector2<LocalJet>(LocalJet(0.0, 0), LocalJet(0.0, 1)), LocalJet(0.0, 2));
  const LocalJet numbers[5] = {LocalJet(0.0), LocalJet(0.0), LocalJet(0.0), LocalJet(0.0),
                               LocalJet(0.0)};
  JointRows<LocalJet> rows;
  EvaluateJoint(JointType::kDistance, pose, pose, numbers, &rows);
  EXPECT_EQ(rows.row_a[0][0].a, 1.0);
  EXPECT_TRUE(rows.error[0].v.allFinite());
  EXPECT_TRUE(rows.row_a[0][2].v.allFinite());
}

}  // namespace
}  // namespace tangible
