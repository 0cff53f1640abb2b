// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/tradeoff/sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "../../support/scenes.h"
#include "tangible/dynamics/model/settings.h"
#include "tangible/scene/scene_json.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible::tradeoff {
namespace {

using test_scenes::SceneOf;

TEST(SweepTest, TriesAllThatTheEngineHasOnceAndSaysWhatItHasNot) {
  const Scene scene = SceneOf(test_scenes::Mixture());
  for (const SweepKind kind : {SweepKind::kStar, SweepKind::kFull}) {
    const Sweep sweep = MakeSweep(scene, kind);
    std::set<std::string> names;
    std::string error;
    for (const SimulationSettings& settings : sweep.settings) {
      Scene with = scene;
      with.simulation = settings;
      EXPECT_TRUE(CheckSettings(with, &error)) << error;
      EXPECT_TRUE(names.insert(NameOf(settings, scene.simulation)).second);
      EXPECT_EQ(settings.duration, scene.simulation.duration);
    }
    // 3 steppings and integrators of 2 corrections; another tolerance of each stepping and
    // integrator, or of every combination.
    EXPECT_EQ(names.size(), kind == SweepKind::kStar ? 6u + 3u : 12u);
    EXPECT_TRUE(names.count("event runge_kutta_4, projection, tolerance 1e-06"));
    EXPECT_TRUE(names.count("fixed semi_implicit_euler, none"));
    const auto left_out = [&](const std::string& start) {
      return std::count_if(sweep.left_out.begin(), sweep.left_out.end(),
                           [&](const std::string& line) { return line.find(start) == 0; });
    };
    EXPECT_EQ(left_out("fixed stepping with trapezoidal: "), 1);
    EXPECT_EQ(left_out("fixed stepping with runge_kutta_4: "), 1);
    EXPECT_EQ(left_out("event stepping with semi_implicit_euler: "), 1);
  }
}

TEST(SweepTest, LeavesOutWhatDoesNotMatter) {
  Scene ball = SceneOf(test_scenes::FallingBall(0.5, R"({"duration": 1})"));
  const Sweep without_joints = MakeSweep(ball, SweepKind::kStar);
  EXPECT_EQ(without_joints.settings.size(), 3u + 3u);
  EXPECT_NE(std::find(without_joints.left_out.begin(), without_joints.left_out.end(),
                      "joint corrections: the scene has no joints"),
            without_joints.left_out.end());
  ball.simulation.lcp_tolerance = 1e-6;
  EXPECT_EQ(MakeSweep(ball, SweepKind::kFull).settings.size(), 3u);
  ball.simulation.lcp_tolerance = 1e-10;
  ball.no_contact.emplace_back("ball", "floor");
  EXPECT_EQ(MakeSweep(ball, SweepKind::kFull).settings.size(), 3u);
}

TEST(SweepTest, PoissonsLawIsTriedWithEventsAlone) {
  Scene scene = SceneOf(test_scenes::FallingBall(0.5, R"({"duration": 1})"));
  scene.simulation.stepping = Stepping::kEvent;
  scene.simulation.impact_law = ImpactLaw::kPoisson;
  for (const SimulationSettings& settings : MakeSweep(scene, SweepKind::kFull).settings) {
    EXPECT_EQ(settings.stepping, Stepping::kEvent);
  }
}

TEST(StepLengthsTest, FillTheDurationInAMultipleOfTheSamples) {
  SimulationSettings settings;
  settings.dt = 0.007;
  settings.duration = 0.9;
  const std::vector<double> lengths = StepLengths(settings, 20, {1.0, 100.0, 8.0, 0.5, 50.0});
  // 100 and 50 times, and 8 times as well, give the fewest steps there may be.
  ASSERT_EQ(lengths.size(), 3u);
  EXPECT_TRUE(std::is_sorted(lengths.rbegin(), lengths.rend()));
  const long steps[] = {20, 120, 260};
  for (size_t i = 0; i < 3; ++i) {
    settings.dt = lengths[i];
    EXPECT_EQ(NumSteps(settings), steps[i]);
    EXPECT_NEAR(lengths[i] * static_cast<double>(steps[i]), 0.9, 1e-14);
  }
}

TEST(DefaultParametersTest, AreAFewThatTheSceneHas) {
  const auto paths = [](const Scene& scene) {
    std::vector<std::string> all;
    for (const ParameterPath& parameter : DefaultParameters(scene)) all.push_back(parameter.path);
    return all;
  };
  EXPECT_EQ(paths(SceneOf(test_scenes::Mixture())),
            (std::vector<std::string>{"gravity/y", "bodies/*/mass", "bodies/*/friction",
                                      "bodies/*/restitution", "joints/pin/angle"}));
  EXPECT_EQ(paths(SceneOf(test_scenes::FallingBall(0.5, "{}"))).back(), "bodies/ball/velocity/x");
}

}  // namespace
}  // namespace tangible::tradeoff
