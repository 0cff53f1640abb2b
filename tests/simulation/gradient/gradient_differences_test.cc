// SPDX-License-Identifier: Apache-2.0
//
// Finite differences: their order, their one-sided form, and what they say about themselves.
#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

GradientResult Differences(const std::string& text, const std::string& path, double step) {
  const Scene scene = test_scenes::SceneOf(text);
  std::vector<ParameterPath> parameters(1);
  std::string error;
  EXPECT_TRUE(ResolveParameter(scene, path, &parameters[0], &error)) << error;
  GradientOptions options;
  options.method = GradientMethod::kFiniteDifference;
  options.step = step;
  options.certificate = CertificatePass::kSkip;
  return FinalStateJacobian(scene, parameters, options);
}

double Tangent(const std::string& text, const std::string& path, int output) {
  const Scene scene = test_scenes::SceneOf(text);
  std::vector<ParameterPath> parameters(1);
  std::string error;
  EXPECT_TRUE(ResolveParameter(scene, path, &parameters[0], &error)) << error;
  GradientOptions options;
  options.method = GradientMethod::kTangent;
  return FinalStateJacobian(scene, parameters, options).jacobian(output, 0);
}

constexpr char kSwing[] = R"({"bodies": [
    {"name": "bob", "mass": 1, "inertia": 0.1, "position": [0, -1]}],
  "joints": [{"name": "pin", "type": "revolute", "bodies": ["bob", "world"], "anchor": [0, 0],
              "angle": 1}],
  "simulation": {"dt": 0.01, "duration": 0.5, "joint_correction": "projection"}})";

TEST(GradientDifferences, AreOfSecondOrderInTheStep) {
  const double exact = Tangent(kSwing, "joints/pin/angle", 0);
  const double coarse = Differences(kSwing, "joints/pin/angle", 0.02).jacobian(0, 0) - exact;
  const double fine = Differences(kSwing, "joints/pin/angle", 0.01).jacobian(0, 0) - exact;
  EXPECT_GT(std::abs(fine), 1e-7);
  EXPECT_NEAR(coarse / fine, 4.0, 0.01);
}

TEST(GradientDifferences, TheDefaultStepBalancesItsErrors) {
  const double exact = Tangent(kSwing, "joints/pin/angle", 0);
  const GradientResult result = Differences(kSwing, "joints/pin/angle", 0.0);
  ASSERT_TRUE(result.done) << result.message;
  EXPECT_NE(result.jacobian(0, 0), exact);
  EXPECT_NEAR(result.jacobian(0, 0), exact, 1e-8 * std::abs(exact));
  EXPECT_TRUE(result.notes.empty());
}

// A ball without friction of its own slides on a floor that has some.
std::string Slide(double friction) {
  return R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.1],
       "velocity": [3, 0], "friction": )" +
         std::to_string(friction) + "}, " + test_scenes::kFloor +
         R"(], "simulation": {"dt": 0.01, "duration": 0.1}})";
}

TEST(GradientDifferences, AreOneSidedAtTheEndOfARange) {
  const GradientResult result = Differences(Slide(0.0), "bodies/ball/friction", 1e-4);
  ASSERT_TRUE(result.done) << result.message;
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_EQ(result.notes[0].rfind("one-sided difference above bodies/ball/friction", 0), 0u)
      << result.notes[0];
  // dx/dμ = −g h² 55 / 2 (the mean of both coefficients): linear, so exact but for rounding.
  EXPECT_NEAR(result.jacobian(0, 0), -0.5 * 9.81 * 1e-4 * 55.0, 1e-10);
  EXPECT_TRUE(Differences(Slide(0.1), "bodies/ball/friction", 1e-4).notes.empty());
}

TEST(GradientDifferences, AStepThatFitsNowhereIsRefused) {
  const GradientResult result = Differences(test_scenes::Mixture(), "bodies/ball/restitution", 0.6);
  EXPECT_FALSE(result.done);
  EXPECT_NE(result.message.find("bodies/ball/restitution: no finite difference fits"),
            std::string::npos)
      << result.message;
}

TEST(GradientDifferences, ContactsThatChangeWithinTheStepAreSaid) {
  // It lands after 0.1 s: 0.01 higher it is still in the air then.
  const std::string text = test_scenes::FallingBall(0.05, R"({"dt": 0.01, "duration": 0.11})");
  const GradientResult wide = Differences(text, "bodies/ball/position/y", 0.02);
  ASSERT_EQ(wide.notes.size(), 1u);
  EXPECT_NE(wide.notes[0].find("contacts or modes change"), std::string::npos) << wide.notes[0];
  EXPECT_TRUE(Differences(text, "bodies/ball/position/y", 1e-6).notes.empty());
}

}  // namespace
}  // namespace tangible
