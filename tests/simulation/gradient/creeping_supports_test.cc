// SPDX-License-Identifier: Apache-2.0
//
// Linked bodies on a table whose centres creep while others slide: pushed by hardly more or less
// than their friction, which turns such slow velocities at once. Against an integration written
// apart (Radau's method with the friction −μ N v / √(v² + ε²), ε of 1e-8 and 1e-7 m/s).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using test_scenes::Text;

// Links of 0.2 m and 0.5 kg in a row, of which the first one is struck.
Scene StruckChain(const std::vector<double>& friction, const std::array<double, 3>& twist,
                  double dt) {
  std::string bodies, joints;
  for (size_t i = 0; i < friction.size(); ++i) {
    const double x = 0.2 * static_cast<double>(i);
    bodies += std::string(i > 0 ? ", " : "") + R"({"name": "l)" + std::to_string(i) +
              R"(", "shape": {"box": {"size": [0.2, 0.04]}}, "mass": 0.5, "position": [)" +
              Text(x) + R"(, 0], "support": {"load": 4.9, "friction": )" + Text(friction[i]) + "}";
    if (i == 0) {
      bodies += R"(, "velocity": [)" + Text(twist[0]) + ", " + Text(twist[1]) +
                R"(], "angular_velocity": )" + Text(twist[2]);
    } else {
      joints += std::string(i > 1 ? ", " : "") + R"({"name": "j)" + std::to_string(i) +
                R"(", "type": "revolute", "bodies": ["l)" + std::to_string(i - 1) + R"(", "l)" +
                std::to_string(i) + R"("], "anchor": [)" + Text(x - 0.1) + ", 0]}";
    }
    bodies += "}";
  }
  return SceneOf(R"({"gravity": [0, 0], "bodies": [)" + bodies + R"(], "joints": [)" + joints +
                 R"(], "simulation": {"stepping": "event", "dt": )" + Text(dt) +
                 R"(, "duration": 0.4}})");
}

void ExpectAtRest(const Scene& scene, const std::vector<double>& pose) {
  Model<double> model;
  State<double> state, final;
  BuildModel(scene, &model, &state);
  const RolloutReport report = Rollout(model, state, {}, &final);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  for (size_t i = 0; i < pose.size(); ++i) {
    EXPECT_NEAR(final.pose[i], pose[i], 5e-7) << i;
    EXPECT_EQ(final.twist[i], 0.0) << i;
  }
}

TEST(CreepingSupportsTest, TwoLinksComeToRest) {
  for (const double dt : {0.02, 0.01}) {
    ExpectAtRest(StruckChain({0.254, 0.31}, {0.452, 0.093, -0.16}, dt),
                 {0.009613813, 0.004033459, -0.031365548, 0.209562149, 0.000193315, -0.007041091});
    ExpectAtRest(StruckChain({0.312, 0.285}, {0.241, 0.371, 0.07}, dt),
                 {0.004696785, 0.01998262, -0.088812422, 0.203792461, 0.001024445, -0.10105796});
  }
}

TEST(CreepingSupportsTest, ThreeLinksComeToRest) {
  ExpectAtRest(StruckChain({0.315, 0.264, 0.326}, {-0.277, 0.178, -0.42}, 0.02),
               {-0.001741243, 0.005047014, -0.046777332, 0.19814936, 0.00032463, -0.000463559,
                0.398148724, -0.000075358, -0.003536335});
}

// Two links on points, of which the first one is pinned, and a force that grows until they move:
// the points of the second one start in directions of their own. Beside short fixed steps, whose
// error is of first order.
TEST(CreepingSupportsTest, AGrowingForceMovesLinksOnPoints) {
  const auto scene = [](const std::string& stepping, double dt) {
    return SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "l0", "shape": {"box": {"size": [0.2, 0.04]}}, "mass": 0.86,
         "position": [0.09950041652780256, 0.009983341664682817], "angle": 0.1,
         "support": {"friction": 0.153, "load": 3.26, "points": [[-0.1, 0], [0.1, 0]]}},
        {"name": "l1", "shape": {"box": {"size": [0.2, 0.04]}}, "mass": 0.82,
         "position": [0.22025343056548452, 0.11768222507725275], "angle": 1.3566370614359173,
         "support": {"friction": 0.123, "points": [[-0.08, -0.02], [0.08, -0.02], [0, 0.02]]}}],
      "joints": [
        {"name": "j0", "type": "revolute", "bodies": ["l0", "l1"],
         "anchor": [0.19900083305560512, 0.019966683329365634]},
        {"name": "pin", "type": "revolute", "bodies": ["l0", "world"], "anchor": [0, 0]}],
      "forces": [{"name": "p", "body": "l1", "force": {"time": [0, 0.3], "x": [0, -1.33],
                  "y": [0, 2.03], "interpolation": "linear"}}],
      "no_contact": [["*", "*"]], "simulation": {"stepping": ")" +
                   stepping + R"(", "dt": )" + Text(dt) + R"(, "duration": 0.3}})");
  };
  Model<double> model;
  State<double> initial, final, fine;
  BuildModel(scene("event", 0.02), &model, &initial);
  const RolloutReport report = Rollout(model, initial, {}, &final);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  BuildModel(scene("fixed", 2e-4), &model, &initial);
  ASSERT_EQ(Rollout(model, initial, {}, &fine).status, StepStatus::kDone);
  EXPECT_GT(std::abs(final.pose[5] - initial.pose[5]), 1e-3);
  for (size_t i = 0; i < 6; ++i) EXPECT_NEAR(final.pose[i], fine.pose[i], 5e-5) << i;
}

// Two links on discs in a row; a force on the second one turns it about the hinge, and grows until
// the first one moves too, at 0.29998 s, in a direction that its support tells.
Scene LinksOnDiscs(double friction, double duration) {
  return SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "l0", "shape": {"box": {"size": [0.2, 0.04]}}, "mass": 0.9, "position": [0.1, 0],
       "support": {"radius": 0.05, "friction": )" +
                 Text(friction) + R"(}},
      {"name": "l1", "shape": {"box": {"size": [0.2, 0.04]}}, "mass": 0.68,
       "position": [0.3, 0], "support": {"friction": 0.19, "load": 3.88, "radius": 0.05}}],
    "joints": [{"name": "j0", "type": "revolute", "bodies": ["l0", "l1"], "anchor": [0.2, 0]}],
    "forces": [{"name": "p", "body": "l1", "force": {"time": [0, 0.3, 0.5],
                "x": [0, -2.787697698194375, -2.787697698194375],
                "y": [0, 3.9206849079538104, 3.9206849079538104], "interpolation": "linear"}}],
    "no_contact": [["*", "*"]],
    "simulation": {"stepping": "event", "dt": 0.02, "duration": )" +
                 Text(duration) + "}}");
}

// Corrections of the hinge move the body that turns about it alone.
TEST(CreepingSupportsTest, ALinkThatItsSupportHoldsStaysToTheBit) {
  Model<double> model;
  State<double> initial, final;
  BuildModel(LinksOnDiscs(0.387, 0.28), &model, &initial);
  const RolloutReport report = Rollout(model, initial, {}, &final);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_GT(final.pose[5] - initial.pose[5], 0.2);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(final.pose[i], initial.pose[i]) << i;
    EXPECT_EQ(final.twist[i], 0.0) << i;
  }
}

TEST(CreepingSupportsTest, ADiscThatAForceSlowlyLetsGoHasOneDirection) {
  const std::vector<std::string> paths = {"bodies/l0/support/friction"};
  const GradientResult adjoint =
      testing::Jacobian(LinksOnDiscs(0.387, 0.4), paths, GradientMethod::kAdjoint);
  const auto angle = [](double friction) {
    Model<double> model;
    State<double> initial, final;
    BuildModel(LinksOnDiscs(friction, 0.4), &model, &initial);
    const RolloutReport report = Rollout(model, initial, {}, &final);
    EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
    return final.pose[2];
  };
  for (const double step : {4e-7, 4e-6}) {
    const double difference = (angle(0.387 + step) - angle(0.387 - step)) / (2.0 * step);
    EXPECT_NEAR(adjoint.jacobian(2, 0), difference, 1e-3 * std::abs(difference)) << step;
  }
}

TEST(CreepingSupportsTest, DerivativesAreThoseOfTheMotion) {
  const Scene scene = StruckChain({0.254, 0.31}, {0.452, 0.093, -0.16}, 0.02);
  const std::vector<std::string> paths = {"bodies/l0/velocity/y", "bodies/l0/support/friction",
                                          "bodies/l1/support/friction"};
  const GradientResult adjoint = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
  for (const GradientMethod method :
       {GradientMethod::kTangent, GradientMethod::kFiniteDifference}) {
    const GradientResult other = testing::Jacobian(scene, paths, method, CertificatePass::kSkip);
    const double within = method == GradientMethod::kTangent ? 1e-11 : 2e-5;
    EXPECT_LT((other.jacobian - adjoint.jacobian).cwiseAbs().maxCoeff(),
              within * adjoint.jacobian.cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace tangible
