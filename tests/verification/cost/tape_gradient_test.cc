// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/tape_gradient.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/scene/scene_json.h"
#include "tangible/verification/cost/cost_scene.h"

namespace tangible::cost {
namespace {

// A box that slides with friction and a spring, a bouncing disc, a rod on a pin with a damper and a
// limit, a push in a time window.
constexpr char kMixture[] = R"({"bodies": [
    {"name": "floor", "static": true, "friction": 0.3, "restitution": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
    {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
     "velocity": [1.5, 0], "friction": 0.4},
    {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [1.5, 0.14],
     "velocity": [0.5, -1], "friction": 0.3, "restitution": 0.5},
    {"name": "rod", "shape": {"capsule": {"length": 0.5, "radius": 0.05}}, "mass": 0.5,
     "position": [-1.25, 1]}],
  "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [-1.5, 1],
              "damping": 0.01, "limits": [-0.9, 2], "effort": 0.05}],
  "springs": [{"name": "s", "bodies": ["box", "world"], "anchors": [[0, 0.1], [0.8, 0.5]],
               "stiffness": 5, "damping": 0.1, "rest_length": 0.5}],
  "forces": [{"name": "push", "body": "box", "force": [1, 0.2], "start": 0.013, "end": 0.087}],
  "simulation": {"dt": 0.01, "duration": 0.2}})";

class TapeGradientTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!TapeIsBuilt()) GTEST_SKIP() << "built without ADOL-C";
    std::string error;
    ASSERT_TRUE(ParseScene(kMixture, "mixture.json", ".", &scene_, &error)) << error;
    for (const char* path :
         {"bodies/box/mass", "bodies/box/friction", "bodies/*/friction", "bodies/disc/restitution",
          "bodies/disc/shape/radius", "bodies/rod/position/x", "joints/pin/damping",
          "joints/pin/anchor/x", "springs/s/stiffness", "forces/push/force/x", "forces/push/end",
          "gravity/y"}) {
      ASSERT_TRUE(ResolveParameter(scene_, path, &parameters_.emplace_back(), &error)) << error;
    }
  }
  Scene scene_;
  std::vector<ParameterPath> parameters_;
};

TEST_F(TapeGradientTest, IsTheAdjoints) {
  for (const char* output : {"box/x", "disc/vx", "disc/y", "rod/angle"}) {
    const std::vector<LossTerm> terms = {{output, 0.3, 2.0}, {"box/omega", 0.0, 0.5}};
    GradientOptions options;
    options.certificate = CertificatePass::kSkip;
    const GradientResult adjoint = LossGradient(scene_, parameters_, terms, options);
    ASSERT_TRUE(adjoint.done) << adjoint.message;
    const GradientResult tape = TapeLossGradient(scene_, parameters_, terms, 2);
    ASSERT_TRUE(tape.done) << tape.message;
    EXPECT_EQ(tape.all_seconds.size(), 2U);
    EXPECT_NEAR(tape.loss, adjoint.loss, 1e-12 * (1.0 + adjoint.loss)) << output;
    ASSERT_EQ(tape.gradient.size(), adjoint.gradient.size());
    const double size = adjoint.gradient.cwiseAbs().maxCoeff();
    EXPECT_GT(size, 1e-3) << output;
    // 1e-7: the unrolled interior point's own accuracy.
    EXPECT_LT((tape.gradient - adjoint.gradient).cwiseAbs().maxCoeff(), 1e-7 * size) << output;
  }
}

TEST_F(TapeGradientTest, RefusesWhatItCannotRecord) {
  scene_.simulation.joint_correction = JointCorrection::kProjection;
  EXPECT_FALSE(TapeLossGradient(scene_, parameters_, {{"box/x", 0.0, 1.0}}, 1).done);
  scene_.simulation.joint_correction = JointCorrection::kNone;
  const GradientResult unknown = TapeLossGradient(scene_, parameters_, {{"bo/x", 0.0, 1.0}}, 1);
  EXPECT_FALSE(unknown.done);
  EXPECT_NE(unknown.message, "");
}

TEST(TapeGradientAbsentTest, SaysSo) {
  if (TapeIsBuilt()) GTEST_SKIP() << "built with ADOL-C";
  const GradientResult result = TapeLossGradient(ChainAndBall(1), {}, {{"ball/x", 0.0, 1.0}}, 1);
  EXPECT_FALSE(result.done);
  EXPECT_EQ(result.message, "built without ADOL-C");
}

}  // namespace
}  // namespace tangible::cost
