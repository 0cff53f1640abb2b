// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/certificate/feature_ties.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/certificate/certify.h"
#include "tangible/simulation/certificate/tolerances.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

// A moving body `shape` at (x, y), and a static one; a step of 0.01 s from rest.
Scene OnTop(const std::string& shape, double x, double y, const std::string& support,
            const std::string& more = "") {
  Scene scene = test_scenes::SceneOf(
      R"({"bodies": [{"name": "top", "mass": 1, "position": [0, 0], "friction": 0.4, "shape": )" +
      shape + more + R"(}, {"name": "support", "static": true, "friction": 0.4, "shape": )" +
      support + R"(}], "simulation": {"dt": 0.01, "duration": 0.01}})");
  scene.bodies[0].position = Vector2<double>(x, y);
  return scene;
}

const char kBall[] = R"({"circle": {"radius": 0.5}})";
const char kBox[] = R"({"box": {"size": [2, 2]}})";
const char kWedge[] = R"({"polygon": {"vertices": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}})";
const char kFloor[] = R"({"half_plane": {"normal": [0, 1], "offset": 0}})";

Certificate CertificateOf(const Scene& scene, double* margin = nullptr) {
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  State<double> after = state;
  EXPECT_EQ(stepper.Step(model, 0.0, 0.01, &after).status, StepStatus::kDone);
  if (margin != nullptr) {
    const StepRecord& record = stepper.record();
    EXPECT_FALSE(record.contacts.empty());
    *margin = FeatureChangeMargin(model, record, 0, record.contacts.size(), &stepper.system());
  }
  return CertifyRollout(model, state);
}

double MarginOf(const Scene& scene) {
  double margin = 0.0;
  CertificateOf(scene, &margin);
  return margin;
}

// Final twists after one step with the top body moved by dx.
std::vector<double> TwistAt(Scene scene, double dx) {
  scene.bodies[0].position.x() += dx;
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  EXPECT_EQ(Rollout(model, state, {}, &state).status, StepStatus::kDone);
  return {state.twist[0], state.twist[1], state.twist[2]};
}

// Largest difference of the derivatives to the right and to the left.
double OneSidedDifference(const Scene& scene) {
  const double h = 1e-6;
  const std::vector<double> right = TwistAt(scene, h);
  const std::vector<double> here = TwistAt(scene, 0.0);
  const std::vector<double> left = TwistAt(scene, -h);
  double largest = 0.0;
  for (int i = 0; i < 3; ++i) {
    largest = std::max(largest, std::abs(right[i] - 2.0 * here[i] + left[i]) / h);
  }
  return largest;
}

TEST(FeatureTies, ABallExactlyAboveACornerIsAtAKink) {
  for (const char* support : {kBox, kWedge}) {
    const Scene scene = OnTop(kBall, 1.0, 1.5, support);
    // g h / R sideways for a ball that rolls over the corner, nothing on the face.
    EXPECT_GT(OneSidedDifference(scene), 0.05);
    EXPECT_EQ(MarginOf(scene), 0.0);
    const Certificate c = CertificateOf(scene);
    EXPECT_EQ(c.verdict.find("near a kink: "), 0U) << c.verdict;
    EXPECT_NE(c.verdict.find("contact of top and support, where another corner or edge takes over"),
              std::string::npos)
        << c.verdict;
  }
}

// By events a ball strikes a box at the height of its corner: below it rebounds from the face,
// above from the corner, whose normal turns with the ball's height y: vy = (1 + e) v y / R.
TEST(FeatureTies, ABallThatStrikesLevelWithACornerIsAtAKink) {
  for (const double dt : {0.05, 0.007}) {
    for (const double y : {0.0, 1e-3, -1e-3}) {
      Scene scene = test_scenes::SceneOf(R"({"gravity": [0, 0], "bodies": [
          {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "velocity": [2, 0],
           "position": [-1, 0], "restitution": 0.5},
          {"name": "box", "static": true, "shape": {"box": {"size": [1, 1]}},
           "position": [0.5, -0.5], "restitution": 0.5}],
          "simulation": {"stepping": "event", "dt": 0.05, "duration": 0.7}})");
      scene.simulation.dt = dt;
      scene.bodies[0].position.y() = y;
      const GradientResult found =
          testing::Jacobian(scene, {"bodies/ball/position/y"}, GradientMethod::kTangent);
      ASSERT_TRUE(found.done) << found.message;
      const std::string& verdict = found.certificate.verdict;
      if (y == 0.0) {
        EXPECT_EQ(verdict.find("near a kink: "), 0U) << verdict;
        EXPECT_NE(verdict.find("contact of ball and box, where another corner or edge takes over"),
                  std::string::npos)
            << verdict;
        continue;
      }
      EXPECT_EQ(verdict, "trustworthy") << y;
      const double vy = found.jacobian(4, 0);
      EXPECT_NEAR(vy, y > 0.0 ? 1.5 * 2.0 / 0.1 : 0.0, y > 0.0 ? 0.01 : 1e-12) << y;
    }
  }
}

TEST(FeatureTies, TheMarginIsTheDistance) {
  for (const double off : {1e-9, 3e-8, -3e-8}) {
    // In units of the radius 0.5.
    EXPECT_NEAR(MarginOf(OnTop(kBall, 1.0 + off, 1.5, kBox)), std::abs(off) / 0.5, 3e-10) << off;
  }
  for (const double off : {1e-6, -1e-6, 1e-3, -1e-3}) {
    EXPECT_EQ(MarginOf(OnTop(kBall, 1.0 + off, 1.5, kBox)), HUGE_VAL) << off;
  }
}

TEST(FeatureTies, ACornerOnACornerIsAtAKink) {
  // Corner over corner: the boxes share no more than a point.
  EXPECT_LT(MarginOf(OnTop(kBox, 2.0, 2.0, kBox)), kFeatureMargin);
  // Two tips.
  Scene tips = OnTop(kWedge, 0.0, 2.0 * std::sqrt(2.0), kWedge);
  tips.bodies[0].angle = tips.bodies[1].angle = std::atan(1.0);
  EXPECT_LT(MarginOf(tips), kFeatureMargin);
}

// A box that hangs over: it turns about the end of the common face, the left one's end of two.
TEST(FeatureTies, APivotThatChangesCounts) {
  // Pressed on one end only, and the ends of both boxes coincide there.
  Scene scene = OnTop(kBox, 0.0, 2.0, kBox, R"(, "angular_velocity": -3)");
  EXPECT_GT(OneSidedDifference(scene), 0.05);
  EXPECT_LT(MarginOf(scene), kFeatureMargin);
}

TEST(FeatureTies, OrdinaryScenesAreTrustworthy) {
  const Scene scenes[] = {
      OnTop(kBox, 0.3, 1.0, kFloor), OnTop(kWedge, 0.3, 1.0, kFloor),
      OnTop(kBall, 0.3, 0.5, kFloor),
      OnTop(R"({"capsule": {"length": 1, "radius": 0.2}})", 0.0, 0.2, kFloor),
      OnTop(kBall, 0.0, 1.5, kBox), OnTop(kBall, 0.3, 1.5, kWedge), OnTop(kBox, 0.25, 2.0, kBox),
      OnTop(kBox, 0.0, 2.0, kBox),  // equal boxes at rest: a tie that nothing feels
      OnTop(R"({"capsule": {"length": 1, "radius": 0.2}})", 0.0, 1.2, kBox),
      OnTop(kBall, 0.0, 1.0, kBall),
      // Over a corner's wedge, well inside.
      OnTop(kBall, 1.0 + 0.3, 1.0 + 0.4, kBox)};
  for (const Scene& scene : scenes) {
    EXPECT_EQ(MarginOf(scene), HUGE_VAL) << CertificateOf(scene).verdict;
    EXPECT_EQ(CertificateOf(scene).verdict, "trustworthy");
  }
  EXPECT_LT(OneSidedDifference(scenes[7]), 1e-6);
}

}  // namespace
}  // namespace tangible
