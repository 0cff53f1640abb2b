// SPDX-License-Identifier: Apache-2.0
//
// Jacobians by Jets: passes of the Jets' width, and builds without Jets.
#include <gtest/gtest.h>

#include <tuple>

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

// A box that stops exactly as a step ends: there the unrolled interior point has half of the digits
// of its values, and the step's implicit derivative takes its place.
TEST(GradientJets, UnrolledStepsAtAKinkGoOn) {
  if (WidestJet() == 0) {
    GTEST_SKIP() << "built without Jets";
  }
  for (const auto& [v, mu, dt] :
       {std::tuple{3.0, 0.3, 0.25}, std::tuple{2.0, 0.2, 0.25}, std::tuple{3.0, 0.3, 0.5}}) {
    const Scene scene = test_scenes::SceneOf(
        R"({"gravity": [0, -10], "bodies": [
        {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
        {"name": "b", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 0.1],
         "velocity": [)" +
        std::to_string(v) + R"(, 0]}], "pairs": [{"bodies": ["b", "floor"], "friction": )" +
        std::to_string(mu) + R"(}], "simulation": {"duration": 1.5, "dt": )" + std::to_string(dt) +
        "}}");
    const GradientResult jets = JacobianOf(scene, {"bodies/b/velocity/x"}, GradientMethod::kJet);
    ASSERT_TRUE(jets.done) << jets.message;
    EXPECT_GT(jets.fallbacks, 0);
    const GradientResult tangent =
        JacobianOf(scene, {"bodies/b/velocity/x"}, GradientMethod::kTangent);
    EXPECT_NEAR(jets.jacobian(0, 0), tangent.jacobian(0, 0), 1e-4);
    EXPECT_EQ(jets.values, tangent.values);
  }
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
