// SPDX-License-Identifier: Apache-2.0
//
// Jacobians by Jets: passes of the Jets' width, and builds without Jets.
#include <gtest/gtest.h>

#include "../../support/gradients.h"
#include "../../support/scenes.h"

namespace tangible {
namespace {

using testing::WidestJet;

// Two more than a pass takes, whatever the widths: parameters of the balls in a row.
Scene Balls(int count) {
  std::string bodies;
  for (int i = 0; i < count; ++i) {
    const std::string n = std::to_string(i);
    bodies.append(i > 0 ? ", " : "").append(R"({"name": "b)").append(n);
    bodies.append(R"(", "mass": 1, "inertia": 1, "linear_damping": 0.5, "position": [)").append(n);
    bodies.append(R"(, 0], "velocity": [)").append(n).append(", 1]}");
  }
  return test_scenes::SceneOf(R"({"bodies": [)" + bodies +
                              R"(], "simulation": {"dt": 0.01, "duration": 0.2}})");
}

GradientResult JacobianOf(const Scene& scene, const std::vector<std::string>& paths,
                          GradientMethod method) {
  return testing::JacobianOf(scene, paths, method, CertificatePass::kSkip);
}

TEST(GradientJets, MoreParametersThanAPassTakes) {
  if (WidestJet() == 0) {
    GTEST_SKIP() << "built without Jets";
  }
  const int count = WidestJet() + 2;
  const Scene scene = Balls(count);
  std::vector<std::string> paths;
  paths.reserve(count);
  for (int i = 0; i < count; ++i) {
    paths.push_back("bodies/b" + std::to_string(i) + "/mass");
  }
  for (const GradientMethod method : {GradientMethod::kJet, GradientMethod::kJetImplicit}) {
    const GradientResult all = JacobianOf(scene, paths, method);
    ASSERT_TRUE(all.done) << all.message;
    EXPECT_EQ(all.fallbacks, 0);
    ASSERT_EQ(all.jacobian.cols(), count);
    for (int i = 0; i < count; ++i) {
      const GradientResult one = JacobianOf(scene, {paths[i]}, method);
      EXPECT_EQ(all.jacobian.col(i), one.jacobian.col(0)) << i;
      EXPECT_EQ(all.values, one.values);
      // A ball's mass moves that ball alone: rows of six a body.
      EXPECT_GT(all.jacobian.col(i).segment(6 * i, 6).norm(), 1e-3);
      EXPECT_NEAR(all.jacobian.col(i).norm(), all.jacobian.col(i).segment(6 * i, 6).norm(), 1e-15);
    }
  }
}

TEST(GradientJets, ValuesAreThoseOfTheRunInDouble) {
  if (WidestJet() == 0) {
    GTEST_SKIP() << "built without Jets";
  }
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  const GradientResult tangent = JacobianOf(scene, {"bodies/ball/mass"}, GradientMethod::kTangent);
  const GradientResult implicit =
      JacobianOf(scene, {"bodies/ball/mass"}, GradientMethod::kJetImplicit);
  ASSERT_TRUE(tangent.done && implicit.done) << tangent.message << implicit.message;
  EXPECT_EQ(tangent.values, implicit.values);
}

TEST(GradientJets, WithoutAWidthTheMessageSaysSo) {
  if (WidestJet() > 0) {
    GTEST_SKIP() << "built with Jets";
  }
  const GradientResult result = JacobianOf(Balls(1), {"bodies/b0/mass"}, GradientMethod::kJet);
  EXPECT_FALSE(result.done);
  EXPECT_NE(result.message.find("no width of Jets was built"), std::string::npos);
}

}  // namespace
}  // namespace tangible
