// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/model/model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/dynamics/elements/joint.h"
#include "tangible/scene/parameter.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

// A chain of two rods and a slider on the second; the anchors are where the bodies are as drawn.
Scene Chain(const std::string& first, const std::string& second, const std::string& slider) {
  return SceneOf(R"({"bodies": [
      {"name": "a", "shape": {"box": {"size": [0.1, 1]}}, "mass": 2, "position": [0, -0.5],
       "velocity": [0.3, -0.2], "angular_velocity": 0},
      {"name": "b", "shape": {"box": {"size": [0.1, 1]}}, "mass": 3, "inertia": 0.7,
       "position": [0.1, -1.5], "angle": 0.2},
      {"name": "c", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.3, -1.8]}],
    "joints": [
      {"name": "j0", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0])" +
                 first + R"(},
      {"name": "j1", "type": "revolute", "bodies": ["b", "a"], "anchor": [0.05, -1])" +
                 second + R"(},
      {"name": "j2", "type": "prismatic", "bodies": ["c", "b"], "anchor": [0.2, -1.7],
       "axis": [1, 2])" +
                 slider + "}]}");
}

TEST(ModelTest, NumbersStandWhereTheIndexSays) {
  const Scene scene = Chain("", "", R"(, "damping": 0.5, "limits": [-1, 2], "effort": 4)");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  const ModelStructure& s = *model.structure;
  ASSERT_EQ(static_cast<int>(model.parameters.size()), s.num_parameters);
  EXPECT_EQ(s.num_blocks(), 3);
  EXPECT_EQ(s.world(), 3);
  EXPECT_EQ(model.parameters[kGravityY], -9.81);
  EXPECT_EQ(model.parameters[s.bodies[1].mass], 3.0);
  EXPECT_EQ(model.parameters[s.bodies[1].inertia], 0.7);
  EXPECT_EQ(model.parameters[s.bodies[2].shape_numbers], 0.1);
  EXPECT_EQ(model.parameters[s.joints[2].damping], 0.5);
  EXPECT_EQ(model.parameters[s.joints[2].low], -1.0);
  EXPECT_EQ(model.parameters[s.joints[2].high], 2.0);
  EXPECT_EQ(model.parameters[s.joints[2].effort], 4.0);
  // The anchor in b's frame, which is turned by 0.2.
  EXPECT_NEAR(model.parameters[s.joints[1].geometry], -0.05 * std::cos(0.2) + 0.5 * std::sin(0.2),
              1e-15);
  EXPECT_FALSE(s.joint_loops);
}

// A rod from the chain's end to the world closes a loop of rows; a rope, which has a limit and no
// row, does not.
TEST(ModelTest, RowsCloseLoopsAndRopesDoNot) {
  for (const bool rope : {false, true}) {
    Scene scene = Chain("", "", "");
    const Scene more = SceneOf(R"({"bodies": [{"name": "c", "mass": 1,
        "shape": {"circle": {"radius": 0.1}}, "position": [0.3, -1.8]}],
        "joints": [{"name": "r", "type": "distance", "bodies": ["c", "world"],
        "anchors": [[0.3, -1.8], [1, 0]])" +
                               std::string(rope ? R"(, "limits": [0, 3])" : "") + "}]}");
    scene.joints.push_back(more.joints[0]);
    scene.joints.back().bodies[0] = 2;
    Model<double> model;
    State<double> state;
    BuildModel(scene, &model, &state);
    EXPECT_EQ(model.structure->joint_loops, !rope);
  }
}

TEST(ModelTest, InertiaFollowsMassAndShapeInValueAndDerivative) {
  const Scene scene = Chain("", "", "");
  BasicScene<LocalJet> jets = CastScene<LocalJet>(scene);
  jets.bodies[0].mass.v[0] = 1.0;
  jets.bodies[0].shape.numbers[1].v[1] = 1.0;
  Model<LocalJet> model;
  State<LocalJet> state;
  BuildModel(jets, &model, &state);
  const LocalJet inertia = model.parameters[model.structure->bodies[0].inertia];
  EXPECT_NEAR(inertia.a, 2.0 * (0.01 + 1.0) / 12.0, 1e-15);
  EXPECT_NEAR(inertia.v[0], 1.01 / 12.0, 1e-15);
  EXPECT_NEAR(inertia.v[1], 2.0 * 2.0 * 1.0 / 12.0, 1e-15);
  // A given inertia is a number of its own.
  EXPECT_EQ(model.parameters[model.structure->bodies[1].inertia].v.norm(), 0.0);
}

// Errors of all joints and of their rates.
void ExpectClosed(const Scene& scene) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  for (const JointIndex& joint : model.structure->joints) {
    JointRows<double> rows;
    EvaluateJoint(joint.type, state.PoseOf(joint.a), state.PoseOf(joint.b),
                  &model.parameters[joint.geometry], &rows);
    for (int k = 0; k < rows.rows; ++k) {
      EXPECT_NEAR(rows.error[k], 0.0, 1e-15) << joint.name;
      double speed = 0.0;
      for (int i = 0; i < 3; ++i) {
        speed += rows.row_a[k][i] * state.twist[3 * joint.a + i] +
                 rows.row_b[k][i] * state.twist[3 * joint.b + i];
      }
      EXPECT_NEAR(speed, 0.0, 1e-15) << joint.name;
    }
  }
}

TEST(ModelTest, InitialAnglesAndRatesKeepJointsClosed) {
  Scene scene = Chain(R"(, "angle": 0.4, "rate": 1.5)", R"(, "angle": -0.7, "rate": -2)",
                      R"(, "displacement": 0.15, "rate": 0.8)");
  scene.bodies[0].velocity.setZero();
  ExpectClosed(scene);
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  // The coordinates are what was asked for.
  const double expected[] = {0.4, -0.7, 0.15};
  for (int j = 0; j < 3; ++j) {
    const JointIndex& joint = model.structure->joints[j];
    JointRows<double> rows;
    EvaluateJoint(joint.type, state.PoseOf(joint.a), state.PoseOf(joint.b),
                  &model.parameters[joint.geometry], &rows);
    EXPECT_NEAR(rows.coordinate, expected[j], 1e-15);
  }
  EXPECT_NEAR(state.pose[2], 0.4, 1e-15);
  EXPECT_NEAR(state.pose[0], 0.5 * std::sin(0.4), 1e-15);
  EXPECT_NEAR(state.twist[2], 1.5, 1e-15);
  EXPECT_NEAR(state.twist[5], -0.5, 1e-15);  // relative rates add up
}

TEST(ModelTest, WhoMayCollide) {
  Scene scene = SceneOf(R"({"bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0]},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [1, 0]},
      {"name": "c1", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [2, 0]},
      {"name": "s", "static": true, "shape": {"circle": {"radius": 0.1}}},
      {"name": "k", "kinematic": true, "shape": {"circle": {"radius": 0.1}}, "position": [0, 9]},
      {"name": "n", "mass": 1, "inertia": 1, "position": [3, 0]}],
    "joints": [{"name": "j", "type": "weld", "bodies": ["b", "a"], "anchor": [0, 0]},
               {"name": "t", "type": "distance", "bodies": ["c1", "a"], "contact": true,
                "anchors": [[2, 0], [0, 0]]}],
    "no_contact": [["c*", "s"]]})");
  const auto structure = BuildStructure(scene);
  const auto may = [&](int i, int j) {
    EXPECT_EQ(structure->MayCollide(i, j), structure->MayCollide(j, i));
    return structure->MayCollide(i, j);
  };
  EXPECT_FALSE(may(0, 1));  // joined
  EXPECT_TRUE(may(0, 2));   // joined, with contact
  EXPECT_TRUE(may(1, 2));
  EXPECT_FALSE(may(2, 3));  // no_contact
  EXPECT_TRUE(may(1, 3));
  EXPECT_TRUE(may(1, 4));
  EXPECT_FALSE(may(3, 4));  // neither moves by forces
  EXPECT_FALSE(may(0, 5));  // no shape
}

TEST(ModelTest, TheLastPairEntryHolds) {
  Scene scene = Chain("", "", "");
  BasicPair<double> all, one;
  all.bodies[0] = all.bodies[1] = "*";
  all.friction = 0.1;
  one.bodies[0] = "b";
  one.bodies[1] = "c";
  one.restitution = 0.2;
  scene.pairs = {all, one};
  const auto structure = BuildStructure(scene);
  EXPECT_EQ(structure->FindPair(2, 1), &structure->pairs[1]);
  EXPECT_EQ(structure->FindPair(0, 1), &structure->pairs[0]);
  EXPECT_EQ(structure->pairs[1].friction, -1);
}

TEST(ModelTest, LoopsOfJointsAreSeen) {
  Scene scene = Chain("", "", "");
  BasicJoint<double> closing;
  closing.name = "closing";
  closing.bodies[0] = 2;
  closing.bodies[1] = -1;
  scene.joints.push_back(closing);
  EXPECT_TRUE(BuildStructure(scene)->joint_loops);
}

}  // namespace
}  // namespace tangible
