// SPDX-License-Identifier: Apache-2.0
//
// Derivatives of event steps where bodies lie in each other, or rest, as the run starts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/events/event_step.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::ExpectOthersAgree;
using testing::Jacobian;

constexpr double kG = 9.81;

// A ball of radius 0.1 m, 4 mm deep in a floor that pushes it out at 0.05 m/s.
Scene DeepBall(double vy, const std::string& integrator, const std::string& duration) {
  return SceneOf(R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1.5, "position": [0, 0.096],
       "velocity": [0.3, )" +
                 std::to_string(vy) + R"(], "friction": 0.2},
      {"name": "floor", "static": true, "friction": 0.2,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"stepping": "event", "dt": 0.005, "recovery_speed": 0.05, "integrator": ")" +
                 integrator + R"(", "duration": )" + duration + "}}");
}

// Thrown up at v it turns after v / g, still within the floor, which holds it from there on and
// pushes it out: y = y0 + v² / 2g + 0.05 (t − v / g).
TEST(EventPenetrationTest, WhatOpensWithinAnotherReturnsWhereItTurns) {
  for (const char* integrator : {"trapezoidal", "runge_kutta_4"}) {
    const double v = 0.03;
    const Scene scene = DeepBall(v, integrator, "0.02");
    const std::vector<std::string> paths = {"bodies/ball/velocity/y", "bodies/ball/position/y",
                                            "gravity/y", "bodies/ball/mass", "bodies/*/friction"};
    const GradientResult r = Jacobian(scene, paths, GradientMethod::kAdjoint);
    EXPECT_EQ(r.certificate.verdict, "trustworthy");
    EXPECT_NEAR(r.values[1], 0.096 + 0.5 * v * v / kG + 0.05 * (0.02 - v / kG), 1e-13);
    EXPECT_NEAR(r.jacobian(1, 0), (v - 0.05) / kG, 1e-12);
    EXPECT_NEAR(r.jacobian(1, 1), 1.0, 1e-12);
    EXPECT_NEAR(r.jacobian(1, 2), v * (0.5 * v - 0.05) / (kG * kG), 1e-12);
    ExpectOthersAgree(scene, paths, r);
  }
}

// The same in Jets, which find the time of the return from its equation alone. It slides without
// friction until then, and with that of its weight afterwards: poses are pushed out, not twists.
TEST(EventPenetrationTest, TheReturnInJetsIsThatOfTheClosedForm) {
  if (!testing::HaveJets()) {
    GTEST_SKIP() << "no width of Jets is built";
  }
  const double v = 0.03;
  const double t = 0.02 - v / kG;  // held so long
  const Scene scene = DeepBall(v, "runge_kutta_4", "0.02");
  const std::vector<std::string> paths = {"bodies/ball/velocity/y", "bodies/ball/position/y",
                                          "gravity/y"};
  for (const GradientMethod method : {GradientMethod::kJetImplicit, GradientMethod::kJet}) {
    const GradientResult r = Jacobian(scene, paths, method, CertificatePass::kSkip);
    EXPECT_NEAR(r.values[3], 0.3 - 0.2 * kG * t, 1e-12);
    const double expected[3][2] = {
        {(v - 0.05) / kG, 0.2}, {1.0, 0.0}, {v * (0.5 * v - 0.05) / (kG * kG), 0.2 * 0.02}};
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(r.jacobian(1, k), expected[k][0], 1e-12) << k;
      EXPECT_NEAR(r.jacobian(3, k), expected[k][1], 1e-12) << k;
    }
  }
}

TEST(EventPenetrationTest, TheReturnIsAnEventOfItsOwn) {
  const Scene scene = DeepBall(0.03, "runge_kutta_4", "0.005");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  ASSERT_EQ(stepper.Step(model, 0.0, 0.005, &state).status, StepStatus::kDone);
  const EventRecord& record = stepper.parts().islands[0]->events;
  int returns = 0;
  for (int p = 0; p < record.num_parts; ++p) {
    const EventPart& part = *record.parts[p];
    if (!part.is_impulses && part.segment.event == EventKind::kReturn) {
      ++returns;
      EXPECT_NEAR(part.segment.time + part.segment.length, 0.03 / kG, 1e-14);
      EXPECT_LT(part.segment.event_contact.joint, 0);
    }
  }
  EXPECT_EQ(returns, 1);
}

// The impact is at once, however deep it lies: no time changes with its place.
TEST(EventPenetrationTest, AnImpactWithinAnotherHasNoTimeThatItsPlaceMoves) {
  const Scene scene = DeepBall(-1.0, "runge_kutta_4", "0.02");
  const std::vector<std::string> paths = {"bodies/ball/position/y", "bodies/ball/velocity/y",
                                          "bodies/*/friction"};
  const GradientResult r = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(r.certificate.verdict, "trustworthy");
  EXPECT_NEAR(r.jacobian(1, 0), 1.0, 1e-12);
  EXPECT_NEAR(r.jacobian(1, 1), 0.0, 1e-12);
  ExpectOthersAgree(scene, paths, r);
}

// A joint beyond its limit turns back in the same way.
TEST(EventPenetrationTest, AJointBeyondItsLimitReturnsWhereItTurns) {
  const Scene scene = SceneOf(R"({"bodies": [
      {"name": "arm", "shape": {"box": {"size": [0.4, 0.05]}}, "mass": 1, "position": [0.2, 0],
       "velocity": [0, 0.04], "angular_velocity": 0.2}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["arm", "world"], "anchor": [0, 0],
       "limits": [0.01, 1]}],
    "simulation": {"stepping": "event", "integrator": "runge_kutta_4", "dt": 0.005,
                   "duration": 0.02, "recovery_speed": 0.05}})");
  const std::vector<std::string> paths = {"bodies/arm/mass", "gravity/y"};
  const GradientResult r = Jacobian(scene, paths, GradientMethod::kAdjoint);
  ExpectOthersAgree(scene, paths, r);
}

// It slides at 1 m/s. A push down lands and a push up is missed by what presses: both change the
// impulse of friction, so that ∂vx/∂vy = μ on either side.
TEST(EventPenetrationTest, AFirstTwistThatLandsActsWithFriction) {
  for (const double mu : {0.3, 0.7}) {
    const Scene scene = SceneOf(R"({"bodies": [
        {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 0.1],
         "velocity": [1, 0], "friction": )" +
                                std::to_string(mu) + R"(},
        {"name": "floor", "static": true, "friction": )" +
                                std::to_string(mu) + R"(,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"stepping": "event", "integrator": "runge_kutta_4", "dt": 0.01,
                     "duration": 0.1}})");
    const GradientResult r = Jacobian(scene, {"bodies/box/velocity/y"}, GradientMethod::kAdjoint);
    EXPECT_EQ(r.certificate.verdict, "trustworthy");
    EXPECT_NEAR(r.jacobian(3, 0), mu, 1e-12);
    EXPECT_NEAR(r.jacobian(0, 0), 0.1 * mu, 1e-12);
    for (const double side : {1e-6, -1e-6}) {
      Scene pushed = scene;
      pushed.bodies[0].velocity.y() = side;
      Model<double> model;
      State<double> initial, before, after;
      BuildModel(scene, &model, &initial);
      ASSERT_EQ(Rollout(model, initial, {}, &before).status, StepStatus::kDone);
      BuildModel(pushed, &model, &initial);
      ASSERT_EQ(Rollout(model, initial, {}, &after).status, StepStatus::kDone);
      EXPECT_NEAR((after.twist[0] - before.twist[0]) / side, mu, 1e-5);
    }
  }
}

// The ball beside the box is stepped in two parts once the box hops: on a spring it feels the error
// of the integrator, which the certificate names; without that error nothing is to be named.
TEST(EventPenetrationTest, AnEventThatSplitsTheFirstStepIsNamed) {
  const auto verdict = [](const std::string& stiffness, const std::string& integrator) {
    const Scene scene = SceneOf(R"({"bodies": [
        {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 1, "position": [0, 0.1],
         "friction": 0.3},
        {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [2, 2]},
        {"name": "floor", "static": true, "friction": 0.3,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "springs": [{"name": "s", "bodies": ["ball", "world"], "anchors": [[2, 2], [2, 4]],
                   "rest_length": 2, "stiffness": )" +
                                stiffness + R"(}],
      "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.03, "integrator": ")" +
                                integrator + R"("}})");
    return Jacobian(scene, {"bodies/box/velocity/y"}, GradientMethod::kTangent).certificate.verdict;
  };
  EXPECT_NE(verdict("1000", "trapezoidal").find("lets an event split the first step"),
            std::string::npos);
  EXPECT_EQ(verdict("0", "trapezoidal"), "trustworthy");
  EXPECT_EQ(verdict("0", "runge_kutta_4"), "trustworthy");
}

// No force acts on the slider: what rounding leaves of its angular velocity is no contradiction.
TEST(EventPenetrationTest, ASliderWithoutForcesIsNotContradicted) {
  for (int k = -20; k <= 20; ++k) {
    Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "link", "shape": {"circle": {"radius": 0.07}}, "mass": 0.646604552873041,
         "position": [-1.2357901557629765, 0.7601646036030093], "angle": -0.5610622993153734},
        {"name": "bean", "shape": {"capsule": {"length": 0.14264370234888912,
         "radius": 0.0937444870942197}}, "mass": 1.1903256079623872,
         "inertia": 0.01663395049921654, "position": [0.04148825039651283, 0.1884662370927706],
         "angle": 0.1869086232219425, "velocity": [-1.7672139804179983, -2.337235998348077],
         "angular_velocity": 2.541160185408355, "friction": 0.36, "restitution": 0.3},
        {"name": "floor", "static": true, "friction": 0.5, "restitution": 0.64,
         "angle": -0.2166802597376691, "position": [-0.0537471751148157, -0.24415413403663133],
         "shape": {"polygon": {"vertices": [[-9, -0.3], [9, -0.3], [10, 0.25], [-10, 0.25]]}}}],
      "joints": [{"name": "slide", "type": "prismatic", "bodies": ["link", "world"],
         "anchor": [-1.1719398433758303, 0.8617674461226152],
         "axis": [0.9855509407645158, 0.4188902796314434], "displacement": 0.01725439006392028,
         "rate": 0.17298749201192543}],
      "simulation": {"stepping": "event", "integrator": "runge_kutta_4", "dt": 0.005,
                     "duration": 0.05, "joint_correction": "none"}})");
    scene.bodies[1].angular_velocity *= 1.0 + 1e-4 * k;
    Model<double> model;
    State<double> initial, final;
    BuildModel(scene, &model, &initial);
    const RolloutReport report = Rollout(model, initial, {}, &final);
    EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  }
}

// Links that begin deep in the floor: as a second one is held, the correction of poses turns a
// corner of the first, which was opening. It returns at that instant, whatever moves it.
TEST(EventPenetrationTest, WhatACorrectionTurnsReturnsAtOnce) {
  const Scene scene = SceneOf(R"({"bodies": [
      {"name": "floor", "static": true, "friction": 3.0,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
      {"name": "link1", "mass": 1.5180135844599023, "inertia": 0.02142647142616927,
       "position": [-1.276643958133873, 0.3576652628661721], "angle": -0.6928071194198266},
      {"name": "link2", "shape": {"circle": {"radius": 0.07}}, "mass": 1.5964576253570066,
       "position": [-1.4299318744016196, 0.1729957885985164], "angle": -0.6928071194198266,
       "friction": 3.3803224916240975},
      {"name": "link3", "shape": {"box": {"size": [0.05, 0.24]}}, "mass": 1.1065977677170387,
       "position": [-1.583219790669366, -0.011673685669139358], "angle": -0.6928071194198266,
       "friction": 2.5582886356572043},
      {"name": "link4", "shape": {"circle": {"radius": 0.07}}, "mass": 2.4884297124655803,
       "position": [-1.7365077069371122, -0.19634315993679513], "angle": -0.6928071194198266,
       "friction": 2.1365141008914548}],
    "joints": [
      {"name": "joint0", "type": "weld", "bodies": ["link2", "link1"],
       "anchor": [-1.3532879162677465, 0.2653305257323443]},
      {"name": "joint1", "type": "revolute", "bodies": ["link3", "link2"],
       "anchor": [-1.5065758325354928, 0.08066105146468852], "angle": 0.2987637057028575,
       "rate": -1.3018785716434484},
      {"name": "joint2", "type": "revolute", "bodies": ["link4", "link3"],
       "anchor": [-1.659863748803239, -0.10400842280296724], "angle": 0.20867814861149922,
       "rate": 0.09078131896474728}],
    "springs": [{"name": "spring", "bodies": ["link1", "world"], "stiffness": 6.446353217541619,
       "anchors": [[-1.267336100552214, 0.4048550187148136], [0.9281602192882826, 1.5]],
       "rest_length": 0.6101018997672449}],
    "no_contact": [["link*", "link*"]],
    "simulation": {"dt": 0.01, "duration": 0.02, "stepping": "event",
                   "integrator": "runge_kutta_4", "joint_correction": "projection",
                   "recovery_speed": 3.0, "friction_mixing": "geometric_mean"}})");
  const std::vector<std::string> paths = {"gravity/x", "bodies/link2/mass", "joints/joint1/angle"};
  const GradientResult r = Jacobian(scene, paths, GradientMethod::kAdjoint);
  ExpectOthersAgree(scene, paths, r);
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  int at_once = 0;
  for (int k = 0; k < 2; ++k) {
    ASSERT_EQ(stepper.Step(model, 0.01 * k, 0.01, &state).status, StepStatus::kDone);
    const EventRecord& record = stepper.parts().islands[0]->events;
    for (int p = 0; p < record.num_parts; ++p) {
      const EventPart& part = *record.parts[p];
      if (!part.is_impulses && part.segment.event == EventKind::kAtOnce) {
        ++at_once;
        EXPECT_EQ(part.segment.length, 0.0);
      }
    }
  }
  EXPECT_EQ(at_once, 1);
}

// Two hinges of the same bodies whose limits leave no angle: what moves one out of its limit holds
// the other one beyond its own.
TEST(EventPenetrationTest, LimitsThatContradictEachOtherAreReported) {
  const auto status_of =
      [](const char* low, const char* high, std::string* message) {
        Model<double> model;
        State<double> initial, final;
        BuildModel(test_scenes::SceneOf(std::string(R"({"bodies": [
        {"name": "bar", "shape": {"box": {"size": [1, 0.1]}}, "mass": 1, "position": [0.5, 0]}],
      "joints": [{"name": "first", "type": "revolute", "bodies": ["bar", "world"], "anchor": [0, 0],
                  "limits": )") + low + R"(}, {"name": "second", "type": "revolute",
                  "bodies": ["bar", "world"], "anchor": [0, 0], "limits": )" +
                                        high + R"(}],
      "simulation": {"dt": 0.01, "duration": 0.3, "stepping": "event",
                     "integrator": "trapezoidal"}})"),
                   &model, &initial);
        const RolloutReport report = Rollout(model, initial, nullptr, &final);
        *message = report.message;
        return report.status;
      };
  std::string message;
  EXPECT_EQ(status_of("[0.1, 1]", "[-1, -0.1]", &message), StepStatus::kUnsolved);
  EXPECT_NE(message.find("stays broken: another one contradicts it"), std::string::npos) << message;
  EXPECT_EQ(status_of("[0.1, 1]", "[-1, 0.2]", &message), StepStatus::kDone) << message;
  EXPECT_EQ(status_of("[0.1, 1]", "[0.2, 0.5]", &message), StepStatus::kDone) << message;
}

// One limit's recovery may break the next joint's further for a while.
TEST(EventPenetrationTest, TwoJointsBeyondTheirLimitsReturnToThem) {
  Model<double> model;
  State<double> initial, final;
  BuildModel(test_scenes::SceneOf(R"({"bodies": [
      {"name": "a", "shape": {"box": {"size": [0.5, 0.05]}}, "position": [0.25, 0], "mass": 1},
      {"name": "b", "shape": {"box": {"size": [0.5, 0.05]}}, "position": [0.75, 0], "mass": 1}],
    "joints": [
      {"name": "first", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
       "limits": [-0.2, 0.2], "angle": 0.5},
      {"name": "second", "type": "revolute", "bodies": ["b", "a"], "anchor": [0.5, 0],
       "limits": [-0.2, 0.2], "angle": 0.5}],
    "simulation": {"dt": 0.01, "duration": 0.5, "stepping": "event",
                   "joint_correction": "projection"}})"),
             &model, &initial);
  double drift = 0.0;
  const RolloutReport report = Rollout(
      model, initial,
      [&](long, double, const State<double>& state, Stepper*) {
        drift = std::max(drift, JointDrift(model, state));
      },
      &final);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_LE(drift, 1e-8);  // what recovers does not pull the hinges apart
  EXPECT_LE(final.pose[2], 0.2 + 1e-6);
  EXPECT_LE(final.pose[5] - final.pose[2], 0.2 + 1e-6);
}

}  // namespace
}  // namespace tangible
