// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/system/block_lu.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "../../support/allocation_counter.h"
#include "../../support/contact_problems.h"
#include "../../support/random_matrix.h"

namespace tangible {
namespace {

using testing::Draw;

struct Case {
  int bodies, blocks;
  std::vector<std::pair<int, int>> edges;
};

// Random constraints between random bodies, on one body, doubled, and edges among bodies.
Case RandomCase(std::mt19937_64* random, int bodies, int constraints) {
  Case c{bodies, bodies + constraints, {}};
  for (int k = bodies; k < c.blocks; ++k) {
    const int a = static_cast<int>((*random)() % bodies);
    const int b = static_cast<int>((*random)() % bodies);
    c.edges.emplace_back(a, k);
    if (b != a) c.edges.emplace_back(b, k);
  }
  c.edges.emplace_back(0, bodies - 1);
  c.edges.emplace_back(bodies - 1, 0);
  return c;
}

// Fills the factorisation and the same dense matrix: bodies dominant, constraints' blocks small.
template <typename T>
MatrixX<double> Fill(const Case& c, std::mt19937_64* random, BlockLu<T>* lu) {
  MatrixX<double> dense = MatrixX<double>::Zero(3 * c.blocks, 3 * c.blocks);
  lu->SetPattern(c.blocks, c.bodies, c.edges);
  lu->SetZero();
  const auto add = [&](T* block, int row, int column, double size) {
    for (int i = 0; i < 9; ++i) {
      const double x = Draw(random, -size, size);
      block[i] += x;
      dense(3 * row + i / 3, 3 * column + i % 3) += x;
    }
  };
  for (int k = 0; k < c.blocks; ++k) {
    add(lu->Diagonal(k), k, k, 0.2);
    for (int i = 0; i < 3 && k < c.bodies; ++i) {
      lu->Diagonal(k)[4 * i] += 8.0;
      dense(3 * k + i, 3 * k + i) += 8.0;
    }
  }
  for (size_t e = 0; e < c.edges.size(); ++e) {
    const auto [i, j] = c.edges[e];
    add(lu->FirstSecond(static_cast<int>(e)), i, j, 1.0);
    add(lu->SecondFirst(static_cast<int>(e)), j, i, 1.0);
  }
  return dense;
}

TEST(BlockLuTest, SolvesAsTheDenseMatrix) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 40; ++trial) {
    BlockLu<double> lu;
    const Case c = RandomCase(&random, 2 + trial % 7, trial % 5);
    const MatrixX<double> dense = Fill(c, &random, &lu);
    ASSERT_TRUE(lu.Factor());
    const RowMatrixXd rhs = testing::RandomMatrix(3 * c.blocks, 3, trial);
    RowMatrixXd x = rhs;
    lu.Solve(x.data(), 3);
    RowMatrixXd y = rhs;
    lu.SolveTransposed(y.data(), 3);
    // Backward error: rounding times the condition of the random matrix, which is below 1e3.
    EXPECT_LT((dense * x - rhs).norm(), 1e-11 * (1.0 + x.norm()));
    EXPECT_LT((dense.transpose() * y - rhs).norm(), 1e-11 * (1.0 + y.norm()));
    EXPECT_GT((x - y).norm(), 1e-3);  // the matrix is not symmetric
  }
}

TEST(BlockLuTest, ConstraintsWithoutDiagonalAreEliminatedAfterABody) {
  // [M −Jᵀ; J 0] of a chain: every constraint's diagonal is 0.
  const int links = 10;
  BlockLu<double> lu;
  std::vector<std::pair<int, int>> edges;
  for (int k = 0; k < links; ++k) {
    if (k > 0) edges.emplace_back(k - 1, links + k);
    edges.emplace_back(k, links + k);
  }
  lu.SetPattern(2 * links, links, edges);
  lu.SetZero();
  MatrixX<double> dense = MatrixX<double>::Zero(6 * links, 6 * links);
  for (int k = 0; k < links; ++k) {
    for (int i = 0; i < 3; ++i) {
      lu.Diagonal(k)[4 * i] = 1.0 + k;
      dense(3 * k + i, 3 * k + i) = 1.0 + k;
    }
  }
  for (size_t e = 0; e < edges.size(); ++e) {
    for (int i = 0; i < 9; ++i) {
      const double x = 1.0 / (1.0 + i + e) + (i % 4 == 0 ? 1.0 : 0.0);
      lu.SecondFirst(static_cast<int>(e))[i] = x;
      lu.FirstSecond(static_cast<int>(e))[3 * (i % 3) + i / 3] = -x;
      dense(3 * edges[e].second + i / 3, 3 * edges[e].first + i % 3) = x;
      dense(3 * edges[e].first + i % 3, 3 * edges[e].second + i / 3) = -x;
    }
  }
  ASSERT_TRUE(lu.Factor());
  const VectorX<double> rhs = VectorX<double>::LinSpaced(6 * links, -1.0, 1.0);
  VectorX<double> x = rhs;
  lu.Solve(x.data(), 1);
  EXPECT_LT((dense * x - rhs).norm(), 1e-11 * x.norm());
}

// Keeps the third unknown of the blocks from `first` on to itself.
void Uncouple(const Case& c, int first, BlockLu<double>* lu, MatrixX<double>* dense) {
  for (int k = first; k < c.blocks; ++k) {
    const int third = 3 * k + 2;
    const double own = (*dense)(third, third) + 3.0;
    dense->row(third).setZero();
    dense->col(third).setZero();
    (*dense)(third, third) = own;
    double* block = lu->Diagonal(k);
    block[2] = block[5] = block[6] = block[7] = 0.0;
    block[8] = own;
  }
  const auto clear = [&](double* block, int row, int column) {
    for (int i = 0; i < 3; ++i) {
      if (row >= first) block[6 + i] = 0.0;
      if (column >= first) block[3 * i + 2] = 0.0;
    }
  };
  for (size_t e = 0; e < c.edges.size(); ++e) {
    const auto [i, j] = c.edges[e];
    clear(lu->FirstSecond(static_cast<int>(e)), i, j);
    clear(lu->SecondFirst(static_cast<int>(e)), j, i);
  }
}

TEST(BlockLuTest, NarrowBlocksAreSolvedAsFullOnes) {
  for (int trial = 0; trial < 20; ++trial) {
    std::mt19937_64 random(trial);
    const Case c = RandomCase(&random, 2 + trial % 7, trial % 5);
    // None, some or all blocks.
    const int first = trial % 3 == 0 ? 0 : c.blocks / 2;
    BlockLu<double> full, narrow;
    std::mt19937_64 again = random;
    MatrixX<double> dense = Fill(c, &random, &full);
    Uncouple(c, first, &full, &dense);
    dense = Fill(c, &again, &narrow);
    Uncouple(c, first, &narrow, &dense);
    for (int k = first; k < c.blocks; ++k) narrow.SetNarrow(k);
    ASSERT_TRUE(full.Factor());
    ASSERT_TRUE(narrow.Factor());
    for (const int columns : {1, 3}) {
      const RowMatrixXd rhs = testing::RandomMatrix(3 * c.blocks, columns, trial);
      RowMatrixXd x = rhs, y = rhs, x_full = rhs, y_full = rhs;
      narrow.Solve(x.data(), columns);
      narrow.SolveTransposed(y.data(), columns);
      full.Solve(x_full.data(), columns);
      full.SolveTransposed(y_full.data(), columns);
      EXPECT_EQ(x, x_full);  // what is left out are zeros
      EXPECT_EQ(y, y_full);
      EXPECT_LT((dense * x - rhs).norm(), 1e-11 * (1.0 + x.norm()));
      EXPECT_LT((dense.transpose() * y - rhs).norm(), 1e-11 * (1.0 + y.norm()));
    }
    BlockLu<double> other;
    narrow.MoveFactorsTo(&other);
    RowMatrixXd x = RowMatrixXd::Ones(3 * c.blocks, 1);
    RowMatrixXd x_full = x;
    other.Solve(x.data(), 1);
    full.Solve(x_full.data(), 1);
    EXPECT_EQ(x, x_full);
  }
}

TEST(BlockLuTest, ASingularBlockIsReportedAndNaNToo) {
  BlockLu<double> lu;
  lu.SetPattern(1, 1, {});
  lu.SetZero();
  EXPECT_FALSE(lu.Factor());
  lu.SetZero();
  for (int i = 0; i < 3; ++i) lu.Diagonal(0)[4 * i] = std::nan("");
  EXPECT_FALSE(lu.Factor());
  for (const double third : {0.0, std::nan("")}) {
    lu.SetZero();
    lu.SetNarrow(0);
    lu.Diagonal(0)[0] = lu.Diagonal(0)[4] = 1.0;
    lu.Diagonal(0)[8] = third;
    EXPECT_FALSE(lu.Factor());
  }
}

TEST(BlockLuTest, RefactorisationWithTheSamePatternAllocatesNothing) {
  std::mt19937_64 random(2);
  BlockLu<double> lu;
  const Case c = RandomCase(&random, 5, 6);
  Fill(c, &random, &lu);
  ASSERT_TRUE(lu.Factor());
  std::vector<double> x(3 * c.blocks, 1.0);
  const long before = testing::NumAllocations();
  lu.SetPattern(c.blocks, c.bodies, c.edges);
  lu.SetZero();
  for (int k = 0; k < c.blocks; ++k) {
    for (int i = 0; i < 3; ++i) lu.Diagonal(k)[4 * i] = 2.0;
  }
  EXPECT_TRUE(lu.Factor());
  lu.Solve(x.data(), 1);
  lu.SolveTransposed(x.data(), 1);
  EXPECT_EQ(testing::NumAllocations(), before);
  EXPECT_DOUBLE_EQ(x[0], 0.25);
}

TEST(BlockLuTest, CopiesAreIndependent) {
  std::mt19937_64 random(3);
  BlockLu<double> lu;
  const Case c = RandomCase(&random, 4, 4);
  const MatrixX<double> dense = Fill(c, &random, &lu);
  ASSERT_TRUE(lu.Factor());
  const BlockLu<double> copy = lu;
  lu.SetPattern(1, 1, {});
  lu.SetZero();
  VectorX<double> x = VectorX<double>::Ones(3 * c.blocks);
  copy.Solve(x.data(), 1);
  EXPECT_LT((dense * x - VectorX<double>::Ones(3 * c.blocks)).norm(), 1e-11 * (1.0 + x.norm()));
}

}  // namespace
}  // namespace tangible
