// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/invariants.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "../../support/built.h"
#include "tangible/geometry/collide.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using testing::Build;
using testing::Built;

constexpr double kRounding = 1e-14;

TEST(Energy, CountsTranslationRotationGravityAndSprings) {
  const Built built = Build(R"({"gravity": [1, -10], "bodies": [
      {"name": "a", "mass": 2, "inertia": 0.5, "position": [3, 4], "velocity": [1, -2],
       "angular_velocity": 4},
      {"name": "wall", "static": true, "position": [100, 100]}],
    "springs": [{"name": "s", "bodies": ["a", "world"], "anchors": [[3, 4], [0, 0]],
                 "stiffness": 7, "rest_length": 2}]})");
  // T = ½ 2 (1 + 4) + ½ 0.5 16;  U = −2 (1·3 − 10·4) + ½ 7 (5 − 2)².
  EXPECT_NEAR(KineticEnergy(built.model, built.state), 9.0, 9.0 * kRounding);
  EXPECT_NEAR(PotentialEnergy(built.model, built.state), 74.0 + 31.5, 105.5 * kRounding);
}

TEST(Energy, CountsSpringsOfJoints) {
  const Built built = Build(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 2, "inertia": 0.5, "position": [0, -1]},
      {"name": "b", "mass": 1, "inertia": 0.1, "position": [5, 0]}],
    "joints": [{"name": "hinge", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "angle": 0.3, "stiffness": 8, "rest_angle": -0.1},
               {"name": "rail", "type": "prismatic", "bodies": ["b", "world"], "anchor": [5, 0],
                "axis": [1, 0], "displacement": 0.5, "stiffness": 20}]})");
  EXPECT_NEAR(PotentialEnergy(built.model, built.state), 0.5 * 8.0 * 0.16 + 0.5 * 20.0 * 0.25,
              10.0 * kRounding);
}

TEST(Momentum, IsAboutTheOrigin) {
  const Built built = Build(R"({"bodies": [
      {"name": "a", "mass": 2, "inertia": 0.5, "position": [3, 4], "velocity": [1, -2],
       "angular_velocity": 4},
      {"name": "belt", "kinematic": true, "position": [0, 5], "velocity": [9, 9]}]})");
  const Vector3<double> momentum = Momentum(built.model, built.state);
  EXPECT_DOUBLE_EQ(momentum[0], 2.0);
  EXPECT_DOUBLE_EQ(momentum[1], -4.0);
  // m (x vy − y vx) + I ω = 2 (−6 − 4) + 2; what moves by prescription does not count.
  EXPECT_DOUBLE_EQ(momentum[2], -18.0);
}

TEST(Momentum, IsKeptByACollisionWithFriction) {
  const Built built = Build(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.5}}, "mass": 2, "position": [0, 0],
       "velocity": [1, 0], "angular_velocity": 3, "friction": 0.4, "restitution": 0.6},
      {"name": "b", "shape": {"box": {"size": [1, 1]}}, "mass": 1, "position": [1.2, 0.3],
       "velocity": [-2, 0.1], "friction": 0.4, "restitution": 0.6}],
    "simulation": {"dt": 0.01, "duration": 0.5}})");
  State<double> final;
  const RolloutReport report = Rollout(built.model, built.state, {}, &final);
  ASSERT_EQ(report.status, StepStatus::kDone);
  ASSERT_GE(report.contacts_max, 1);
  const Vector3<double> before = Momentum(built.model, built.state);
  const Vector3<double> after = Momentum(built.model, final);
  EXPECT_NEAR(before[0], after[0], 1e-13);
  EXPECT_NEAR(before[1], after[1], 1e-13);
  // Angular momentum about the origin changes while impulses act at poses of the step's start:
  // first order in dt. Impulses are at one point for both bodies, so it is kept to rounding all the
  // same.
  EXPECT_NEAR(before[2], after[2], 1e-12);
  EXPECT_LT(KineticEnergy(built.model, final), 0.9 * KineticEnergy(built.model, built.state));
}

TEST(DeepestPenetration, LooksAtAllPairsThatMayCollide) {
  const std::string bodies = R"({"bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 1]},
      {"name": "b", "shape": {"circle": {"radius": 0.25}}, "mass": 1, "position": [1, 1]},
      {"name": "c", "shape": {"circle": {"radius": 0.25}}, "mass": 1, "position": [1.4, 1]},)" +
                             std::string(test_scenes::kFloor) + "]";
  const Built all = Build(bodies + "}");
  EXPECT_NEAR(DeepestPenetration(all.model, all.state), 0.1, kRounding);
  const Built fewer = Build(bodies + R"(, "no_contact": [["b", "c"]]})");
  EXPECT_EQ(DeepestPenetration(fewer.model, fewer.state), 0.0);
  const Built none = Build(bodies + R"(, "no_contact": [["*", "*"]]})");
  EXPECT_EQ(DeepestPenetration(none.model, none.state), 0.0);
}

// By the definition: every pair.
double PenetrationOfAllPairs(const Built& built) {
  const ModelStructure& s = *built.model.structure;
  double deepest = 0.0;
  for (int a = 0; a < s.num_bodies(); ++a) {
    for (int b = a + 1; b < s.num_bodies(); ++b) {
      if (!s.MayCollide(a, b)) continue;
      ContactFeature features[2];
      const Pose<double> pose_a = built.state.PoseOf(a);
      const Pose<double> pose_b = built.state.PoseOf(b);
      const int count =
          FindContactFeatures(built.model.Shape(a), pose_a, built.model.Shape(b), pose_b,
                              std::numeric_limits<double>::infinity(), features);
      for (int k = 0; k < count; ++k) {
        deepest = std::max(deepest, -EvaluateContact(features[k], built.model.Shape(a), pose_a,
                                                     built.model.Shape(b), pose_b)
                                         .gap);
      }
    }
  }
  return deepest;
}

/// Random scenes: what overlaps deepest is a large body among small ones, a half-plane, bodies that
/// just touch, or there is nothing that does.
class RandomBodies {
 public:
  explicit RandomBodies(unsigned seed) : random_(seed) {}

  Scene Make() {
    Scene scene;
    const double spread = std::exp(Uniform(-1.0, 6.0));  // m; a few bodies in much room, or many
    const double sizes = Uniform(0.0, 5.0);              // powers of e between the sizes
    const double place = Uniform(0.0, 1.0) < 0.2 ? 1e6 : 0.0;
    const int bodies = 2 + static_cast<int>(Uniform(0.0, 40.0));
    for (int i = 0; i < bodies; ++i) {
      BasicBody<double> body;
      body.name = "b" + std::to_string(i);
      body.mass = 1.0;
      body.position = {place + Uniform(-spread, spread), Uniform(-spread, spread)};
      body.angle = Uniform(0.0, 1.0) < 0.3 ? 0.0 : Uniform(-4.0, 4.0);
      SetShape(std::exp(Uniform(-sizes, sizes)), spread, &body);
      scene.bodies.push_back(std::move(body));
    }
    return scene;
  }

 private:
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  void SetShape(double size, double spread, BasicBody<double>* body) {
    const double kind = Uniform(0.0, 1.0);
    body->inertia = 1.0;
    if (kind < 0.05) {
      body->motion = Motion::kStatic;
      const bool along = Uniform(0.0, 1.0) < 0.5;
      const double angle = along ? 0.0 : Uniform(-4.0, 4.0);
      body->shape = {ShapeType::kHalfPlane, {std::sin(angle), std::cos(angle), -spread}};
    } else if (kind < 0.35) {
      body->shape = {ShapeType::kCircle, {size}};
    } else if (kind < 0.65) {
      body->shape = {ShapeType::kBox, {size, Uniform(0.01, 1.0) * size}};
    } else if (kind < 0.85) {
      body->shape = {ShapeType::kCapsule, {size, Uniform(0.01, 1.0) * size}};
    } else if (kind < 0.95) {
      body->shape = {ShapeType::kPolygon, {-size, -size, 2.0 * size, -size, -size, 2.0 * size}};
    }
  }

  std::mt19937 random_;
};

TEST(DeepestPenetration, IsThatOfAllPairsInRandomScenes) {
  RandomBodies random(20260501);
  int touching = 0;
  int apart = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    Built built;
    BuildModel(random.Make(), &built.model, &built.state);
    const double expected = PenetrationOfAllPairs(built);
    EXPECT_EQ(DeepestPenetration(built.model, built.state), expected) << trial;
    (expected > 0.0 ? touching : apart) += 1;
  }
  EXPECT_GT(touching, 500);
  EXPECT_GT(apart, 200);
}

// Two bodies that touch by rounding, at random places: their boxes meet by rounding or not.
TEST(DeepestPenetration, IsExactWhereBodiesJustTouch) {
  std::mt19937 random(7);
  const auto uniform = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  int touching = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    Scene scene;
    const double x = std::exp(uniform(-3.0, 12.0));
    const double y = uniform(-2.0, 2.0);
    const bool is_box = trial % 2 == 0;
    for (const double side : {0.0, 1.0}) {
      BasicBody<double> body;
      body.name = side == 0.0 ? "a" : "b";
      body.mass = 1.0;
      body.inertia = 1.0;
      // A corner that stands a little beyond the end of the other's face, and as high as it.
      const double beyond = side * uniform(-1e-6, 1e-6) * (trial % 3 == 0 ? 1.0 : 0.0);
      body.position = is_box ? Vector2<double>(x + side * (1.0 + beyond), y + side)
                             : Vector2<double>(x + side, y);
      body.shape = is_box ? BasicShape<double>{ShapeType::kBox, {1.0, 1.0}}
                          : BasicShape<double>{ShapeType::kCircle, {0.5}};
      scene.bodies.push_back(std::move(body));
    }
    Built built;
    BuildModel(scene, &built.model, &built.state);
    const double expected = PenetrationOfAllPairs(built);
    EXPECT_EQ(DeepestPenetration(built.model, built.state), expected) << trial;
    touching += expected > 0.0 ? 1 : 0;
  }
  EXPECT_GT(touching, 30);
}

TEST(CountIslands, JoinsByJointsAndClosedContacts) {
  const std::string text = R"({"bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.1]},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.3]},
      {"name": "c", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [2, 0.1]},
      {"name": "d", "mass": 1, "inertia": 1, "position": [4, 3]},
      {"name": "e", "mass": 1, "inertia": 1, "position": [5, 3]}, )" +
                           std::string(test_scenes::kFloor) + R"(],
    "joints": [{"name": "bar", "type": "distance", "bodies": ["d", "e"],
                "anchors": [[4, 3], [5, 3]]}]})";
  Built built = Build(text);
  Stepper stepper(built.model);
  ASSERT_EQ(stepper.Step(built.model, 0.0, 0.01, &built.state).status, StepStatus::kDone);
  // b rests on a; c is alone; d is joined to e. The floor joins nothing.
  std::vector<std::pair<int, int>> closed;
  AddClosedContacts(stepper.record(), &closed);
  EXPECT_EQ(closed.size(), 3u);
  EXPECT_EQ(CountIslands(*built.model.structure, closed.data(), closed.size()), 3);
  // Only the joint.
  EXPECT_EQ(CountIslands(*built.model.structure, nullptr, 0), 4);
}

}  // namespace
}  // namespace tangible
