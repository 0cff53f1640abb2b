// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/joint_curvature.h"

#include <gtest/gtest.h>

#include <cmath>

#include "joint_cases.h"

namespace tangible {
namespace {

using testing::Geometry;
using testing::kPoses;
using testing::kTypes;

// The poses of kPoses as numbers, or each its own variable.
template <typename T>
Pose<T> PoseAt(int first) {
  T q[3];
  for (int i = 0; i < 3; ++i) {
    q[i] = T(kPoses[first + i]);
    if constexpr (NumDerivatives<T>::value > 0) {
      q[i].v[first + i] = 1.0;
    }
  }
  return Pose<T>(Vector2<T>(q[0], q[1]), q[2]);
}

// The rows are ∂C/∂q, and their derivatives the curvature.
TEST(JointCurvatureTest, IsTheDerivativeOfTheRows) {
  const double multipliers[3] = {0.7, -1.3, 0.4};
  for (const JointType type : kTypes) {
    const std::vector<double> numbers = Geometry(type);
    const std::vector<LocalJet> jets(numbers.begin(), numbers.end());
    JointRows<LocalJet> rows;
    EvaluateJoint(type, PoseAt<LocalJet>(0), PoseAt<LocalJet>(3), jets.data(), &rows);
    JointCurvature<double> curvature;
    EvaluateJointCurvature(type, PoseAt<double>(0), PoseAt<double>(3), numbers.data(), multipliers,
                           &curvature);
    double largest = 0.0;
    double coupling = 0.0;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        double aa = 0.0;
        double ab = 0.0;
        double ba = 0.0;
        double bb = 0.0;
        for (int r = 0; r < rows.rows; ++r) {
          aa += multipliers[r] * rows.row_a[r][i].v[k];
          ab += multipliers[r] * rows.row_a[r][i].v[3 + k];
          ba += multipliers[r] * rows.row_b[r][i].v[k];
          bb += multipliers[r] * rows.row_b[r][i].v[3 + k];
        }
        EXPECT_NEAR(curvature.aa[3 * i + k], aa, 1e-15) << static_cast<int>(type);
        EXPECT_NEAR(curvature.ab[3 * i + k], ab, 1e-15) << static_cast<int>(type);
        EXPECT_NEAR(curvature.ab[3 * k + i], ba, 1e-15) << static_cast<int>(type);
        EXPECT_NEAR(curvature.bb[3 * i + k], bb, 1e-15) << static_cast<int>(type);
        largest = std::max({largest, std::abs(aa), std::abs(bb)});
        coupling = std::max(coupling, std::abs(ab));
      }
    }
    const bool is_linear = type == JointType::kFixedAngle;
    EXPECT_EQ(largest > 0.05, !is_linear) << static_cast<int>(type);
    EXPECT_EQ(coupling > 0.05, type == JointType::kPrismatic || type == JointType::kDistance)
        << static_cast<int>(type);
  }
}

TEST(JointCurvatureTest, CoincidentAnchorsOfADistanceJointAreFinite) {
  const double numbers[5] = {0.0, 0.0, 0.0, 0.0, 0.0};
  const double multiplier = 1.0;
  JointCurvature<double> curvature;
  EvaluateJointCurvature(JointType::kDistance, PoseAt<double>(0), PoseAt<double>(0), numbers,
                         &multiplier, &curvature);
  for (int i = 0; i < 9; ++i) {
    EXPECT_EQ(curvature.aa[i], 0.0);
    EXPECT_EQ(curvature.ab[i], 0.0);
    EXPECT_EQ(curvature.bb[i], 0.0);
  }
}

}  // namespace
}  // namespace tangible
