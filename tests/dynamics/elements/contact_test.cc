// SPDX-License-Identifier: Apache-2.0
#include "tangible/dynamics/elements/contact.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/dynamics/assembly/assembly.h"

namespace tangible {
namespace {

Model<double> TwoBalls(double first, double second, Mixing mixing) {
  Scene scene;
  for (const double friction : {first, second}) {
    BasicBody<double> body;
    body.name = "ball" + std::to_string(scene.bodies.size());
    body.shape = {ShapeType::kCircle, {0.1}};
    body.mass = 1.0;
    body.position = Vector2<double>(0.3 * scene.bodies.size(), 0.0);
    body.friction = body.restitution = friction;
    scene.bodies.push_back(body);
  }
  scene.simulation.friction_mixing = scene.simulation.restitution_mixing = mixing;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  return model;
}

TEST(ContactTest, MixingRules) {
  const struct {
    Mixing mixing;
    double x, y, value, dx, dy;
    bool tie;
  } cases[] = {{Mixing::kAverage, 0.2, 0.8, 0.5, 0.5, 0.5, false},
               {Mixing::kGeometricMean, 0.2, 0.8, 0.4, 1.0, 0.25, false},
               {Mixing::kGeometricMean, 0.0, 0.8, 0.0, 0.0, 0.0, true}};
  for (const auto& c : cases) {
    const Model<double> model = TwoBalls(c.x, c.y, c.mixing);
    for (const CoefficientSource& source :
         {MixedFriction(model, 0, 1), MixedRestitution(model, 0, 1)}) {
      EXPECT_NEAR(source.value, c.value, 1e-15);
      EXPECT_NEAR(source.derivatives[0], c.dx, 1e-15);
      EXPECT_NEAR(source.derivatives[1], c.dy, 1e-15);
      EXPECT_EQ(source.tie, c.tie);
    }
  }
}

TEST(ContactTest, APairsOwnCoefficientHolds) {
  Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);  // crate and floor: restitution 0, friction mixed
  const CoefficientSource restitution = MixedRestitution(model, 1, 3);
  EXPECT_EQ(restitution.value, 0.0);
  EXPECT_EQ(restitution.numbers[0], model.structure->pairs[0].restitution);
  EXPECT_EQ(restitution.derivatives[0], 1.0);
  EXPECT_NEAR(MixedFriction(model, 1, 3).value, 0.35, 1e-15);
}

TEST(ContactTest, CoefficientsCarryTheChainRule) {
  CoefficientSource source;
  source.numbers[0] = 1;
  source.numbers[1] = 0;
  source.derivatives[0] = 0.5;
  source.derivatives[1] = -2.0;
  source.value = 7.0;
  const std::vector<LocalJet> numbers = {LocalJet(3.0, 0), LocalJet(4.0, 1)};
  const LocalJet x = EvaluateCoefficient(source, numbers);
  EXPECT_EQ(x.a, 7.0);
  EXPECT_EQ(x.v[0], -2.0);
  EXPECT_EQ(x.v[1], 0.5);
}

TEST(ContactTest, RowsAreTheSpeedsOfTheContactPoint) {
  ContactRows<double> rows;
  rows.geometry.normal = Vector2<double>(0.6, 0.8);
  rows.geometry.point = Vector2<double>(1.0, 2.0);
  RowsFromGeometry(ShapeType::kBox, Vector2<double>(0.5, 1.0), ShapeType::kBox,
                   Vector2<double>(3.0, 2.5), &rows);
  // Velocity of a's point at twist (0, 0, 1) is (−1, 0.5), of b's (0.5, −2).
  EXPECT_DOUBLE_EQ(rows.normal_a[2], -0.6 + 0.4);
  EXPECT_DOUBLE_EQ(rows.normal_b[2], -(0.3 - 1.6));
  // t = (n_y, −n_x)
  EXPECT_DOUBLE_EQ(rows.tangent_a[0], 0.8);
  EXPECT_DOUBLE_EQ(rows.tangent_a[1], -0.6);
  EXPECT_DOUBLE_EQ(rows.tangent_a[2], -0.8 - 0.3);
  EXPECT_DOUBLE_EQ(rows.tangent_b[0], -0.8);
}

TEST(ContactTest, NormalsDoNotTurnDiscs) {
  const double radius[] = {0.3, 0.2};
  const ShapeView<double> a = {ShapeType::kCircle, &radius[0], 1};
  const ShapeView<double> b = {ShapeType::kCircle, &radius[1], 1};
  const Pose<double> pose_a(Vector2<double>(0.1, 0.7), 0.4);
  const Pose<double> pose_b(Vector2<double>(0.3, 0.3), -0.2);
  ContactRows<double> rows;
  rows.geometry = EvaluateContact({}, a, pose_a, b, pose_b);
  RowsFromGeometry(a.type, pose_a.position, b.type, pose_b.position, &rows);
  EXPECT_EQ(rows.normal_a[2], 0.0);
  EXPECT_EQ(rows.normal_b[2], 0.0);
  // Of boxes at the same places the arms and normals are multiplied, which is 0 but for rounding.
  RowsFromGeometry(ShapeType::kBox, pose_a.position, ShapeType::kBox, pose_b.position, &rows);
  EXPECT_NEAR(rows.normal_a[2], 0.0, 1e-15);
  EXPECT_NEAR(rows.normal_b[2], 0.0, 1e-15);
  // Friction does: n points up from b to a, t = (n_y, −n_x).
  EXPECT_NEAR(rows.tangent_a[2], rows.geometry.gap / 2.0 + radius[0], 1e-15);
}

TEST(ContactTest, LimitsAreContactsOfTheCoordinate) {
  Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);  // limits −1.5, 2 at angle 0.1
  ActiveContact limit;
  limit.joint = 0;
  limit.a = model.structure->joints[0].a;
  limit.b = model.structure->joints[0].b;
  ContactRows<double> rows;
  limit.side = 1.0;
  EvaluateActiveRows(model, state, limit, &rows);
  EXPECT_NEAR(rows.geometry.gap, 1.6, 1e-15);
  EXPECT_EQ(rows.normal_a[2], 1.0);
  limit.side = -1.0;
  EvaluateActiveRows(model, state, limit, &rows);
  EXPECT_NEAR(rows.geometry.gap, 1.9, 1e-15);
  EXPECT_EQ(rows.normal_a[2], -1.0);
  EXPECT_EQ(rows.tangent_a[2], 0.0);
}

TEST(ContactTest, FrictionInAJointIsAContactWithoutANormal) {
  Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  scene.joints[0].friction = 0.3;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  std::vector<ActiveContact> contacts;
  AppendJointFriction(model, {}, &contacts);
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_TRUE(contacts[0].IsJointFriction());
  const CoefficientSource source = FrictionOf(model, contacts[0]);
  EXPECT_EQ(source.value, 0.3);
  EXPECT_EQ(source.numbers[0], model.structure->joints[0].friction);
  ContactRows<double> rows;
  EvaluateActiveRows(model, state, contacts[0], &rows);
  EXPECT_EQ(rows.geometry.gap, 0.0);
  EXPECT_EQ(rows.normal_a[2], 0.0);
  EXPECT_EQ(rows.tangent_a[2], 1.0);
  EXPECT_EQ(rows.tangent_b[2], -1.0);
}

TEST(ContactTest, LawConstants) {
  SimulationSettings settings;
  settings.recovery_speed = 3.0;
  EXPECT_DOUBLE_EQ(LawConstant(ContactLaw::kGap, 0.02, 0.01, 0.5, -4.0, settings), 2.0);
  EXPECT_DOUBLE_EQ(LawConstant(ContactLaw::kGap, -0.02, 0.01, 0.5, -4.0, settings), -2.0);
  EXPECT_DOUBLE_EQ(LawConstant(ContactLaw::kRecovery, -0.2, 0.01, 0.5, -4.0, settings), -3.0);
  EXPECT_DOUBLE_EQ(LawConstant(ContactLaw::kRestitution, 0.02, 0.01, 0.5, -4.0, settings), -2.0);
}

}  // namespace
}  // namespace tangible
