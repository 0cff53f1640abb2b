// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/lengths.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"

namespace tangible {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

class LengthsTest : public ::testing::Test {
 protected:
  // Bodies 0: a box, 1: a disc, 2: a rod without a shape, 3: a floor, 4: the world.
  void SetUp() override {
    BuildModel(test_scenes::SceneOf(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.6, 0.8]}}, "mass": 1, "position": [3, -7]},
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
       "position": [0, 0], "angle": -400},
      {"name": "rod", "mass": 3, "inertia": 0.25, "position": [0, 0]},
      {"name": "floor", "static": true,
       "shape": {"half_plane": {"normal": [0, 1], "offset": -9}}}],
      "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0],
                  "limits": [-1, 1], "angle": 0.5},
                 {"name": "rail", "type": "prismatic", "bodies": ["disc", "box"], "anchor": [0, 0],
                  "axis": [1, 0], "limits": [-1, 1]}]})"),
               &model_, &state_);
  }

  Model<double> model_;
  State<double> state_;
};

TEST_F(LengthsTest, Sizes) {
  const Lengths lengths(model_);
  EXPECT_DOUBLE_EQ(lengths.radius(0), 0.5);
  EXPECT_EQ(lengths.radius(1), 0.1);
  EXPECT_EQ(lengths.radius(2), 0.0);
  EXPECT_DOUBLE_EQ(lengths.size(2), 0.5);  // I = m (2 r)² / 12
  EXPECT_EQ(lengths.size(3), 0.0);
  EXPECT_EQ(lengths.smallest_radius(), 0.1);
  EXPECT_EQ(lengths.Size(0, 1), 0.1);
  EXPECT_DOUBLE_EQ(lengths.Size(0, 3), 0.5);
  EXPECT_DOUBLE_EQ(lengths.Size(3, 0), 0.5);
  EXPECT_EQ(lengths.Size(3, 4), 0.0);
}

// A rod with a point 0.5 m from its centre, and a disc with one beyond its rim.
TEST(LengthsOfContactPointsTest, CountTheirPoints) {
  Model<double> model;
  State<double> state;
  BuildModel(test_scenes::SceneOf(R"({"bodies": [
      {"name": "rod", "contact_points": [[0.3, -0.4], [0.1, 0]], "mass": 3, "inertia": 0.25,
       "position": [0, 0]},
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "contact_points": [[0, 0.2]],
       "mass": 1, "position": [1, 0]}]})"),
             &model, &state);
  EXPECT_DOUBLE_EQ(RadiusOf(model, 0), 0.5);
  EXPECT_DOUBLE_EQ(RadiusOf(model, 1), 0.2);
  EXPECT_EQ(RadiusOf(model, 2), 0.0);
  EXPECT_DOUBLE_EQ(Lengths(model).size(0), 0.5);
  EXPECT_DOUBLE_EQ(Lengths(model).smallest_radius(), 0.2);
  const Aabb rod = BoxOf(model, 0, state.PoseOf(0), 0.01);
  EXPECT_DOUBLE_EQ(rod.min_x, 0.09);
  EXPECT_DOUBLE_EQ(rod.min_y, -0.41);
  EXPECT_DOUBLE_EQ(rod.max_x, 0.31);
  EXPECT_DOUBLE_EQ(rod.max_y, 0.01);
  const Aabb disc = BoxOf(model, 1, state.PoseOf(1), 0.0);
  EXPECT_DOUBLE_EQ(disc.max_y, 0.2);
  EXPECT_DOUBLE_EQ(disc.min_y, -0.1);
  const Aabb none = BoxOf(model, 2, state.PoseOf(2), 0.0);
  EXPECT_GT(none.min_x, none.max_x);
}

// A point meets shapes alone: two bodies that have nothing but points are not looked at.
TEST(LengthsOfContactPointsTest, MayCollideWithShapes) {
  Model<double> model;
  State<double> state;
  BuildModel(test_scenes::SceneOf(R"({"bodies": [
      {"name": "p", "contact_points": [[0, 0]], "mass": 3, "inertia": 1, "position": [0, 0]},
      {"name": "q", "contact_points": [[0, 0]], "mass": 3, "inertia": 1, "position": [0, 0]},
      {"name": "n", "mass": 3, "inertia": 1, "position": [0, 0]},
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [1, 0]}]})"),
             &model, &state);
  EXPECT_FALSE(model.structure->MayCollide(0, 1));
  EXPECT_FALSE(model.structure->MayCollide(2, 3));
  EXPECT_TRUE(model.structure->MayCollide(0, 3));
}

TEST_F(LengthsTest, CoordinatesArePlacesAndTurns) {
  const Lengths lengths(model_);
  EXPECT_EQ(lengths.Coordinate(state_, 0, 3), 7.0);
  EXPECT_DOUBLE_EQ(lengths.Coordinate(state_, 1, 0), 40.0);
  EXPECT_DOUBLE_EQ(lengths.Rounding(state_, 0, 3), 64.0 * kEpsilon * 7.0);
  EXPECT_DOUBLE_EQ(lengths.Touch(state_, 0, 3), 1e-10 * 0.5 + 64.0 * kEpsilon * 7.0);
}

TEST_F(LengthsTest, LimitsByType) {
  const Lengths lengths(model_);
  const std::vector<JointIndex>& joints = model_.structure->joints;
  EXPECT_DOUBLE_EQ(lengths.LimitTouch(state_, joints[0]), 1e-10 + 64.0 * kEpsilon * 0.5);
  EXPECT_DOUBLE_EQ(lengths.LimitTouch(state_, joints[1]), lengths.Touch(state_, 0, 1));
}

TEST(IsAngleTest, RowsOfJoints) {
  EXPECT_FALSE(IsAngle(JointType::kRevolute, 1));
  EXPECT_FALSE(IsAngle(JointType::kWeld, 1));
  EXPECT_TRUE(IsAngle(JointType::kWeld, 2));
  EXPECT_FALSE(IsAngle(JointType::kPrismatic, 0));
  EXPECT_TRUE(IsAngle(JointType::kPrismatic, 1));
  EXPECT_FALSE(IsAngle(JointType::kDistance, 0));
  EXPECT_TRUE(IsAngle(JointType::kFixedAngle, 0));
}

}  // namespace
}  // namespace tangible
