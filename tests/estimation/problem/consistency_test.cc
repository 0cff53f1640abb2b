// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/consistency.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/fit_scenes.h"

namespace tangible {
namespace {

TEST(ConsistencyTest, TheLargestInertiaIsThatOfPointsAtTheBorder) {
  EXPECT_NEAR(LargestSquaredGyration({ShapeType::kCircle, {0.5}}), 0.25, 1e-15);
  EXPECT_NEAR(LargestSquaredGyration({ShapeType::kBox, {0.6, 0.8}}), 0.25, 1e-15);
  EXPECT_NEAR(LargestSquaredGyration({ShapeType::kCapsule, {0.8, 0.1}}), 0.25, 1e-15);
  // The same box as a polygon.
  EXPECT_NEAR(
      LargestSquaredGyration({ShapeType::kPolygon, {-0.3, -0.4, 0.3, -0.4, 0.3, 0.4, -0.3, 0.4}}),
      0.25, 1e-14);
  // Centre of mass near one end of a rod from −0.1 to 0.9: weights 0.9 and 0.1.
  EXPECT_NEAR(LargestSquaredGyration(
                  {ShapeType::kPolygon, {-0.1, -1e-9, 0.9, -1e-9, 0.9, 1e-9, -0.1, 1e-9}}),
              0.9 * 0.01 + 0.1 * 0.81, 1e-8);
  EXPECT_LT(LargestSquaredGyration({ShapeType::kPolygon, {1, 0, 2, 0, 2, 1}}), 0.0);
  EXPECT_TRUE(std::isinf(LargestSquaredGyration({ShapeType::kNone, {}})));
}

TEST(ConsistencyTest, BodiesThatCannotExistAreNamed) {
  Scene scene = MakeScene(kSlidingBox);  // 0.4 m x 0.2 m, 2 kg
  EXPECT_TRUE(FindInconsistentBodies(scene).empty());
  scene.bodies[0].inertia = 0.1;  // two points of 1 kg at opposite corners
  EXPECT_TRUE(FindInconsistentBodies(scene).empty());
  scene.bodies[0].inertia = 0.11;
  ASSERT_EQ(FindInconsistentBodies(scene).size(), 1u);
  EXPECT_EQ(FindInconsistentBodies(scene)[0],
            "body 'box' cannot exist: expected an inertia of at most 0.1 kg m^2, that of its mass "
            "of 2 kg at the border of its shape, got 0.11");
  scene.bodies[0].shape = {ShapeType::kPolygon, {0.1, 0.0, 0.4, 0.0, 0.4, 0.2}};
  ASSERT_EQ(FindInconsistentBodies(scene).size(), 1u);
  EXPECT_NE(FindInconsistentBodies(scene)[0].find("centre of mass is outside"), std::string::npos);
}

}  // namespace
}  // namespace tangible
