// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/scaling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tangible {
namespace {

bool IsPowerOfTwo(double x) {
  int exponent = 0;
  return std::frexp(x, &exponent) == 0.5;
}

TEST(ScalingTest, LargestEntriesOfRowsAndColumnsAreNearOne) {
  std::mt19937 random(29);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  MatrixX<double> K = MatrixX<double>::NullaryExpr(6, 4, [&](int, int) { return uniform(random); });
  // Rows and columns of very different sizes, as masses and friction coefficients make them.
  for (int i = 0; i < 6; ++i) K.row(i) *= std::pow(10.0, 2 * i - 6);
  for (int j = 0; j < 4; ++j) K.col(j) *= std::pow(10.0, 5 - 3 * j);
  const Equilibration scaling = Equilibrate(K);
  const MatrixX<double> scaled =
      (scaling.row.asDiagonal() * K * scaling.col.asDiagonal()).cwiseAbs();
  // Both factors are rounded to a power of two, by at most sqrt(2) each; ten passes leave the rest
  // within a per cent.
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(scaled.row(i).maxCoeff(), 0.49) << i;
    EXPECT_LT(scaled.row(i).maxCoeff(), 2.02) << i;
    EXPECT_TRUE(IsPowerOfTwo(scaling.row[i])) << scaling.row[i];
  }
  for (int j = 0; j < 4; ++j) {
    EXPECT_GT(scaled.col(j).maxCoeff(), 0.49) << j;
    EXPECT_TRUE(IsPowerOfTwo(scaling.col[j])) << scaling.col[j];
  }
}

TEST(ScalingTest, ABalancedMatrixIsLeftAlone) {
  const Equilibration scaling = Equilibrate(-MatrixX<double>::Identity(3, 3));
  EXPECT_EQ(scaling.row, VectorX<double>::Ones(3));
  EXPECT_EQ(scaling.col, VectorX<double>::Ones(3));
}

TEST(ScalingTest, ZerosKeepTheFactorOne) {
  MatrixX<double> K = MatrixX<double>::Zero(2, 3);
  K(0, 1) = 1024.0;
  const Equilibration scaling = Equilibrate(K);
  EXPECT_EQ(scaling.row[1], 1.0);
  EXPECT_EQ(scaling.col[0], 1.0);
  EXPECT_EQ(scaling.col[2], 1.0);
  EXPECT_EQ(scaling.row[0] * scaling.col[1] * 1024.0, 1.0);
  const Equilibration none = Equilibrate(MatrixX<double>(0, 2));
  EXPECT_EQ(none.row.size(), 0);
  EXPECT_EQ(none.col, VectorX<double>::Ones(2));
}

}  // namespace
}  // namespace tangible
