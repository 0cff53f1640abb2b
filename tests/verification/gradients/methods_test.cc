// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/methods.h"

#include <gtest/gtest.h>

#include "../support/sliding_box.h"

namespace tangible {
namespace {

TEST(MethodsTest, EveryMethodGivesTheClosedForm) {
  const Scene scene = SlidingBox("0.3");
  const std::vector<ParameterPath> parameters = {PathTo(scene, "pairs/box:floor/friction"),
                                                 PathTo(scene, "bodies/box/velocity/x")};
  const MethodJacobians run = RunMethods(scene, parameters);
  ASSERT_TRUE(run.done) << run.message;
  EXPECT_EQ(run.named, std::vector<std::string>(2));
  EXPECT_EQ(run.certificate.verdict, "trustworthy");
  for (int m = 0; m < kByClosedForm; ++m) {
    if (run.jacobian[m].size() == 0) {
      // No width of Jets is built.
      EXPECT_TRUE(m == kByImplicitJets || m == kByUnrolledJets) << m;
      EXPECT_NE(run.missing[m], "");
      continue;
    }
    // v_x = v_0 − μ g t.
    EXPECT_NEAR(run.jacobian[m](3, 0), -9.81 * 0.1, 1e-8) << NameOf(static_cast<Method>(m));
    EXPECT_NEAR(run.jacobian[m](3, 1), 1.0, 1e-8) << NameOf(static_cast<Method>(m));
  }
  EXPECT_EQ(run.jacobian[kByClosedForm].size(), 0);
}

TEST(MethodsTest, TheCertificateNamesTheParameterAtAKink) {
  // The root of the product has no derivative where the box's friction is 0; its speed has nothing
  // to do with it.
  Scene scene = SlidingBox("0.3");
  scene.pairs.clear();
  scene.bodies[0].friction = scene.bodies[1].friction = 0.3;
  scene.bodies[scene.bodies[0].name == "box" ? 0 : 1].friction = 0.0;
  scene.simulation.friction_mixing = Mixing::kGeometricMean;
  const MethodJacobians run = RunMethods(
      scene, {PathTo(scene, "bodies/box/friction"), PathTo(scene, "bodies/box/velocity/x")});
  ASSERT_TRUE(run.done) << run.message;
  EXPECT_NE(run.named[0].find("kink of the mixing rule"), std::string::npos) << run.named[0];
  EXPECT_EQ(run.named[1], "");
}

TEST(MethodsTest, ARunThatFailsHasAMessage) {
  const Scene scene = PressedBox();
  const MethodJacobians run = RunMethods(scene, {PathTo(scene, "bodies/box/mass")});
  EXPECT_FALSE(run.done);
  EXPECT_NE(run.message.find("step "), std::string::npos) << run.message;
}

}  // namespace
}  // namespace tangible
