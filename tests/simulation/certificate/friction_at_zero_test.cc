// SPDX-License-Identifier: Apache-2.0
//
// Friction that is 0, of every kind there is: below it there is no law, so that a derivative with
// respect to it has one side, which the certificate of every method says. And the restitution of a
// limit that is 0, above which there is another law.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/scene/set_parameters.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using test_scenes::Text;

constexpr double kStep = 0.01;
constexpr int kSteps = 20;
constexpr double kTime = kStep * kSteps;

// A body "b" whose friction is 0, and what its speed loses of a unit of the friction in a second.
struct Frictionless {
  std::string what;
  std::string gravity = "0, 0";
  std::string body, more;  // keys of the body, and of the scene
  std::string path;
  int row = 0;  // of the final state: x, y, angle
  double loss = 0.0;
};

std::vector<Frictionless> All(const std::string& speed) {
  const std::string box = R"("shape": {"box": {"size": [0.2, 0.1]}}, "position": [0, 0.05],
      "velocity": [)" + speed +
                          ", 0]";
  const auto floor = [](const std::string& friction, const std::string& keys) {
    return R"(, {"name": "floor", "static": true, "friction": )" + friction + keys +
           R"(, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})";
  };
  const std::string hinge = R"("joints": [{"name": "j", "type": "revolute",
      "bodies": ["b", "world"], "anchor": [0, 0], )";
  const std::string wheel = R"("inertia": 0.5, "position": [0, 0], "angular_velocity": )" + speed;
  const std::string slides = R"("inertia": 1, "position": [0, 0], "velocity": [)" + speed + ", 0]";
  const std::string spin = Text(-10.0 * std::stod(speed));
  return {
      {"contact", "0, -10", box + "}" + floor("0", ""), "", "bodies/*/friction", 0, 10.0},
      {"pair", "0, -10", box + "}" + floor("0.5", ""),
       R"("pairs": [{"bodies": ["b", "floor"], "friction": 0}])", "pairs/b:floor/friction", 0,
       10.0},
      {"rolling", "0, -10",
       R"("shape": {"circle": {"radius": 0.1}}, "friction": 0.5, "rolling_friction": 0,
          "position": [0, 0.1], "velocity": [)" +
           speed + R"(, 0], "angular_velocity": )" + spin + "}" +
           floor("0.5", R"(, "rolling_friction": 0)"),
       "", "bodies/*/rolling_friction", 0, 10.0 / 0.15},
      {"hinge", "0, 0", wheel + "}", hinge + R"("friction": 0}])", "joints/j/friction", 2, 2.0},
      {"slider", "0, -10", slides + "}", R"("joints": [{"name": "j", "type": "prismatic",
          "bodies": ["b", "world"], "anchor": [0, 0], "axis": [1, 0], "friction": 0}])",
       "joints/j/friction", 0, 0.5},
      {"motor", "0, 0", wheel + "}", hinge + R"("motor": {"speed": 0, "limit": 0}}])",
       "joints/j/motor/limit", 2, 2.0},
      {"support", "0, 0", slides + R"(, "support": {"friction": 0}})", "",
       "bodies/b/support/friction", 0, 9.81},
      {"support with points", "0, 0",
       slides + R"(, "support": {"friction": 0, "points": [[0.1, 0], [-0.1, 0.1]],
                                 "shares": [1, 2]}})",
       "", "bodies/b/support/friction", 0, 9.81},
      {"support of a disc", "0, 0",
       slides + R"(, "support": {"friction": 0, "load": 5, "radius": 0.2}})", "",
       "bodies/b/support/friction", 0, 2.5},
  };
}

Scene Of(const Frictionless& one, const std::string& stepping) {
  return SceneOf(R"({"gravity": [)" + one.gravity + R"(], "bodies": [{"name": "b", "mass": 2, )" +
                 one.body + "], " + one.more + (one.more.empty() ? "" : ", ") +
                 R"("simulation": {"stepping": ")" + stepping + R"(", "dt": )" + Text(kStep) +
                 R"(, "duration": )" + Text(kTime) + "}}");
}

std::vector<GradientMethod> Methods() {
  std::vector<GradientMethod> methods = {GradientMethod::kAdjoint, GradientMethod::kTangent,
                                         GradientMethod::kFiniteDifference};
  if (testing::HaveJets()) {
    methods.push_back(GradientMethod::kJetImplicit);
    methods.push_back(GradientMethod::kJet);
  }
  return methods;
}

void ExpectOneSide(const Frictionless& one, const std::string& stepping, double speed) {
  const Scene scene = Of(one, stepping);
  // By fixed steps a step moves with its end's speed.
  const double way =
      stepping == "fixed" ? 0.5 * kStep * (kTime + kStep) * kSteps : 0.5 * kTime * kTime;
  for (const GradientMethod method : Methods()) {
    const std::string what =
        one.what + ", " + stepping + ", " + NameOf(method) + ", speed " + Text(speed);
    const GradientResult result = testing::Jacobian(scene, {one.path}, method);
    ASSERT_TRUE(result.done) << what;
    // At rest its direction is that of nothing, and the derivative one between those of directions.
    // Jets have no rows of a friction that is 0, but for those of supports.
    const bool has_rows = method != GradientMethod::kJet && method != GradientMethod::kJetImplicit;
    if (speed > 0.0 && (has_rows || one.path.find("support") != std::string::npos)) {
      EXPECT_NEAR(result.jacobian(one.row, 0), -one.loss * way,
                  (method == GradientMethod::kFiniteDifference ? 1e-5 : 1e-9) * one.loss)
          << what;
    }
    EXPECT_EQ(result.certificate.verdict.rfind("one-sided: friction is 0, ", 0), 0u)
        << what << ": " << result.certificate.verdict;
  }
}

TEST(FrictionAtZeroTest, EveryKindHasOneSide) {
  for (const double speed : {1.5, 0.0}) {
    for (const Frictionless& one : All(Text(speed))) {
      for (const std::string stepping : {"fixed", "event"}) ExpectOneSide(one, stepping, speed);
    }
  }
}

// Above the derivative is the same; below there is none.
TEST(FrictionAtZeroTest, TheSideThatThereIs) {
  for (const Frictionless& one : All("1.5")) {
    for (const std::string stepping : {"fixed", "event"}) {
      const Scene scene = Of(one, stepping);
      const auto parameters = testing::Resolve(scene, {one.path});
      const GradientResult both = testing::Jacobian(scene, {one.path}, GradientMethod::kTangent);
      const GradientResult plus = FinalStateJacobian(
          scene, parameters, {.method = GradientMethod::kTangent, .side = DerivativeSide::kPlus});
      ASSERT_TRUE(plus.done) << one.what << ", " << stepping << ": " << plus.message;
      EXPECT_NEAR(plus.jacobian(one.row, 0), both.jacobian(one.row, 0), 1e-9 * one.loss)
          << one.what << ", " << stepping;
      const GradientResult minus = FinalStateJacobian(
          scene, parameters, {.method = GradientMethod::kTangent, .side = DerivativeSide::kMinus});
      EXPECT_FALSE(minus.done) << one.what << ", " << stepping;
      EXPECT_NE(minus.message.find("no derivative from below"), std::string::npos)
          << one.what << ", " << stepping << ": " << minus.message;
    }
  }
}

// Other parameters have two sides, and so has friction that is not 0.
TEST(FrictionAtZeroTest, WhatIsNotFriction) {
  for (const Frictionless& one : All("1.5")) {
    for (const std::string stepping : {"fixed", "event"}) {
      Scene scene = Of(one, stepping);
      EXPECT_EQ(
          testing::Jacobian(scene, {"bodies/b/mass"}, GradientMethod::kTangent).certificate.verdict,
          "trustworthy")
          << one.what << ", " << stepping;
      const double little = 0.01;
      ASSERT_EQ(SetParameters(testing::Resolve(scene, {one.path}), &little, &scene), "");
      EXPECT_EQ(testing::Jacobian(scene, {one.path}, GradientMethod::kTangent).certificate.verdict,
                "trustworthy")
          << one.what << ", " << stepping;
    }
  }
}

// Above it the limit has another law, as a contact has: two masses on a rope that goes taut.
TEST(FrictionAtZeroTest, ARestitutionOfALimitThatIsZeroJumps) {
  const auto rope = [](double restitution) {
    return SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "r", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [-1, 0]},
        {"name": "q", "mass": 2, "inertia": 1, "position": [0.5, 0]}],
      "joints": [{"name": "j", "type": "distance", "bodies": ["r", "q"],
                  "anchors": [[0, 0], [0.5, 0]], "limits": [0, 1], "limit_restitution": )" +
                   Text(restitution) + R"(}], "simulation": {"dt": 0.007, "duration": 1}})");
  };
  const std::vector<std::string> path = {"joints/j/limit_restitution"};
  const Certificate at_zero =
      testing::Jacobian(rope(0.0), path, GradientMethod::kAdjoint).certificate;
  EXPECT_NE(at_zero.verdict.find("its restitution is 0, above which"), std::string::npos)
      << at_zero.verdict;
  const GradientResult above = testing::Jacobian(rope(0.5), path, GradientMethod::kAdjoint);
  EXPECT_EQ(above.certificate.verdict, "of the discrete map: trustworthy");
  EXPECT_NEAR(above.jacobian(3, 0), 2.0 / 3.0, 1e-9);
}

}  // namespace
}  // namespace tangible
