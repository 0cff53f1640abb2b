// SPDX-License-Identifier: Apache-2.0
//
// The decompositions against Eigen's own of the same matrices, bit for bit. Eigen's are
// instantiated here once more, which takes half a minute: not under the sanitizers, see
// CMakeLists.txt.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include "tangible/math/decompositions.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRankThreshold = 1e-10;

template <typename Matrix>
bool SameBits(const Matrix& a, const Matrix& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<size_t>(a.size())) == 0;
}

MatrixXd RandomEntries(Index rows, Index cols, std::mt19937* random) {
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  MatrixXd matrix(rows, cols);
  for (double& x : matrix.reshaped()) x = number(*random);
  return matrix;
}

/// Matrices of full rank and of less, small, and so large that Eigen goes by blocks (of 48).
std::vector<MatrixXd> Matrices(std::mt19937* random) {
  std::vector<MatrixXd> matrices;
  for (const auto& [rows, cols] :
       {std::pair<Index, Index>(1, 1), {2, 2}, {7, 3}, {3, 7}, {20, 20}, {101, 61}}) {
    matrices.push_back(RandomEntries(rows, cols, random));
    const Index rank = std::min(rows, cols) / 2;
    if (rank == 0) continue;
    const MatrixXd tall = RandomEntries(rows, rank, random);
    matrices.emplace_back(tall * RandomEntries(rank, cols, random));
  }
  return matrices;
}

/// Positive definite ones.
std::vector<MatrixXd> Definite(std::mt19937* random) {
  std::vector<MatrixXd> matrices;
  for (const Index size : {1, 2, 5, 20, 101}) {
    const MatrixXd half = RandomEntries(size, size, random);
    matrices.emplace_back(half * half.transpose() + MatrixXd::Identity(size, size));
  }
  return matrices;
}

TEST(DecompositionsOfEigenTest, OrthogonalDecomposition) {
  std::mt19937 random(1);
  int deficient = 0;
  for (const MatrixXd& matrix : Matrices(&random)) {
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> eigens;
    eigens.setThreshold(kRankThreshold);
    eigens.compute(matrix);
    OrthogonalDecomposition ours;
    ours.SetThreshold(kRankThreshold);
    ours.Compute(matrix);
    const Index rank = ours.rank();
    EXPECT_EQ(rank, eigens.rank());
    deficient += rank < std::min(matrix.rows(), matrix.cols()) ? 1 : 0;
    const VectorXd b = RandomEntries(matrix.rows(), 1, &random);
    const VectorXd c = RandomEntries(matrix.cols(), 1, &random);
    const MatrixXd many = RandomEntries(matrix.rows(), 3, &random);
    EXPECT_TRUE(SameBits<VectorXd>(ours.Solve(b), eigens.solve(b)));
    EXPECT_TRUE(SameBits<MatrixXd>(ours.Solve(many), eigens.solve(many)));
    EXPECT_TRUE(SameBits<VectorXd>(ours.SolveTransposed(c), eigens.transpose().solve(c)));
    EXPECT_TRUE(
        SameBits<MatrixXd>(ours.AdjointQTimes(many), eigens.householderQ().adjoint() * many));
    EXPECT_TRUE(SameBits<MatrixXd>(ours.PseudoInverse(), eigens.pseudoInverse()));
    EXPECT_TRUE(SameBits<MatrixXd>(ours.triangle().topLeftCorner(rank, rank),
                                   eigens.matrixT().topLeftCorner(rank, rank)));
    EXPECT_TRUE(
        SameBits<VectorXd>(OrthogonalDecomposition(matrix).Solve(b),
                           Eigen::CompleteOrthogonalDecomposition<MatrixXd>(matrix).solve(b)));
  }
  EXPECT_EQ(deficient, 5);
}

TEST(DecompositionsOfEigenTest, PivotedQr) {
  std::mt19937 random(2);
  int deficient = 0;
  for (const MatrixXd& matrix : Matrices(&random)) {
    Eigen::ColPivHouseholderQR<MatrixXd> eigens;
    eigens.setThreshold(kRankThreshold);
    eigens.compute(matrix);
    PivotedQr ours;
    ours.SetThreshold(kRankThreshold);
    ours.Compute(matrix);
    EXPECT_EQ(ours.cols(), matrix.cols());
    EXPECT_EQ(ours.rank(), eigens.rank());
    deficient += ours.rank() < std::min(matrix.rows(), matrix.cols()) ? 1 : 0;
    const VectorXd b = RandomEntries(matrix.rows(), 1, &random);
    const MatrixXd many = RandomEntries(matrix.rows(), 3, &random);
    EXPECT_TRUE(SameBits<VectorXd>(ours.Solve(b), eigens.solve(b)));
    EXPECT_TRUE(SameBits<MatrixXd>(ours.Q(), eigens.householderQ()));
    EXPECT_TRUE(SameBits<MatrixXd>(ours.QTimes(many), eigens.householderQ() * many));
    EXPECT_TRUE(
        SameBits<MatrixXd>(ours.AdjointQTimes(many), eigens.householderQ().adjoint() * many));
  }
  EXPECT_EQ(deficient, 5);
}

TEST(DecompositionsOfEigenTest, UnpivotedQr) {
  std::mt19937 random(3);
  for (const MatrixXd& matrix : Matrices(&random)) {
    const Eigen::HouseholderQR<MatrixXd> eigens(matrix);
    const UnpivotedQr ours(matrix);
    MatrixXd whole = eigens.matrixQR().triangularView<Eigen::Upper>();
    EXPECT_TRUE(SameBits<MatrixXd>(ours.UpperFactor(),
                                   whole.topRows(std::min(matrix.rows(), matrix.cols()))));
    const VectorXd b = RandomEntries(matrix.rows(), 1, &random);
    EXPECT_TRUE(SameBits<VectorXd>(ours.Solve(b), eigens.solve(b)));
    MatrixXd in_place = matrix;
    MakeUpperTriangular(&in_place);
    EXPECT_TRUE(SameBits(in_place, whole));
  }
}

TEST(DecompositionsOfEigenTest, Cholesky) {
  std::mt19937 random(4);
  for (const MatrixXd& matrix : Definite(&random)) {
    const Eigen::LLT<MatrixXd> eigens(matrix);
    const Cholesky ours(matrix);
    ASSERT_TRUE(ours.succeeded());
    const VectorXd b = RandomEntries(matrix.rows(), 1, &random);
    const MatrixXd many = RandomEntries(matrix.rows(), 3, &random);
    EXPECT_TRUE(SameBits<VectorXd>(ours.Solve(b), eigens.solve(b)));
    EXPECT_TRUE(SameBits<MatrixXd>(ours.Solve(many), eigens.solve(many)));
    EXPECT_TRUE(SameBits<MatrixXd>(ours.SolveUpper(many), eigens.matrixU().solve(many)));
    EXPECT_TRUE(SameBits<MatrixXd>(ours.Lower(), eigens.matrixL()));
  }
}

TEST(DecompositionsOfEigenTest, PartialLu) {
  std::mt19937 random(5);
  for (const Index size : {1, 2, 5, 20, 101}) {
    const MatrixXd matrix = RandomEntries(size, size, &random);
    const Eigen::PartialPivLU<MatrixXd> eigens(matrix);
    PartialLu ours;
    ours.Compute(matrix);
    const VectorXd b = RandomEntries(size, 1, &random);
    const MatrixXd many = RandomEntries(size, 3, &random);
    EXPECT_TRUE(SameBits<VectorXd>(ours.Solve(b), eigens.solve(b)));
    EXPECT_TRUE(SameBits<MatrixXd>(ours.Solve(many), eigens.solve(many)));
    EXPECT_TRUE(SameBits<VectorXd>(ours.SolveTransposed(b), eigens.transpose().solve(b)));
    RowMatrixXd by_rows = many;
    ours.SolveInPlace(&by_rows);
    EXPECT_TRUE(SameBits<RowMatrixXd>(by_rows, eigens.solve(many)));
    by_rows = many;
    ours.SolveTransposedInPlace(&by_rows);
    EXPECT_TRUE(SameBits<RowMatrixXd>(by_rows, eigens.transpose().solve(many)));
    EXPECT_EQ(ours.ReciprocalCondition(), eigens.rcond());
    EXPECT_TRUE(SameBits(ours.factors(), eigens.matrixLU()));
    EXPECT_TRUE(SameBits(PartialLu(matrix).factors(), eigens.matrixLU()));
  }
}

TEST(DecompositionsOfEigenTest, SymmetricEigen) {
  std::mt19937 random(6);
  for (const MatrixXd& matrix : Definite(&random)) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigens(matrix);
    const SymmetricEigen ours(matrix);
    EXPECT_TRUE(SameBits(ours.values(), eigens.eigenvalues()));
    EXPECT_TRUE(SameBits(ours.vectors(), eigens.eigenvectors()));
  }
}

}  // namespace
}  // namespace tangible
