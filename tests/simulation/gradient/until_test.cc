// SPDX-License-Identifier: Apache-2.0
//
// Joints that end at a time: motions and derivatives against closed forms, by every method.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/scene/json_reader.h"
#include "tangible/simulation/gradient/gradient.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

std::string Settings(const char* stepping, const char* dt) {
  return std::string(R"(, "simulation": {"duration": 1.5, "dt": )") + dt + R"(, "stepping": ")" +
         stepping + "\"}}";
}

// A mass goes round at the radius R with the rate w until T, and flies on along the tangent:
//   x = R (cos w T − w (t − T) sin w T),   ∂x/∂T = −(t − T) w² R cos w T,   and y with sin, cos.
void ExpectThrown(const std::string& body, const std::string& joint, double until) {
  const double radius = 0.8, w = 2.0, left = 1.5 - until;
  const double c = std::cos(w * until), s = std::sin(w * until);
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [)" + body + R"(], "joints": [)" +
                              joint + std::to_string(until) + "}]" + Settings("event", "0.005"));
  const std::vector<std::string> paths = {"joints/sling/until"};
  const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  EXPECT_NEAR(result.values[0], radius * (c - w * left * s), 1e-9);
  EXPECT_NEAR(result.values[1], radius * (s + w * left * c), 1e-9);
  EXPECT_NEAR(result.values[3], -radius * w * s, 1e-9);
  EXPECT_NEAR(result.jacobian(0, 0), -left * w * w * radius * c, 1e-7);
  EXPECT_NEAR(result.jacobian(1, 0), -left * w * w * radius * s, 1e-7);
  EXPECT_NEAR(result.jacobian(3, 0), -w * w * radius * c, 1e-7);
  testing::ExpectOthersAgree(scene, paths, result);
}

constexpr char kStone[] =
    R"({"name": "stone", "mass": 2, "inertia": 0.1, "position": [0.8, 0], "velocity": [0, 1.6]})";

TEST(UntilTest, ASlingLetsGo) {
  const std::string rope = R"({"name": "sling", "type": "distance", "bodies": ["stone", "world"],
      "anchors": [[0.8, 0], [0, 0]], "until": )";
  for (const double until : {0.61347, 0.6, 0.005}) ExpectThrown(kStone, rope, until);
  // By a rope, which is a limit, and by an arm.
  ExpectThrown(kStone,
               R"({"name": "sling", "type": "distance", "bodies": ["stone", "world"],
                   "anchors": [[0.8, 0], [0, 0]], "limits": [0, 0.8], "until": )",
               0.61347);
  ExpectThrown(R"({"name": "stone", "mass": 2, "inertia": 0.1, "position": [0.8, 0]})",
               R"({"name": "sling", "type": "revolute", "bodies": ["stone", "world"],
                   "anchor": [0, 0], "rate": 2, "until": )",
               0.61347);
}

// What acts along the coordinate ends with the joint: I ω = ∫ τ from 0 to T.
TEST(UntilTest, WhatDrivesAJointEndsWithIt) {
  const std::string wheel = R"({"gravity": [0, 0], "bodies": [
      {"name": "wheel", "mass": 2, "inertia": 0.5, "position": [0, 0]}],
    "joints": [{"name": "hub", "type": "revolute", "bodies": ["wheel", "world"], "anchor": [0, 0],
      "until": 0.9137, )";
  for (const char* drive : {R"("effort": 0.7)", R"("motor": {"speed": 100, "limit": 0.7})",
                            R"("effort": {"target": 100, "stiffness": 1e3, "limit": 0.7})"}) {
    const Scene scene = SceneOf(wheel + drive + "}]" + Settings("event", "0.05"));
    const std::vector<std::string> paths = {"joints/hub/until", "bodies/wheel/inertia"};
    const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
    const double rate = 0.7 / 0.5;
    EXPECT_NEAR(result.values[5], rate * 0.9137, 1e-12) << drive;
    EXPECT_NEAR(result.values[2], rate * 0.9137 * (1.5 - 0.5 * 0.9137), 1e-12) << drive;
    EXPECT_NEAR(result.jacobian(5, 0), rate, 1e-10) << drive;
    EXPECT_NEAR(result.jacobian(2, 0), rate * (1.5 - 0.9137), 1e-10) << drive;
    EXPECT_NEAR(result.jacobian(5, 1), -rate * 0.9137 / 0.5, 1e-10) << drive;
    EXPECT_EQ(result.certificate.verdict, "trustworthy") << drive;
    testing::ExpectOthersAgree(scene, paths, result);
  }
}

// A weight hangs on a joint of each type and falls from T on.
TEST(UntilTest, JointsOfAllTypesEnd) {
  for (const char* joint :
       {R"("type": "weld", "anchor": [0, 0])", R"("type": "revolute", "anchor": [0, 0])",
        R"("type": "prismatic", "anchor": [0, 0], "axis": [1, 0])",
        R"("type": "distance", "anchors": [[0, 0], [0, 1]])",
        R"("type": "distance", "anchors": [[0, 0], [0, 1]], "limits": [0, 1])"}) {
    const Scene scene = SceneOf(R"({"gravity": [0, -10], "bodies": [
            {"name": "weight", "mass": 2, "inertia": 0.5, "position": [0, 0]}],
          "joints": [{"name": "hook", "bodies": ["weight", "world"], "until": 0.7, )" +
                                std::string(joint) + "}]" + Settings("event", "0.01"));
    const std::vector<std::string> paths = {"joints/hook/until", "gravity/y"};
    const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kTangent);
    EXPECT_NEAR(result.values[1], -5.0 * 0.8 * 0.8, 1e-9) << joint;
    EXPECT_NEAR(result.values[4], -8.0, 1e-9) << joint;
    EXPECT_NEAR(result.jacobian(1, 0), 8.0, 1e-8) << joint;
    EXPECT_NEAR(result.jacobian(4, 0), 10.0, 1e-8) << joint;
    EXPECT_NEAR(result.jacobian(4, 1), 0.8, 1e-8) << joint;
  }
}

// A coupling ends at its own time, and with a joint that it couples.
TEST(UntilTest, ACouplingEndsWithItsJoints) {
  for (const char* which : {"rope", "l"}) {
    Json json = Json::parse(R"({"gravity": [0, -10], "bodies": [
        {"name": "left", "mass": 3, "inertia": 0.1, "position": [0, 0]},
        {"name": "right", "mass": 1, "inertia": 0.1, "position": [1, 0]}],
      "joints": [
        {"name": "l", "type": "distance", "bodies": ["left", "world"], "anchors": [[0, 0], [0, 9]],
         "limits": [0, null]},
        {"name": "r", "type": "distance", "bodies": ["right", "world"],
         "anchors": [[1, 0], [1, 9]], "limits": [0, null]},
        {"name": "rope", "type": "coupling", "joints": ["l", "r"], "ratio": 1}],
      "simulation": {"duration": 1.5, "dt": 0.01, "stepping": "event"}})");
    for (Json& joint : json["joints"]) {
      if (joint["name"] == which) joint["until"] = 0.5137;
    }
    const Scene scene = SceneOf(json.dump());
    const std::vector<std::string> paths = {std::string("joints/") + which + "/until"};
    const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.values[4], -5.0 * 0.5137 - 10.0 * (1.5 - 0.5137), 1e-9) << which;
    EXPECT_NEAR(result.values[10], 5.0 * 0.5137 - 10.0 * (1.5 - 0.5137), 1e-9) << which;
    EXPECT_NEAR(result.jacobian(4, 0), 5.0, 1e-8) << which;
    EXPECT_NEAR(result.jacobian(10, 0), 15.0, 1e-8) << which;
    testing::ExpectOthersAgree(scene, paths, result);
  }
}

// By fixed steps a joint is there in each step that begins before T.
TEST(UntilTest, FixedStepsBeginWithOrWithoutAJoint) {
  const auto scene_of = [](double until) {
    return SceneOf(R"({"gravity": [0, -10], "bodies": [
        {"name": "weight", "mass": 2, "inertia": 0.5, "position": [0, 0]}],
      "joints": [{"name": "hook", "type": "weld", "bodies": ["weight", "world"], "anchor": [0, 0],
        "until": )" +
                   std::to_string(until) + "}]" + Settings("fixed", "0.01"));
  };
  const std::vector<std::string> paths = {"joints/hook/until", "gravity/y"};
  for (const double until : {0.7, 0.6905, 0.6999}) {
    const Scene scene = scene_of(until);
    const GradientResult result = testing::Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.values[4], -8.0, 1e-12) << until;  // the first step without it begins at 0.7
    EXPECT_EQ(result.jacobian(4, 0), 0.0);
    EXPECT_NEAR(result.jacobian(4, 1), 0.8, 1e-12);
    EXPECT_TRUE(result.certificate.verdict.starts_with("of the discrete map: "))
        << result.certificate.verdict;
    EXPECT_EQ(result.certificate.verdict.find("discontinuous") != std::string::npos, until == 0.7);
    if (until != 0.7) testing::ExpectOthersAgree(scene, paths, result);
  }
  EXPECT_NEAR(testing::Jacobian(scene_of(0.7001), paths, GradientMethod::kTangent).values[4], -7.9,
              1e-12);
  // With a time that is no parameter the derivative is that of the motion to first order.
  EXPECT_EQ(
      testing::Jacobian(scene_of(0.7), {"gravity/y"}, GradientMethod::kTangent).certificate.verdict,
      "trustworthy");
}

// A slider under −1 N until T, where the force on it steps from 1 N to 3 N: v(1.5) = −T + 2 from
// both sides, and the end's derivative must not take the step along. As the joint's own effort
// steps there, each side has the effort of its side.
TEST(UntilTest, AnEndWhereASignalStepsIsNamed) {
  const auto scene_with = [](const char* joint, const char* force, double dt) {
    Scene scene = SceneOf(std::string(R"({"gravity": [0, 0], "bodies": [
        {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0]}],
        "joints": [{"name": "j", "type": "prismatic", "bodies": ["b", "world"], "anchor": [0, 0],
                    "axis": [1, 0], "until": 0.5)") +
                          joint + R"(}], "forces": [{"name": "f", "body": "b", "force": )" + force +
                          "}]" + Settings("event", "0.1"));
    scene.simulation.dt = dt;
    return scene;
  };
  const auto side = [](const Scene& scene, DerivativeSide of) {
    return FinalStateJacobian(scene, testing::Resolve(scene, {"joints/j/until"}), {.side = of});
  };
  for (const double dt : {0.1, 0.25, 0.03}) {
    Scene scene = scene_with(R"(, "effort": -1)", "[0, 0]", dt);
    Signal steps;
    steps.time = {0.0, 0.5, 1.0};
    steps.x = {1.0, 3.0, 0.0};
    steps.y = {0.0, 0.0, 0.0};
    scene.forces[0].force_signal = steps;
    const GradientResult plus = side(scene, DerivativeSide::kPlus);
    EXPECT_NEAR(plus.jacobian(3, 0), -1.0, 1e-8) << dt;
    EXPECT_NEAR(side(scene, DerivativeSide::kMinus).jacobian(3, 0), -1.0, 1e-8) << dt;
    EXPECT_EQ(plus.certificate.one_sided,
              "end of joint j at 0.5 s is where the signal of force f steps");

    Scene own = scene_with(R"(, "effort": 0)", "[0, 0]", dt);
    Signal effort;
    effort.time = {0.0, 0.5};
    effort.value = {1.0, 3.0};
    own.joints[0].effort_signal = effort;
    EXPECT_NEAR(side(own, DerivativeSide::kPlus).jacobian(3, 0), 3.0, 1e-8) << dt;
    EXPECT_NEAR(side(own, DerivativeSide::kMinus).jacobian(3, 0), 1.0, 1e-8) << dt;
  }
}

// A slider that reaches its limit as its joint ends flies on or comes back, also where rounding
// puts the end before the touch.
TEST(UntilTest, AnEndAtALimitIsAJump) {
  for (const double dt : {0.25, 0.1, 0.05, 0.03}) {
    for (const double later : {0.0, 1e-12, 1e-9}) {
      Scene scene = SceneOf(std::string(R"({"gravity": [0, 0], "bodies": [
          {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [0.5, 0]}],
          "joints": [{"name": "j", "type": "prismatic", "bodies": ["b", "world"],
                      "anchor": [0, 0], "axis": [1, 0], "limits": [-1, 0.5],
                      "limit_restitution": 1, "until": 1}])") +
                            Settings("event", "0.1"));
      scene.simulation.dt = dt;
      scene.joints[0].limits->second += later;
      const GradientResult result =
          FinalStateJacobian(scene, testing::Resolve(scene, {"joints/j/until"}), {});
      EXPECT_NE(result.certificate.verdict.find("discontinuous"), std::string::npos)
          << dt << " " << later << ": " << result.certificate.verdict;
    }
  }
}

}  // namespace
}  // namespace tangible
