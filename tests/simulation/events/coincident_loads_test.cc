// SPDX-License-Identifier: Apache-2.0
//
// Events at the instant at which a load on the same body jumps: beside it the event is before the
// jump or behind it, with other derivatives, or other values, on each side, which the certificate
// names. Elsewhere the load does nothing to the event.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/sanitizers.h"
#include "../../support/scenes.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

// Under the sanitizers the larger steps alone, which cost a twentieth.
std::vector<double> Steps() {
  std::vector<double> steps = {0.5, 0.25, 0.1, 0.05, 0.01, 0.03, 0.007};
  if (testing::kSanitized) steps.resize(3);
  return steps;
}

// What one parameter changes of a value of the final state, growing and shrinking.
struct Sides {
  std::string path;
  int row;
  double plus, minus;
};

bool Names(const GradientResult& result, const std::string& what) {
  return result.certificate.verdict.rfind("near a kink", 0) == 0 &&
         result.certificate.verdict.find(what) != std::string::npos;
}

// Both derivatives of a side, and by every method one between them that is named.
void ExpectSides(Scene scene, const std::vector<Sides>& all, const std::string& what) {
  for (const double dt : Steps()) {
    scene.simulation.dt = dt;
    for (const Sides& one : all) {
      const std::string where =
          one.path + ", row " + std::to_string(one.row) + ", dt " + std::to_string(dt);
      for (const GradientMethod method : {GradientMethod::kTangent, GradientMethod::kAdjoint,
                                          GradientMethod::kFiniteDifference}) {
        // The certificate is the same whatever the method.
        const bool first = method == GradientMethod::kTangent;
        const GradientResult both = testing::Jacobian(
            scene, {one.path}, method, first ? CertificatePass::kRun : CertificatePass::kSkip);
        const double found = both.jacobian(one.row, 0);
        EXPECT_TRUE(!first || Names(both, what)) << where << ": " << both.certificate.verdict;
        EXPECT_GE(found, std::min(one.plus, one.minus) - 1e-5) << where;
        EXPECT_LE(found, std::max(one.plus, one.minus) + 1e-5) << where;
      }
      for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
        const GradientResult result =
            FinalStateJacobian(scene, testing::Resolve(scene, {one.path}),
                               {.method = GradientMethod::kTangent, .side = side});
        ASSERT_TRUE(result.done) << where << ": " << result.message;
        EXPECT_NEAR(result.jacobian(one.row, 0),
                    side == DerivativeSide::kPlus ? one.plus : one.minus, 1e-5)
            << where;
      }
    }
  }
}

std::string Block(const std::string& more) {
  return R"({"gravity": [0, -10], "bodies": [
      {"name": "b", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1, "position": [0, 0.05],
       "velocity": [1, 0], "friction": 0.2},
      {"name": "floor", "static": true, "friction": 0.2,
       "shape": {"half_plane": {"normal": [0, 1]}}}], )" +
         more + R"(, "simulation": {"stepping": "event", "duration": 0.75}})";
}

// A block that stops at 0.5 s is pushed from then on with 5 N: at rest before, or still sliding,
// x = v s − a s² / 2 and from there 3 m/s².
const std::vector<Sides>& OfPushedBlock() {
  static const std::vector<Sides> sides = {{"bodies/b/velocity/x", 0, 0.75, 0.5},
                                           {"bodies/b/velocity/x", 3, 1.0, 0.0},
                                           {"bodies/*/friction", 3, -2.5, -7.5},
                                           {"forces/f/start", 3, -3.0, -5.0}};
  return sides;
}

TEST(CoincidentLoadsTest, AForceBeginsAsABlockStops) {
  ExpectSides(SceneOf(Block(R"("forces": [{"name": "f", "body": "b", "force": [5, 0],
                                            "start": 0.5}])")),
              OfPushedBlock(), "as the window of force f jumps");
}

TEST(CoincidentLoadsTest, ASignalJumpsAsABlockStops) {
  std::vector<Sides> sides = OfPushedBlock();
  sides.pop_back();
  ExpectSides(SceneOf(Block(R"("forces": [{"name": "f", "body": "b",
                                 "force": {"time": [0, 0.5], "x": [0, 5]}}])")),
              sides, "as the signal of force f jumps");
}

TEST(CoincidentLoadsTest, AnEffortJumpsAsASliderStops) {
  ExpectSides(SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [1, 0]}],
      "joints": [{"name": "j", "type": "prismatic", "bodies": ["b", "world"], "anchor": [0, 0],
                  "axis": [1, 0], "friction": 2, "effort": {"time": [0, 0.5], "value": [0, 5]}}],
      "simulation": {"stepping": "event", "duration": 0.75}})"),
              {{"bodies/b/velocity/x", 3, 1.0, 0.0}, {"joints/j/friction", 3, -0.25, -0.75}},
              "as the effort of joint j jumps");
}

TEST(CoincidentLoadsTest, AForceBeginsAsASupportHolds) {
  ExpectSides(SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [1, 0],
       "support": {"friction": 0.2, "load": 10}}],
      "forces": [{"name": "f", "body": "b", "force": [5, 0], "start": 0.5}],
      "simulation": {"stepping": "event", "duration": 0.75}})"),
              {{"bodies/b/velocity/x", 3, 1.0, 0.0},
               {"bodies/b/support/friction", 3, -2.5, -7.5},
               {"forces/f/start", 3, -3.0, -5.0}},
              "as the window of force f jumps");
}

// A disc that lands at 0.5 s, and bounces with e = 0.5, is carried from then on with 4 N.
TEST(CoincidentLoadsTest, AForceBeginsAsADiscLands) {
  ExpectSides(SceneOf(R"({"gravity": [0, -10], "bodies": [
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1.35],
       "restitution": 0.5},
      {"name": "floor", "static": true, "restitution": 0.5,
       "shape": {"half_plane": {"normal": [0, 1]}}}],
      "forces": [{"name": "f", "body": "b", "force": [0, 4], "start": 0.5}],
      "simulation": {"stepping": "event", "duration": 0.75}})"),
              {{"bodies/b/position/y", 1, -0.05, 0.25},
               {"bodies/b/position/y", 4, 1.8, 3.0},
               {"forces/f/start", 4, -4.0, 2.0}},
              "as the window of force f jumps");
}

// A disc meets a wall as the joint ends that holds another body to it, which rebounds with it or
// goes on: a jump.
TEST(CoincidentLoadsTest, AJointEndsAsItsBodyMeetsAWall) {
  Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.4, 0],
       "velocity": [1, 0], "restitution": 0.5},
      {"name": "c", "mass": 2, "inertia": 1, "position": [0.2, 0], "velocity": [1, 0]},
      {"name": "wall", "static": true, "restitution": 0.5,
       "shape": {"half_plane": {"normal": [-1, 0], "offset": -1}}}],
      "joints": [{"name": "j", "type": "weld", "bodies": ["b", "c"], "anchor": [0.3, 0],
                  "until": 0.5}],
      "simulation": {"stepping": "event", "duration": 0.75}})");
  for (const double dt : Steps()) {
    scene.simulation.dt = dt;
    const GradientResult result =
        testing::Jacobian(scene, {"bodies/*/velocity/x"}, GradientMethod::kTangent);
    EXPECT_EQ(result.certificate.verdict.rfind("discontinuous", 0), 0u)
        << result.certificate.verdict << ", dt " << dt;
    EXPECT_NEAR(result.values[0], 0.9 - 0.125, 1e-9) << dt;
    EXPECT_TRUE(std::abs(result.values[6] - 0.575) < 1e-9 ||
                std::abs(result.values[6] - 0.95) < 1e-9)
        << result.values[6] << ", dt " << dt;
  }
}

// A push that friction holds, and one on a disc that lands without a rebound, find what rests in
// either order.
TEST(CoincidentLoadsTest, WhatStaysAtRestIsNotNamed) {
  const Scene held =
      SceneOf(Block(R"("forces": [{"name": "f", "body": "b", "force": [1, 0], "start": 0.5}])"));
  const Scene supported = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [1, 0],
       "support": {"friction": 0.2, "load": 10}}],
      "forces": [{"name": "f", "body": "b", "force": [1, 0], "start": 0.5}],
      "simulation": {"stepping": "event", "duration": 0.75}})");
  const Scene landed = SceneOf(R"({"gravity": [0, -10], "bodies": [
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1.35],
       "velocity": [1, 0]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1]}}}],
      "forces": [{"name": "f", "body": "b", "force": [0, 4], "start": 0.5}],
      "simulation": {"stepping": "event", "duration": 0.75}})");
  for (const auto& [of, exact] : {std::pair(held, 0.5), {supported, 0.5}, {landed, 0.75}}) {
    for (const double dt : Steps()) {
      Scene scene = of;
      scene.simulation.dt = dt;
      for (const GradientMethod method : {GradientMethod::kTangent, GradientMethod::kAdjoint,
                                          GradientMethod::kFiniteDifference}) {
        const GradientResult result = testing::Jacobian(scene, {"bodies/b/velocity/x"}, method);
        EXPECT_EQ(result.certificate.verdict, "trustworthy") << exact << ", dt " << dt;
        EXPECT_NEAR(result.jacobian(0, 0), exact, 1e-5) << exact << ", dt " << dt;
      }
    }
  }
}

// The force acts on another body, or half a step later.
TEST(CoincidentLoadsTest, WhatActsElsewhereIsNotNamed) {
  for (const double dt : Steps()) {
    Scene scene = SceneOf(Block(R"("forces": [{"name": "f", "body": "b", "force": [5, 0],
                                               "start": 0.53125}])"));
    scene.simulation.dt = dt;
    const GradientResult later =
        testing::Jacobian(scene, {"bodies/b/velocity/x"}, GradientMethod::kTangent);
    EXPECT_EQ(later.certificate.verdict, "trustworthy") << dt;
    EXPECT_NEAR(later.jacobian(0, 0), 0.5, 1e-9) << dt;
    Scene apart = SceneOf(R"({"gravity": [0, -10], "bodies": [
        {"name": "b", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1, "position": [0, 0.05],
         "velocity": [1, 0], "friction": 0.2},
        {"name": "c", "mass": 1, "inertia": 1, "position": [5, 5]},
        {"name": "floor", "static": true, "friction": 0.2,
         "shape": {"half_plane": {"normal": [0, 1]}}}],
        "forces": [{"name": "f", "body": "c", "force": [5, 0], "start": 0.5}],
        "simulation": {"stepping": "event", "duration": 0.75}})");
    apart.simulation.dt = dt;
    const std::vector<std::string> paths = {"bodies/b/velocity/x", "forces/f/start"};
    for (const GradientMethod method : {GradientMethod::kTangent, GradientMethod::kAdjoint}) {
      const GradientResult result = testing::Jacobian(apart, paths, method);
      EXPECT_EQ(result.certificate.verdict, "trustworthy") << dt;
      EXPECT_NEAR(result.jacobian(0, 0), 0.5, 1e-9) << dt;
      EXPECT_NEAR(result.jacobian(9, 1), -5.0, 1e-9) << dt;
    }
  }
}

}  // namespace
}  // namespace tangible
