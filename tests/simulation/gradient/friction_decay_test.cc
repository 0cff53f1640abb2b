// SPDX-License-Identifier: Apache-2.0
//
// Friction of contacts that decays with the sliding speed, against an integrator of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"

namespace tangible {
namespace {

using test_scenes::kGravity;
using test_scenes::SceneOf;
using testing::ExpectOthersAgree;
using testing::Jacobian;

struct Law {
  double rest, kinetic, speed;
  double At(double v) const {
    return kinetic + (rest - kinetic) * std::exp(-(v / speed) * (v / speed));
  }
};

// Where a block with this friction is after a time, and its speed, from v0 at 0, while it slides.
std::pair<double, double> Slide(const Law& law, double v0, double duration) {
  constexpr int kSteps = 20000;
  const double h = duration / kSteps;
  double x = 0.0;
  double v = v0;
  const auto a = [&](double at) { return -kGravity * law.At(at); };
  for (int k = 0; k < kSteps; ++k) {
    const double a1 = a(v), a2 = a(v + 0.5 * h * a1), a3 = a(v + 0.5 * h * a2), a4 = a(v + h * a3);
    x += h * v + h * h / 6.0 * (a1 + a2 + a3);
    v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }
  return {x, v};
}

Scene Block(const std::string& of_block, const std::string& of_floor, const std::string& more,
            double duration, double dt = 0.005) {
  return SceneOf(R"({"bodies": [
      {"name": "floor", "static": true, )" +
                 of_floor +
                 R"(, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "b", "mass": 2, "shape": {"box": {"size": [0.4, 0.1]}}, "position": [0, 0.05],
       "velocity": [-1.5, 0], )" +
                 of_block + "}]" + more + R"(, "simulation": {"stepping": "event", "dt": )" +
                 std::to_string(dt) + R"(, "duration": )" + std::to_string(duration) + "}}");
}

TEST(FrictionDecayTest, ABlockSlowsDownAsItsFrictionGrows) {
  const Law law{0.5, 0.2, 0.4};
  const std::string both = R"("friction": 0.5, "kinetic_friction": 0.2, "stribeck_speed": 0.4)";
  const Scene scene = Block(both, both, "", 0.4);
  const auto [x, v] = Slide(law, 1.5, 0.4);
  const std::vector<std::string> paths = {"bodies/*/friction", "bodies/*/kinetic_friction",
                                          "bodies/*/stribeck_speed", "bodies/b/velocity/x",
                                          "bodies/b/mass"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.values[0], -x, 1e-8);
  EXPECT_NEAR(result.values[3], -v, 1e-8);
  const double h = 1e-5;
  const auto slope = [&](const Law& more, const Law& less) {
    return (Slide(more, 1.5, 0.4).first - Slide(less, 1.5, 0.4).first) / (2.0 * h);
  };
  EXPECT_NEAR(result.jacobian(0, 0), -slope({0.5 + h, 0.2, 0.4}, {0.5 - h, 0.2, 0.4}), 1e-7);
  EXPECT_NEAR(result.jacobian(0, 1), -slope({0.5, 0.2 + h, 0.4}, {0.5, 0.2 - h, 0.4}), 1e-7);
  EXPECT_NEAR(result.jacobian(0, 2), -slope({0.5, 0.2, 0.4 + h}, {0.5, 0.2, 0.4 - h}), 1e-7);
  EXPECT_NEAR(result.jacobian(0, 4), 0.0, 1e-9);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  ExpectOthersAgree(scene, paths, result);
}

// A kinetic friction of one body mixes with the friction at rest of the other; a pair has its own.
TEST(FrictionDecayTest, MixesAndBelongsToPairs) {
  const std::string decays = R"("friction": 0.6, "kinetic_friction": 0.1, "stribeck_speed": 0.3)";
  const Scene mixed = Block(decays, R"("friction": 0.4)", "", 0.3);
  const std::vector<std::string> paths = {"bodies/floor/friction", "bodies/b/kinetic_friction",
                                          "bodies/b/stribeck_speed", "bodies/b/angle"};
  const GradientResult result = Jacobian(mixed, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.values[0], -Slide({0.5, 0.25, 0.3}, 1.5, 0.3).first, 1e-8);
  ExpectOthersAgree(mixed, {paths[0], paths[1], paths[2]},
                    Jacobian(mixed, {paths[0], paths[1], paths[2]}, GradientMethod::kAdjoint));
  const Scene pair = Block(decays, R"("friction": 0.4)",
                           R"(, "pairs": [{"bodies": ["b", "floor"], "friction": 0.3,
                               "kinetic_friction": 0.2, "stribeck_speed": 1}])",
                           0.3);
  EXPECT_NEAR(
      Jacobian(pair, {"pairs/b:floor/kinetic_friction"}, GradientMethod::kTangent).values[0],
      -Slide({0.3, 0.2, 1.0}, 1.5, 0.3).first, 1e-8);
  const Scene own = Block(decays, R"("friction": 0.4)",
                          R"(, "pairs": [{"bodies": ["b", "floor"], "friction": 0.3}])", 0.3);
  EXPECT_NEAR(Jacobian(own, {"pairs/b:floor/friction"}, GradientMethod::kTangent).values[0],
              -(1.5 * 0.3 - 0.5 * 0.3 * kGravity * 0.3 * 0.3), 1e-10);
}

// It stops, and is held by the friction at rest.
TEST(FrictionDecayTest, ABlockStopsAndIsHeld) {
  const std::string both = R"("friction": 0.5, "kinetic_friction": 0.2, "stribeck_speed": 0.4)";
  const Scene scene =
      Block(both, both, R"(, "forces": [{"name": "f", "body": "b", "force": [-2, 0]}])", 2.0);
  const std::vector<std::string> paths = {"bodies/b/velocity/x", "bodies/*/friction",
                                          "forces/f/force/x"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.values[3], 0.0, 1e-15);  // friction holds up to 9.8 N
  ExpectOthersAgree(scene, paths, result);
}

// On a belt the sliding speed is that against the belt. A block that the belt carries along at its
// own speed does not slide.
TEST(FrictionDecayTest, OnABelt) {
  for (const double start : {0.0, 0.7}) {
    const Scene scene = SceneOf(R"({"bodies": [
        {"name": "belt", "kinematic": true, "velocity": [0.7, 0], "friction": 0.5,
         "kinetic_friction": 0.2, "stribeck_speed": 0.4,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
        {"name": "b", "mass": 2, "shape": {"box": {"size": [0.4, 0.1]}}, "position": [0, 0.05],
         "friction": 0.5, "kinetic_friction": 0.2, "stribeck_speed": 0.4, "velocity": [)" +
                                std::to_string(start) + R"(, 0]}],
        "simulation": {"stepping": "event", "dt": 0.005, "duration": 0.1}})");
    const GradientResult result = Jacobian(
        scene, {"bodies/*/friction", "bodies/*/kinetic_friction", "bodies/*/stribeck_speed"},
        GradientMethod::kAdjoint);
    const auto [x, v] = start < 0.7 ? Slide({0.5, 0.2, 0.4}, 0.7, 0.1) : std::pair(0.0, 0.0);
    EXPECT_NEAR(result.values[0], 0.07 - x, 1e-8);
    EXPECT_NEAR(result.values[3], 0.7 - v, 1e-8);
    if (start < 0.7) {
      const std::vector<std::string> moving = {"bodies/belt/velocity/x", "bodies/*/stribeck_speed"};
      ExpectOthersAgree(scene, moving, Jacobian(scene, moving, GradientMethod::kAdjoint));
    } else {
      EXPECT_NEAR(result.jacobian.cwiseAbs().maxCoeff(), 0.0, 1e-12);
    }
  }
}

// Blocks that do not meet are islands of their own, each with its friction.
TEST(FrictionDecayTest, BlocksApart) {
  const std::string both = R"("friction": 0.5, "kinetic_friction": 0.2, "stribeck_speed": 0.4)";
  Scene scene = Block(both, both, "", 0.2);
  for (int k = 0; k < 11; ++k) {
    scene.bodies.push_back(scene.bodies[1]);
    scene.bodies.back().name = "b" + std::to_string(k);
    scene.bodies.back().position.x() += 2.0 * (k + 1);
  }
  const std::vector<std::string> paths = {"bodies/*/stribeck_speed"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  const double x = Slide({0.5, 0.2, 0.4}, 1.5, 0.2).first;
  const double h = 1e-5;
  const double slope =
      (Slide({0.5, 0.2, 0.4 + h}, 1.5, 0.2).first - Slide({0.5, 0.2, 0.4 - h}, 1.5, 0.2).first) /
      (2.0 * h);
  for (int k = 0; k < 12; ++k) {
    EXPECT_NEAR(result.values[6 * k], 2.0 * k - x, 1e-8) << k;
    EXPECT_NEAR(result.jacobian(6 * k, 0), -slope, 1e-7) << k;
  }
}

// A tilted box slides on a corner, whose speed along the floor depends on the angle.
TEST(FrictionDecayTest, ACornerTurnsAsItSlides) {
  const std::string both = R"("friction": 0.5, "kinetic_friction": 0.2, "stribeck_speed": 0.4)";
  Scene scene = Block(both, both, "", 0.1);
  scene.bodies[1].position.y() = 0.2 * std::sin(0.3) + 0.05 * std::cos(0.3) + 0.001;
  scene.bodies[1].angle = 0.3;
  scene.bodies[1].angular_velocity = 4.0;
  const std::vector<std::string> paths = {"bodies/b/angle", "bodies/b/angular_velocity",
                                          "bodies/*/stribeck_speed"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  ExpectOthersAgree(scene, paths, result);
}

}  // namespace
}  // namespace tangible
