// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/least_squares.h"

#include <gtest/gtest.h>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

/// Blocks of one, no and two own parameters beside two shared ones; nothing is evaluated.
class ThreeBlocks : public LeastSquaresProblem {
 public:
  ThreeBlocks() : entries_(5) {}
  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override { return 2; }
  int num_blocks() const override { return 3; }
  int num_own(int block) const override { return block == 0 ? 1 : (block == 1 ? 0 : 2); }
  int num_rows(int block) const override { return 10 * (block + 1); }
  std::vector<RowPlace> Places(int block) const override {
    return std::vector<RowPlace>(static_cast<size_t>(num_rows(block)));
  }
  bool EvaluateBlock(int, const Eigen::VectorXd&, GradientMethod, BlockDerivatives,
                     BlockEvaluation*) override {
    return false;
  }

 private:
  std::vector<ParameterEntry> entries_;
};

TEST(BlockLayoutTest, SharedParametersComeFirstThenThoseOfEachBlock) {
  const BlockLayout layout((ThreeBlocks()));
  EXPECT_EQ(layout.num_parameters(), 5);
  EXPECT_EQ(layout.num_rows(), 60);
  EXPECT_EQ(layout.row_offset(2), 30);
  EXPECT_EQ(layout.num_local(2), 4);
  const Eigen::VectorXd p = Eigen::VectorXd::LinSpaced(5, 0.0, 4.0);
  EXPECT_EQ(layout.Local(0, p), Eigen::Vector3d(0.0, 1.0, 2.0));
  EXPECT_EQ(layout.Local(1, p), Eigen::Vector2d(0.0, 1.0));
  EXPECT_EQ(layout.Local(2, p), Eigen::Vector4d(0.0, 1.0, 3.0, 4.0));
  for (int block = 0; block < 3; ++block) {
    for (int i = 0; i < layout.num_local(block); ++i) {
      EXPECT_EQ(p[layout.ParameterOf(block, i)], layout.Local(block, p)[i]);
    }
  }
}

TEST(LeastSquaresTest, ARunIsOneBlockOfSharedParameters) {
  const Scene scene = MakeScene(kFallingBall);
  RolloutResiduals residuals =
      MakeResiduals(scene, {}, {Parameter("gravity/y", -9.0)}, Observe(scene, 10, 0.1, 1));
  const BlockLayout layout(residuals);
  EXPECT_EQ(layout.num_shared(), 1);
  EXPECT_EQ(layout.num_rows(), residuals.num_residuals());
  Eigen::VectorXd values;
  RowMatrixXd jacobian;
  const Eigen::VectorXd p = InitialOf(residuals.entries());
  ASSERT_TRUE(residuals.Evaluate(p, GradientMethod::kTangent, &values, &jacobian));
  BlockEvaluation block;
  ASSERT_TRUE(
      residuals.EvaluateBlock(0, p, GradientMethod::kTangent, BlockDerivatives::kCompute, &block));
  EXPECT_EQ(block.residuals, values);
  EXPECT_EQ(block.jacobian, jacobian);
  EXPECT_EQ(block.rollouts, 1);
  const std::vector<RowPlace> places = residuals.Places(0);
  ASSERT_EQ(places.size(), static_cast<size_t>(values.size()));
  EXPECT_EQ(places[0].series, places[3].series);  // x, y, angle, x
  EXPECT_NE(places[0].series, places[1].series);
  EXPECT_LT(places[0].time, places[3].time);
}

}  // namespace
}  // namespace tangible
