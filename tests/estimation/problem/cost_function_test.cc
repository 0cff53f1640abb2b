// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/cost_function.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace tangible {
namespace {

/// r = (x0², x0 x1), which counts its calls and fails where x0 < 0.
struct Counted {
  int plain = 0;
  int with_jacobian = 0;

  ResidualFunction Function() {
    return [this](const Eigen::VectorXd& x, Eigen::VectorXd* residuals, RowMatrixXd* jacobian) {
      ++(jacobian == nullptr ? plain : with_jacobian);
      if (x[0] < 0.0) return false;
      *residuals = Eigen::Vector2d(x[0] * x[0], x[0] * x[1]);
      if (jacobian != nullptr) {
        jacobian->resize(2, 2);
        *jacobian << 2.0 * x[0], 0.0, x[1], x[0];
      }
      return true;
    };
  }
};

TEST(CostFunctionTest, APointIsRunOnce) {
  Counted counted;
  Eigen::VectorXd x = Eigen::Vector2d(3.0, 5.0);
  SharedEvaluation shared(counted.Function(), &x);
  EXPECT_FALSE(shared.ok());
  shared.PrepareForEvaluation(false, true);
  shared.PrepareForEvaluation(false, true);
  EXPECT_EQ(counted.plain, 1);
  // Derivatives were not there yet.
  shared.PrepareForEvaluation(true, false);
  shared.PrepareForEvaluation(true, true);
  shared.PrepareForEvaluation(false, true);
  EXPECT_EQ(counted.plain, 1);
  EXPECT_EQ(counted.with_jacobian, 1);
  x[1] = 6.0;
  shared.PrepareForEvaluation(false, true);
  EXPECT_EQ(counted.plain, 2);
  EXPECT_EQ(shared.values()[1], 18.0);
  // The Jacobian that is left is that of another point.
  shared.PrepareForEvaluation(true, false);
  EXPECT_EQ(counted.with_jacobian, 2);
  EXPECT_EQ(shared.jacobian()(1, 0), 6.0);
}

TEST(CostFunctionTest, EachCoordinateIsItsRow) {
  Counted counted;
  Eigen::VectorXd x = Eigen::Vector2d(3.0, 5.0);
  SharedEvaluation shared(counted.Function(), &x);
  shared.PrepareForEvaluation(true, true);
  const CoordinateCostFunction cost(&shared, 1, 2);
  EXPECT_EQ(cost.num_residuals(), 1);
  EXPECT_EQ(cost.parameter_block_sizes(), std::vector<int32_t>{2});
  const double* parameters[] = {x.data()};
  double residual = 0.0;
  double row[2] = {0.0, 0.0};
  double* jacobians[] = {row};
  ASSERT_TRUE(cost.Evaluate(parameters, &residual, jacobians));
  EXPECT_EQ(residual, 15.0);
  EXPECT_EQ(row[0], 5.0);
  EXPECT_EQ(row[1], 3.0);
  EXPECT_TRUE(cost.Evaluate(parameters, &residual, nullptr));
}

TEST(CostFunctionTest, AFailedRunIsSaidAndNotRepeated) {
  Counted counted;
  Eigen::VectorXd x = Eigen::Vector2d(-1.0, 0.0);
  SharedEvaluation shared(counted.Function(), &x);
  const CoordinateCostFunction cost(&shared, 0, 2);
  const double* parameters[] = {x.data()};
  double residual = 0.0;
  shared.PrepareForEvaluation(true, true);
  shared.PrepareForEvaluation(true, true);
  EXPECT_EQ(counted.with_jacobian, 1);
  EXPECT_FALSE(cost.Evaluate(parameters, &residual, nullptr));
  x[0] = 2.0;
  shared.PrepareForEvaluation(false, true);
  ASSERT_TRUE(cost.Evaluate(parameters, &residual, nullptr));
  EXPECT_EQ(residual, 4.0);
}

}  // namespace
}  // namespace tangible
