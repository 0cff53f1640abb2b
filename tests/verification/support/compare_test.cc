// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/compare.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sliding_box.h"

namespace tangible {
namespace {

TEST(CompareTest, EntriesAgreeWithinTheirBound) {
  EXPECT_TRUE(Agree(1.0 + 0.9e-6, 1.0, 1e-6, 0.0));
  EXPECT_FALSE(Agree(1.0 + 1.1e-6, 1.0, 1e-6, 0.0));
  EXPECT_FALSE(Agree(1e-10, 0.0, 1e-6, 100.0));
  EXPECT_TRUE(Agree(0.9e-11, 0.0, 1e-6, 100.0));  // 1e-13 S
  EXPECT_TRUE(Agree(1e-10, 0.0, 1e-6, 100.0, 1e-11));
  EXPECT_FALSE(Agree(NAN, 1.0, 1e-6, 1.0));
  EXPECT_FALSE(Agree(1.0, NAN, 1e-6, 1.0));
}

TEST(CompareTest, ContributionsAreNotLessThanTheDerivative) {
  const Scene scene = SlidingBox("0.3");
  const std::vector<ParameterPath> parameters = {PathTo(scene, "pairs/box:floor/friction"),
                                                 PathTo(scene, "bodies/box/velocity/x")};
  const MatrixX<double> sum = ContributionMagnitudes(scene, parameters);
  ASSERT_EQ(sum.rows(), 6);
  ASSERT_EQ(sum.cols(), 2);
  EXPECT_GE(sum(3, 0), 9.81 * 0.1);
  EXPECT_GE(sum(0, 1), 0.1);
  EXPECT_GE(sum(3, 1), 1.0);
  for (int j = 0; j < 2; ++j) {
    EXPECT_GE(sum.col(j).minCoeff(), 0.1 * sum.col(j).maxCoeff() * (1.0 - 1e-15)) << j;
  }
}

TEST(CompareTest, ContributionsRememberWhatIsCancelled) {
  // The body lands in its only step: its height at the end is the floor's, whatever its own was.
  Scene scene = SlidingBox("0");
  scene.simulation.duration = scene.simulation.dt;
  scene.bodies[0].position.y() += 1e-3;
  const std::vector<ParameterPath> parameters = {PathTo(scene, "bodies/box/position/y")};
  const Contributions contributions = ContributionsOf(scene, parameters);
  EXPECT_GE(contributions.column[0], 1.0);
  EXPECT_GE(contributions.sum.minCoeff(), 0.1);
  EXPECT_EQ((contributions.sum - ContributionMagnitudes(scene, parameters)).norm(), 0.0);
}

}  // namespace
}  // namespace tangible
