// SPDX-License-Identifier: Apache-2.0
//
// Rebounds that come ever faster end at their limit, with its motion and derivatives.
#include "tangible/simulation/events/rebounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::Jacobian;

constexpr double kFallAcceleration = 9.81;

/// A disc that is dropped from `height` and slides at 3 m/s, for 1.5 s.
Scene Dropped(double height, double restitution, double friction, double dt) {
  const std::string laws = R"("restitution": )" + std::to_string(restitution) +
                           R"(, "friction": )" + std::to_string(friction);
  return SceneOf(R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1.5, "position": [0, )" +
                 std::to_string(0.1 + height) + R"(], "velocity": [3, 0], )" + laws + R"(},
      {"name": "floor", "static": true, )" +
                 laws + R"(, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"stepping": "event", "integrator": "runge_kutta_4", "restitution_threshold": 0,
                   "dt": )" +
                 std::to_string(dt) + R"(, "duration": 1.5}})");
}

// The impulses of friction follow those of the floor, whose sum up to t is m (g t + v_y):
//   v_x = 3 − μ g T,   x = 3 T − μ (g T² / 2 − h),   whatever the restitution.
TEST(ReboundsTest, ADiscThatIsDroppedSlidesAsFarAsTheFormulaSays) {
  const double end = 1.5;
  for (const double restitution : {0.2, 0.5, 0.8}) {
    for (const double dt : {0.01, 0.05}) {
      SCOPED_TRACE(std::to_string(restitution) + " " + std::to_string(dt));
      const double height = 0.05;
      const double friction = 0.05;
      const Scene scene = Dropped(height, restitution, friction, dt);
      Model<double> model;
      State<double> state, last;
      BuildModel(scene, &model, &state);
      const RolloutReport report = Rollout(model, state, {}, &last);
      ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
      EXPECT_EQ(report.bounces_ended, 1);
      EXPECT_EQ(report.given_up.total(), 0);
      EXPECT_NEAR(last.pose[1], 0.1, 1e-12);
      EXPECT_NEAR(last.twist[0], 3.0 - friction * kFallAcceleration * end, 1e-10);
      EXPECT_NEAR(last.pose[0],
                  3.0 * end - friction * (0.5 * kFallAcceleration * end * end - height), 1e-9);
      const GradientResult r = Jacobian(
          scene, {"bodies/ball/position/y", "bodies/ball/restitution"}, GradientMethod::kAdjoint);
      EXPECT_NEAR(r.jacobian(0, 0), friction, 1e-6);
      EXPECT_NEAR(r.jacobian(0, 1), 0.0, 1e-6);
      EXPECT_EQ(r.certificate.bounces_ended, 1);
      EXPECT_EQ(r.certificate.verdict, "trustworthy");
    }
  }
}

// Three equal balls without gravity, the first of which strikes at 1 m/s: each impact of a pair
// leaves −e times its relative speed. The first ball follows the second one, which the third has
// slowed down, and strikes again, however small the gaps between them are.
TEST(ReboundsTest, BallsThatAreNearlyInTouchAllRebound) {
  const double restitution = 0.9;
  double v[3] = {1.0, 0.0, 0.0};
  const auto strike = [&](int i) {
    const double mean = 0.5 * (v[i] + v[i + 1]);
    const double half = 0.5 * restitution * (v[i] - v[i + 1]);
    v[i] = mean - half;
    v[i + 1] = mean + half;
  };
  strike(0);
  strike(1);
  ASSERT_GT(v[0], v[1]);
  strike(0);
  ASSERT_LT(v[0], v[1]);
  ASSERT_LT(v[1], v[2]);
  for (const double gap : {1e-3, 1e-6, 1e-9}) {
    SCOPED_TRACE(gap);
    Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0],
         "velocity": [1, 0], "restitution": 0.9},
        {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.2, 0],
         "restitution": 0.9},
        {"name": "c", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.4, 0],
         "restitution": 0.9}],
      "simulation": {"stepping": "event", "dt": 0.1, "duration": 2,
                     "restitution_threshold": 0}})");
    for (int i = 0; i < 3; ++i) scene.bodies[static_cast<size_t>(i)].position[0] += i * gap;
    Model<double> model;
    State<double> state, last;
    BuildModel(scene, &model, &state);
    const RolloutReport report = Rollout(model, state, {}, &last);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
    EXPECT_EQ(report.bounces_ended, 0);
    for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(last.twist[3 * i], v[i], 1e-12) << i;
  }
}

// It bounces at multiples of dt and is at rest at 0.3 s, on one too.
TEST(ReboundsTest, ASeriesOfRoundTimesEndsAtItsLimit) {
  for (const char* law : {"newton", "poisson"}) {
    for (const double dt : {0.1, 0.05, 0.01}) {
      SCOPED_TRACE(std::string(law) + " " + std::to_string(dt));
      Scene scene = Dropped(0.05, 0.5, 0.05, dt);
      scene.gravity = {0.0, -10.0};
      scene.simulation.duration = 1.0;
      scene.simulation.impact_law =
          std::string(law) == "newton" ? ImpactLaw::kNewton : ImpactLaw::kPoisson;
      Model<double> model;
      State<double> state, last;
      BuildModel(scene, &model, &state);
      const RolloutReport report = Rollout(model, state, {}, &last);
      ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
      EXPECT_EQ(report.bounces_ended, 1);
      EXPECT_NEAR(last.twist[0], 3.0 - 0.05 * 10.0, 1e-10);
      EXPECT_NEAR(last.pose[0], 3.0 - 0.05 * (0.5 * 10.0 - 0.05), 1e-9);
      const GradientResult r = Jacobian(scene, {"bodies/ball/position/y", "bodies/ball/velocity/x"},
                                        GradientMethod::kAdjoint);
      EXPECT_NEAR(r.jacobian(0, 0), 0.05, 1e-6);
      EXPECT_NEAR(r.jacobian(0, 1), 1.0, 1e-9);
    }
  }
}

// Without what brings it back, or where it comes back faster, a contact rebounds however slow it
// is.
TEST(ReboundsTest, EndOnlyWhereTheyShrinkAndReturnAtOnce) {
  ActiveContact contact;
  contact.a = 0;
  contact.b = 1;
  Rebounds rebounds;
  EXPECT_FALSE(rebounds.End(contact, 0.0, 1e-6, 0.5, 1e-9, 0.01));
  rebounds.Add(contact, 0.0, 1e-5, 0.5);
  EXPECT_FALSE(rebounds.End(contact, 0.0, 5e-6, 0.5, 1e-9, 0.01)) << "the same instant";
  EXPECT_FALSE(rebounds.End(contact, 1e-6, 2e-5, 0.5, 1e-9, 0.01)) << "faster than before";
  EXPECT_FALSE(rebounds.End(contact, 1e-6, 4e-6, 0.5, 1e-9, 0.01)) << "sent back by an impact";
  EXPECT_FALSE(rebounds.End(contact, 0.01, 5e-6, 0.5, 1e-9, 0.01)) << "the rest takes too long";
  EXPECT_FALSE(rebounds.End(contact, 1e-6, 5e-6, 0.5, 1e-14, 0.01)) << "it rises too high";
  EXPECT_FALSE(rebounds.End(contact, 1e-6, 5e-6, 1.0, 1e-9, 0.01)) << "it does not shrink";
  EXPECT_TRUE(rebounds.End(contact, 1e-6, 5e-6, 0.5, 1e-9, 0.01));
  ActiveContact other = contact;
  other.b = 2;
  EXPECT_FALSE(rebounds.End(other, 1e-6, 5e-6, 0.5, 1e-9, 0.01));
  rebounds.Clear();
  EXPECT_FALSE(rebounds.End(contact, 1e-6, 5e-6, 0.5, 1e-9, 0.01));
}

}  // namespace
}  // namespace tangible
