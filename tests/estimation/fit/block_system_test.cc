// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/block_system.h"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include "../../support/block_problem.h"
#include "../../support/random_matrix.h"

namespace tangible {
namespace {

/// Random blocks with the layout of three recordings and a prior, and the matrix of all rows.
struct RandomSystem {
  RandomSystem() : problem(3, 1), layout(problem) {
    for (int b = 0; b < layout.num_blocks(); ++b) {
      blocks.emplace_back(testing::RandomMatrix(4, layout.num_local(b), b));
      c.emplace_back(testing::RandomMatrix(4, 1, 10 + b));
    }
  }
  /// Own parameters come first in a block, shared ones first in all.
  Eigen::MatrixXd Whole() const {
    Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(16, layout.num_parameters());
    for (int b = 0; b < 4; ++b) {
      const int own = layout.num_own(b);
      whole.block(4 * b, 0, 4, 2) = blocks[b].rightCols(2);
      whole.block(4 * b, layout.own_offset(b), 4, own) = blocks[b].leftCols(own);
    }
    return whole;
  }
  Eigen::VectorXd Right() const {
    Eigen::VectorXd right(16);
    right << c[0], c[1], c[2], c[3];
    return right;
  }
  DecayProblem problem;
  BlockLayout layout;
  std::vector<RowMatrixXd> blocks;
  std::vector<Eigen::VectorXd> c;
};

TEST(BlockSystemTest, SolvesTheWholeSystem) {
  RandomSystem random;
  random.blocks[1].col(0) *= 1e6;  // columns of unlike scale
  const BlockSystem system(random.layout, random.blocks, std::vector<bool>(5, false));
  const Eigen::VectorXd expected =
      -random.Whole().completeOrthogonalDecomposition().solve(random.Right());
  const Eigen::VectorXd step = system.LeastSquares(random.c);
  EXPECT_LT((step - expected).cwiseQuotient(expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((system.lengths() - random.Whole().colwise().norm().transpose())
                .cwiseQuotient(system.lengths())
                .norm(),
            1e-14);
  // With the gradient of (1) Newton's step is the same.
  const Eigen::VectorXd newton = system.Newton(random.Whole().transpose() * random.Right());
  EXPECT_LT((newton - expected).cwiseQuotient(expected).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(BlockSystemTest, WhatIsHeldHasNoPart) {
  const RandomSystem random;
  const BlockSystem system(random.layout, random.blocks, {false, true, false, true, false});
  Eigen::MatrixXd whole = random.Whole();
  whole.col(1).setZero();
  whole.col(3).setZero();
  const Eigen::VectorXd expected = -whole.completeOrthogonalDecomposition().solve(random.Right());
  EXPECT_LT((system.LeastSquares(random.c) - expected).norm(), 1e-13);
  EXPECT_LT((system.Newton(whole.transpose() * random.Right()) - expected).norm(), 1e-12);
  EXPECT_EQ(system.lengths()[3], 0.0);
}

// A block that does not determine its own parameter, and a gradient that is outside the range.
TEST(BlockSystemTest, DirectionsThatAreNotDeterminedAreLeftAlone) {
  RandomSystem random;
  random.blocks[2].col(0).setZero();
  const BlockSystem system(random.layout, random.blocks, std::vector<bool>(5, false));
  const Eigen::VectorXd expected =
      -random.Whole().completeOrthogonalDecomposition().solve(random.Right());
  const Eigen::VectorXd step = system.LeastSquares(random.c);
  EXPECT_EQ(step[4], 0.0);
  EXPECT_LT((step - expected).norm(), 1e-13);
  EXPECT_TRUE(system.Newton(Eigen::VectorXd::Ones(5)).allFinite());
  EXPECT_EQ(system.Newton(Eigen::VectorXd::Ones(5))[4], 0.0);
}

}  // namespace
}  // namespace tangible
