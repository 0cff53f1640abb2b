// SPDX-License-Identifier: Apache-2.0
#include "tangible/math/decompositions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of numbers up to 1 in matrices of up to 20 rows, whose inverses are below 1e3.
constexpr double kDecompositionRounding = 1e-11;
constexpr double kDecompositionRank = 1e-10;

MatrixXd RandomMatrix(Index rows, Index cols, std::mt19937* random) {
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  MatrixXd matrix(rows, cols);
  for (double& x : matrix.reshaped()) x = number(*random);
  return matrix;
}

/// A matrix of this rank.
MatrixXd OfRank(Index rank, Index rows, Index cols, std::mt19937* random) {
  const MatrixXd tall = RandomMatrix(rows, rank, random);
  return tall * RandomMatrix(rank, cols, random);
}

double Largest(const MatrixXd& x) { return x.size() == 0 ? 0.0 : x.cwiseAbs().maxCoeff(); }

TEST(OrthogonalDecompositionTest, SolvesWithTheLeastNorm) {
  std::mt19937 random(1);
  for (const auto& [rows, cols] : {std::pair<Index, Index>(7, 4), {4, 7}, {20, 20}}) {
    const MatrixXd a = OfRank(3, rows, cols, &random);
    OrthogonalDecomposition decomposition;
    decomposition.SetThreshold(kDecompositionRank);
    decomposition.Compute(a);
    EXPECT_EQ(decomposition.rank(), 3);
    // The four equations of Moore and Penrose.
    const MatrixXd inverse = decomposition.PseudoInverse();
    EXPECT_LT(Largest(a * inverse * a - a), kDecompositionRounding);
    EXPECT_LT(Largest(inverse * a * inverse - inverse), kDecompositionRounding);
    EXPECT_LT(Largest(a * inverse - (a * inverse).transpose()), kDecompositionRounding);
    EXPECT_LT(Largest(inverse * a - (inverse * a).transpose()), kDecompositionRounding);
    const VectorXd b = RandomMatrix(rows, 1, &random);
    const VectorXd c = RandomMatrix(cols, 1, &random);
    const MatrixXd many = RandomMatrix(rows, 2, &random);
    EXPECT_LT(Largest(decomposition.Solve(b) - inverse * b), kDecompositionRounding);
    EXPECT_LT(Largest(decomposition.Solve(many) - inverse * many), kDecompositionRounding);
    EXPECT_LT(Largest(decomposition.SolveTransposed(c) - inverse.transpose() * c),
              kDecompositionRounding);
    // Qᵀ A has nothing below the rank.
    EXPECT_LT(Largest(decomposition.AdjointQTimes(a).bottomRows(rows - 3)), kDecompositionRounding);
    EXPECT_GT(std::abs(decomposition.triangle()(2, 2)), kDecompositionRank);
  }
}

TEST(PivotedQrTest, FindsTheRankAndWhatIsOrthogonal) {
  std::mt19937 random(2);
  const MatrixXd a = OfRank(3, 7, 5, &random);
  PivotedQr qr(a);
  qr.SetThreshold(kDecompositionRank);  // which counts also after the matrix
  EXPECT_EQ(qr.rank(), 3);
  EXPECT_EQ(qr.cols(), 5);
  const MatrixXd q = qr.Q();
  EXPECT_LT(Largest(q.transpose() * q - MatrixXd::Identity(7, 7)), kDecompositionRounding);
  EXPECT_LT(Largest(q.rightCols(4).transpose() * a), kDecompositionRounding);
  const MatrixXd x = RandomMatrix(7, 2, &random);
  EXPECT_LT(Largest(qr.QTimes(x) - q * x), kDecompositionRounding);
  EXPECT_LT(Largest(qr.AdjointQTimes(x) - q.transpose() * x), kDecompositionRounding);
  const VectorXd b = RandomMatrix(7, 1, &random);
  EXPECT_LT(Largest(a.transpose() * (a * qr.Solve(b) - b)), kDecompositionRounding);
  qr.Compute(RandomMatrix(4, 4, &random));
  EXPECT_EQ(qr.rank(), 4);
  EXPECT_EQ(PivotedQr().cols(), 0);
}

TEST(UnpivotedQrTest, GivesTheUpperFactor) {
  std::mt19937 random(3);
  for (const auto& [rows, cols] : {std::pair<Index, Index>(7, 4), {4, 7}, {0, 3}, {3, 0}}) {
    const MatrixXd a = RandomMatrix(rows, cols, &random);
    const UnpivotedQr qr(a);
    const MatrixXd r = qr.UpperFactor();
    EXPECT_EQ(r.rows(), std::min(rows, cols));
    EXPECT_EQ(r.cols(), cols);
    EXPECT_LT(Largest(r.transpose() * r - a.transpose() * a), kDecompositionRounding);
    if (rows == 0 || cols == 0) continue;
    MatrixXd in_place = a;
    MakeUpperTriangular(&in_place);
    EXPECT_EQ(in_place.topRows(r.rows()), r);
    EXPECT_EQ(Largest(in_place.bottomRows(rows - r.rows())), 0.0);
    if (rows < cols) continue;
    const VectorXd b = RandomMatrix(rows, 1, &random);
    EXPECT_LT(Largest(a.transpose() * (a * qr.Solve(b) - b)), kDecompositionRounding);
  }
}

TEST(CholeskyTest, FactorsWhatIsPositiveDefinite) {
  std::mt19937 random(4);
  const MatrixXd half = RandomMatrix(5, 5, &random);
  const MatrixXd a = half * half.transpose() + MatrixXd::Identity(5, 5);
  const Cholesky cholesky(a);
  ASSERT_TRUE(cholesky.succeeded());
  const MatrixXd lower = cholesky.Lower();
  EXPECT_EQ(lower(0, 1), 0.0);
  EXPECT_LT(Largest(lower * lower.transpose() - a), kDecompositionRounding);
  const VectorXd b = RandomMatrix(5, 1, &random);
  const MatrixXd many = RandomMatrix(5, 2, &random);
  EXPECT_LT(Largest(a * cholesky.Solve(b) - b), kDecompositionRounding);
  EXPECT_LT(Largest(a * cholesky.Solve(many) - many), kDecompositionRounding);
  EXPECT_LT(Largest(lower.transpose() * cholesky.SolveUpper(many) - many), kDecompositionRounding);
}

TEST(CholeskyTest, FailsWhereAMatrixIsNotPositiveDefinite) {
  Cholesky cholesky;
  cholesky.Compute(MatrixXd::Identity(2, 2));
  EXPECT_TRUE(cholesky.succeeded());
  cholesky.Compute(-MatrixXd::Identity(2, 2));
  EXPECT_FALSE(cholesky.succeeded());
  cholesky.Compute(MatrixXd(0, 0));  // where all variables of a quadratic are at their bounds
}

TEST(PartialLuTest, SolvesASquareSystem) {
  std::mt19937 random(5);
  const MatrixXd a = RandomMatrix(5, 5, &random);
  PartialLu lu;
  lu.Compute(a);
  const VectorXd b = RandomMatrix(5, 1, &random);
  const MatrixXd many = RandomMatrix(5, 2, &random);
  EXPECT_LT(Largest(a * lu.Solve(b) - b), kDecompositionRounding);
  EXPECT_LT(Largest(a * lu.Solve(many) - many), kDecompositionRounding);
  EXPECT_LT(Largest(a.transpose() * lu.SolveTransposed(b) - b), kDecompositionRounding);
  RowMatrixXd by_rows = many;
  lu.SolveInPlace(&by_rows);
  EXPECT_LT(Largest(a * by_rows - many), kDecompositionRounding);
  by_rows = many;
  lu.SolveTransposedInPlace(&by_rows);
  EXPECT_LT(Largest(a.transpose() * by_rows - many), kDecompositionRounding);
  EXPECT_EQ(lu.factors(), PartialLu(a).factors());
  EXPECT_GT(lu.ReciprocalCondition(), kDecompositionRank);
  EXPECT_LT(PartialLu(OfRank(2, 5, 5, &random)).ReciprocalCondition(), kDecompositionRank);
}

TEST(SymmetricEigenTest, FindsValuesInOrderAndVectors) {
  std::mt19937 random(6);
  MatrixXd a = RandomMatrix(5, 5, &random);
  a = (a + a.transpose()).eval();
  const SymmetricEigen eigen(a);
  EXPECT_TRUE(std::is_sorted(eigen.values().begin(), eigen.values().end()));
  const MatrixXd& v = eigen.vectors();
  EXPECT_LT(Largest(v.transpose() * v - MatrixXd::Identity(5, 5)), kDecompositionRounding);
  EXPECT_LT(Largest(a * v - v * eigen.values().asDiagonal()), kDecompositionRounding);
}

}  // namespace
}  // namespace tangible
