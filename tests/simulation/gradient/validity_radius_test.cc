// SPDX-License-Identifier: Apache-2.0
//
// The radius of validity: closed forms, and random scenes that are changed by half of it and by
// twice as much.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "../../support/thorough.h"
#include "tangible/simulation/gradient/rollout_function.h"
#include "tangible/verification/gradients/verify_run.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

Certificate CertificateOf(const std::string& text, const std::string& parameter,
                          Stepping stepping) {
  Scene scene = test_scenes::SceneOf(text);
  scene.simulation.stepping = stepping;
  const GradientResult result =
      FinalStateJacobian(scene, testing::Resolve(scene, {parameter}), {.radius = RadiusPass::kRun});
  EXPECT_TRUE(result.done) << result.message;
  EXPECT_EQ(result.certificate.radius.size(), 1U);
  return result.certificate;
}

constexpr char kPushedBox[] = R"({"bodies": [
    {"name": "floor", "static": true, "friction": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
    {"name": "box", "shape": {"box": {"size": [2, 1]}}, "mass": 2, "position": [0, 0.5],
     "friction": 0.5}],
  "pairs": [{"bodies": ["box", "floor"], "friction": 0.5}],
  "forces": [{"name": "push", "body": "box", "force": [4, 0], "at": [0, -0.5]}],
  "simulation": {"dt": 0.01, "duration": 0.5}})";

// The box breaks loose at μ m g = 9.81 N.
TEST(ValidityRadius, OfABoxThatIsPushedEndsAtItsFriction) {
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    const Certificate push = CertificateOf(kPushedBox, "forces/push/force/x", stepping);
    EXPECT_NEAR(push.radius[0].up, 9.81 - 4.0, 1e-6);
    EXPECT_NEAR(push.radius[0].down, 9.81 + 4.0, 1e-5);
    EXPECT_NE(push.radius[0].up_where.find("friction limit"), std::string::npos)
        << push.radius[0].up_where;
    const Certificate friction = CertificateOf(kPushedBox, "pairs/box:floor/friction", stepping);
    EXPECT_NEAR(friction.radius[0].down, 0.5 - 4.0 / 19.62, 1e-6);
    EXPECT_TRUE(std::isinf(friction.radius[0].up)) << friction.radius[0].up_where;
  }
}

constexpr char kDroppedBall[] = R"({"bodies": [
    {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
    {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1.1],
     "restitution": 0.5}],
  "pairs": [{"bodies": ["ball", "floor"], "restitution": 0.5}],
  "simulation": {"dt": 0.01, "duration": 0.6}})";

// It falls 1 m, t = √(2 / g), dt/dh = 1 / √(2 g): the impact leaves the run of 0.6 s. Higher up the
// run has no other choice; far lower down it would not rebound, at the threshold of 1 mm/s.
TEST(ValidityRadius, OfAFallEndsWhereTheImpactLeavesTheRun) {
  const Certificate fall = CertificateOf(kDroppedBall, "bodies/ball/position/y", Stepping::kEvent);
  const double g = 9.81;
  const double t = std::sqrt(2.0 / g);
  EXPECT_NEAR(fall.radius[0].up, (0.6 - t) * std::sqrt(2.0 * g), 1e-6);
  EXPECT_NEAR(fall.radius[0].down, (g * t - 1e-3) * t, 1e-6) << fall.radius[0].down_where;
}

// An impact that comes after the end enters the run of 0.4 s, also of steps at given times, as
// those of a fit are.
TEST(ValidityRadius, OfAFallEndsWhereTheImpactEntersTheRun) {
  const double g = 9.81;
  const double t = std::sqrt(2.0 / g);
  Scene scene = test_scenes::SceneOf(kDroppedBall);
  scene.simulation.stepping = Stepping::kEvent;
  scene.simulation.duration = 0.4;
  for (const std::vector<double>& times :
       {std::vector<double>{}, std::vector<double>{0.0, 0.15, 0.3, 0.4}}) {
    scene.simulation.step_times = times;
    const GradientResult result = FinalStateJacobian(
        scene, testing::Resolve(scene, {"bodies/ball/position/y"}), {.radius = RadiusPass::kRun});
    ASSERT_EQ(result.certificate.radius.size(), 1u) << result.message;
    EXPECT_NEAR(result.certificate.radius[0].down, (t - 0.4) * std::sqrt(2.0 * g), 1e-6);
  }
}

// It stops at v / 2 s, also on a step's end: of a speed that takes 1 s the stop leaves the run. The
// fractions of steps to which its motions are shortened are no events.
TEST(ValidityRadius, OfABodyThatStopsOnItsSupport) {
  for (const char* dt : {"0.1", "0.05", "0.03", "0.25"}) {
    const Certificate stop = CertificateOf(
        R"({"gravity": [0, 0], "bodies": [{"name": "b", "mass": 1, "inertia": 1, "position": [0, 0],
            "velocity": [1, 0], "support": {"friction": 0.2, "load": 10}}],
            "simulation": {"duration": 1, "dt": )" +
            std::string(dt) + "}}",
        "bodies/b/velocity/x", Stepping::kEvent);
    EXPECT_NEAR(stop.radius[0].up, 1.0, 1e-6) << dt << " " << stop.radius[0].up_where;
    EXPECT_TRUE(std::isinf(stop.radius[0].down)) << dt << " " << stop.radius[0].down_where;
  }
}

// ẋ of the start adds v T: in units of the scene and of the duration the flow is [1 1; 0 1], whose
// largest singular value is the golden ratio.
// A servo of 16 N/m holds 16 N of the 16.5 that it has; a target 0.5 / 16 m higher begins beyond.
TEST(ValidityRadius, OfAServoEndsAtTheBoundThatItDoesNotReach) {
  constexpr char kHeld[] = R"({"gravity": [0, -8], "bodies": [
      {"name": "w", "mass": 2, "position": [0, 0], "shape": {"circle": {"radius": 0.125}}}],
    "joints": [{"name": "p", "type": "prismatic", "bodies": ["w", "world"], "anchor": [0, 0],
                "axis": [0, 1], "effort": {"target": 1, "stiffness": 16, "limit": 16.5}}],
    "simulation": {"dt": 0.015625, "duration": 0.5}})";
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    const Certificate target = CertificateOf(kHeld, "joints/p/effort/target", stepping);
    EXPECT_NEAR(target.radius[0].up, 0.5 / 16.0, 1e-6);
    const Certificate limit = CertificateOf(kHeld, "joints/p/effort/limit", stepping);
    EXPECT_NEAR(limit.radius[0].down, 0.5, 1e-6);
    EXPECT_TRUE(std::isinf(limit.radius[0].up)) << limit.radius[0].up_where;
  }
}

TEST(ValidityRadius, GrowthOfAFreeFlightIsTheGoldenRatio) {
  const Certificate flight = CertificateOf(
      R"({"bodies": [{"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
                      "position": [0, 1], "velocity": [3, 1]}],
          "simulation": {"dt": 0.01, "duration": 0.4}})",
      "bodies/ball/velocity/x", Stepping::kFixed);
  EXPECT_NEAR(flight.growth, 0.5 * (1.0 + std::sqrt(5.0)), 1e-9);
  EXPECT_TRUE(std::isinf(flight.radius[0].up));
}

struct Tally {
  int kept = 0, of_kept = 0, changed = 0, of_changed = 0;
};

// In the direction of each parameter's nearest change. Left out is what is far: a doubled radius
// beyond the range, or above a tenth of the parameter's scale, is no first order.
void AddScene(const Scene& scene, unsigned seed, bool prints, Tally* tally) {
  const std::vector<ParameterPath> parameters = RandomParameters(scene, seed);
  const RolloutFunction function = RolloutFunction::OfFinalState(scene, parameters);
  RolloutWorker worker(function);
  const RolloutInput input{function.OwnParameters(), {}, {}};
  const std::vector<ValidityRadius> radii = worker.Radii(input);
  if (radii.empty()) return;
  int nearest = -1;
  double least = HUGE_VAL;
  for (size_t p = 0; p < radii.size(); ++p) {
    const double size = std::max(std::abs(parameters[p].value), parameters[p].scale);
    const double share = std::min(radii[p].down, radii[p].up) / size;
    if (share < least) {
      least = share;
      nearest = static_cast<int>(p);
    }
  }
  if (nearest < 0 || !(least > 0.0) || 2.0 * least > 0.1) return;
  const ValidityRadius& radius = radii[static_cast<size_t>(nearest)];
  const bool up = radius.up <= radius.down;
  const double shift = up ? radius.up : -radius.down;
  ChoiceList own, half, twice;
  if (!worker.Choices(input, nearest, 0.0, &own)) return;
  const bool ran = worker.Choices(input, nearest, 0.5 * shift, &half);
  if (!worker.Choices(input, nearest, 2.0 * shift, &twice)) return;
  const bool kept = ran && FirstDifference(own, half) == nullptr;
  const bool changed = FirstDifference(own, twice) != nullptr;
  ++tally->of_kept;
  ++tally->of_changed;
  tally->kept += kept ? 1 : 0;
  tally->changed += changed ? 1 : 0;
  if (prints && !(kept && changed)) {
    std::printf("seed %u, %s: %g at %s: %s%s\n", seed, radius.parameter.c_str(), shift,
                (up ? radius.up_where : radius.down_where).c_str(), kept ? "" : "changed by half; ",
                changed ? "" : "same by twice");
    const Choice* first = kept || !ran ? nullptr : FirstDifference(own, half);
    if (first != nullptr) {
      std::printf("  by half: %s\n", NameOf(function.structure(), *first).c_str());
    }
  }
}

class RandomScenes : public ::testing::TestWithParam<Stepping> {};

TEST_P(RandomScenes, KeepTheirChoicesWithinTheRadiusAndChangeThemBeyond) {
  const char* size = std::getenv("TANGIBLE_RADIUS_SCENES");
  const unsigned scenes = size != nullptr       ? static_cast<unsigned>(std::atoi(size))
                          : testing::Thorough() ? 60U
                                                : 30U;
  Tally tally;
  for (unsigned seed = 1; seed <= scenes; ++seed) {
    AddScene(RandomScene(seed, {.stepping = GetParam()}), seed, size != nullptr, &tally);
  }
  std::printf("%d of %d kept by half of the radius, %d of %d changed by twice\n", tally.kept,
              tally.of_kept, tally.changed, tally.of_changed);
  EXPECT_GE(tally.of_kept, static_cast<int>(scenes) / 8);
  // With as few scenes as by default one of either is no share.
  EXPECT_GE(tally.kept, 0.98 * tally.of_kept - 1.0);
  EXPECT_GE(tally.changed, 0.9 * tally.of_changed - 1.0);
}

INSTANTIATE_TEST_SUITE_P(Steppings, RandomScenes,
                         ::testing::Values(Stepping::kFixed, Stepping::kEvent));

}  // namespace
}  // namespace tangible
