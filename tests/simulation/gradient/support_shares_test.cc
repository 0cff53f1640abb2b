// SPDX-License-Identifier: Apache-2.0
//
// What a support and joints hold together: the support needs to give only what joints do not keep.
// Against closed forms, and steps of 0.1 ms.
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
using testing::ExpectOthersAgree;
using testing::Jacobian;

constexpr double kGravityThere = 9.81;

// A body of 2 kg on a rail along `axis`; a force along the rail and across it.
Scene OnARail(const std::string& support, const std::string& axis, const std::string& force,
              Stepping stepping) {
  Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 2, "inertia": 0.1, "position": [0.3, 0], "support": )" +
                        support + R"(}], "joints": [{"name": "rail", "type": "prismatic",
      "bodies": ["b", "world"], "anchor": [0, 0], "axis": )" +
                        axis + R"(}], "forces": [{"name": "f", "body": "b", "force": )" + force +
                        R"(}], "simulation": {"dt": 0.01, "duration": 1}})");
  scene.simulation.stepping = stepping;
  return scene;
}

const char* const kSupports[] = {R"({"friction": 0.1})", R"({"friction": 0.1, "radius": 0.1})",
                                 R"({"friction": 0.1, "points": [[0.1, 0.05], [-0.1, 0.05]]})"};

// Of 1.962 N of friction 1.5 N hold it, whatever pushes it against the rail.
TEST(SupportSharesTest, ARailTakesWhatPushesAcrossIt) {
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    for (const char* support : kSupports) {
      for (const char* force : {"[1.5, -6]", "[-1.9, 60]", "[0, 3]"}) {
        // By events the certificate tries many starts beside one at rest.
        if (stepping == Stepping::kEvent && force[1] != '1') continue;
        const GradientResult result = Jacobian(OnARail(support, "[1, 0]", force, stepping),
                                               {"forces/f/force/x"}, GradientMethod::kTangent);
        ASSERT_TRUE(result.done) << result.message;
        EXPECT_EQ(result.values[0], 0.3) << support << force;
        // The rail leaves its rounding of a body that does not move.
        for (int i = 1; i < 6; ++i) EXPECT_NEAR(result.values[i], 0.0, 1e-20) << support << force;
        EXPECT_NEAR(result.jacobian.norm(), 0.0, 1e-15);
      }
      // 2.5 N along a rail move it, beside 3.2 N across.
      const double a = (2.5 - 0.2 * kGravityThere) / 2.0;
      const GradientResult result =
          Jacobian(OnARail(support, "[0.8, 0.6]", "[3.92, -1.06]", stepping),
                   {"forces/f/force/x", "bodies/b/support/friction"}, GradientMethod::kTangent);
      ASSERT_TRUE(result.done) << result.message;
      const double share = stepping == Stepping::kEvent ? 0.5 : 0.505;
      EXPECT_NEAR(result.values[0], 0.3 + 0.8 * share * a, 1e-9) << support;
      EXPECT_NEAR(result.jacobian(0, 0), 0.8 * share * 0.8 / 2.0, 1e-7) << support;
      EXPECT_NEAR(result.jacobian(0, 1), -0.8 * share * kGravityThere, 1e-7) << support;
    }
  }
}

// A force that grows as 4 N/s t breaks it loose at 1.962 / 4 s, within a step, while three times as
// much pushes it across: x = 4 (t - t0)^3 / 12.
TEST(SupportSharesTest, ItBreaksLooseWhenTheForceAlongTheRailIsTooLarge) {
  for (const char* support : kSupports) {
    Scene scene = OnARail(support, "[1, 0]", "[0, -6]", Stepping::kEvent);
    Signal grows;
    grows.interpolation = Signal::Interpolation::kLinear;
    grows.time = {0.0, 1.0};
    grows.x = {0.0, 4.0};
    grows.y = {-6.0, -6.0};
    scene.forces[0].force_signal = grows;
    const std::vector<std::string> paths = {"bodies/b/support/friction"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kTangent);
    ASSERT_TRUE(result.done) << result.message;
    const double moves = 1.0 - 0.2 * kGravityThere / 4.0;
    EXPECT_NEAR(result.values[0], 0.3 + std::pow(moves, 3) / 3.0, 1e-9) << support;
    EXPECT_NEAR(result.jacobian(0, 0), -moves * moves * 0.5 * kGravityThere, 1e-7) << support;
    // What the points could share with the rail is not told by what they do, from 9 / 10 on.
    if (support != kSupports[2]) {
      EXPECT_EQ(result.certificate.verdict, "trustworthy") << support;
    }
    ExpectOthersAgree(scene, paths, result);
  }
}

// A disc on an arm may only turn about the arm's pivot: up to the torque
// mu N times the mean distance of its points from the pivot it stays.
TEST(SupportSharesTest, AnArmOnADiscTurnsAboutItsPivot) {
  constexpr double kArm = 0.3, kRadius = 0.05;
  double mean = 0.0;
  constexpr int kRings = 400, kRays = 400;
  for (int i = 0; i < kRings; ++i) {
    const double r = kRadius * std::sqrt((i + 0.5) / kRings);
    for (int k = 0; k < kRays; ++k) {
      const double angle = 2.0 * M_PI * (k + 0.5) / kRays;
      mean += std::hypot(kArm + r * std::cos(angle), r * std::sin(angle)) / (kRings * kRays);
    }
  }
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    for (const double part : {0.5, 0.999, 1.001, 1.5}) {
      Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
          {"name": "b", "mass": 1, "inertia": 0.1, "position": [0.3, 0],
           "support": {"friction": 0.5, "radius": 0.05}}],
          "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"],
                      "anchor": [0, 0]}],
          "forces": [{"name": "f", "body": "b", "torque": 1}],
          "simulation": {"dt": 0.001, "duration": 0.1}})");
      scene.simulation.stepping = stepping;
      scene.forces[0].torque = part * 0.5 * kGravityThere * mean;
      const GradientResult result = Jacobian(scene, {"forces/f/torque"}, GradientMethod::kTangent);
      ASSERT_TRUE(result.done) << result.message;
      if (part < 1.0) {
        EXPECT_NEAR(result.values[2], 0.0, 1e-20) << part;
        EXPECT_NEAR(result.values[5], 0.0, 1e-20) << part;
        continue;
      }
      const double rate = (part - 1.0) * 0.5 * kGravityThere * mean / (0.1 + kArm * kArm) * 0.1;
      EXPECT_NEAR(result.values[5], rate, 1e-4 * rate) << part;
    }
  }
}

// Of two bodies on a rod one holds at most 1 N and the other one 3 N: 3.9 N are held by both, with
// shares that no solve of their rows tells, and 4.5 N move both.
TEST(SupportSharesTest, BodiesHoldTogetherWhatOneCannot) {
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    for (const char* joint : {R"("distance", "bodies": ["b", "a"], "anchors": [[1, 0], [0, 0]])",
                              R"("weld", "bodies": ["b", "a"], "anchor": [0.5, 0])"}) {
      for (const double force : {2.5, 3.9, 4.5, -3.9}) {
        Scene scene = SceneOf(std::string(R"({"gravity": [0, 0], "bodies": [
            {"name": "a", "mass": 2, "inertia": 0.1, "position": [0, 0],
             "support": {"friction": 0.1, "load": 10}},
            {"name": "b", "mass": 2, "inertia": 0.1, "position": [1, 0],
             "support": {"friction": 0.3, "load": 10, "radius": 0.1}}],
            "joints": [{"name": "j", "type": )") +
                              joint + R"(}],
            "forces": [{"name": "f", "body": "a", "force": [1, 0]}],
            "simulation": {"dt": 0.01, "duration": 1}})");
        scene.simulation.stepping = stepping;
        scene.forces[0].force[0] = force;
        const GradientResult result =
            Jacobian(scene, {"forces/f/force/x"}, GradientMethod::kTangent);
        ASSERT_TRUE(result.done) << joint << force << result.message;
        const bool moves = force > 4.0;
        const double half = stepping == Stepping::kEvent ? 0.5 : 0.505;
        EXPECT_NEAR(result.values[0], moves ? half * 0.5 / 4.0 : 0.0, 1e-9) << joint << force;
        EXPECT_NEAR(result.values[6], 1.0 + result.values[0], 1e-12) << joint << force;
        EXPECT_NEAR(result.jacobian(0, 0), moves ? half / 4.0 : 0.0, 1e-8) << joint << force;
      }
    }
  }
}

// An arm of two links comes to rest with friction of both hinges, a motor and two supports: the
// dampers have to tell of the second support too what it holds.
TEST(SupportSharesTest, BothLinksOfAnArmComeToRest) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 0.2, "inertia": 0.02, "position": [0.3, 0],
       "support": {"friction": 0.3,
                   "points": [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]}},
      {"name": "b", "mass": 2, "inertia": 0.02, "position": [0.9, 0],
       "support": {"friction": 0.3}}],
      "joints": [
        {"name": "j", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
         "friction": 0.05, "stiffness": 5},
        {"name": "k", "type": "revolute", "bodies": ["b", "a"], "anchor": [0.6, 0],
         "rate": 0.5, "friction": 0.05, "motor": {"speed": 0, "limit": 0.1}}],
      "forces": [{"name": "f", "body": "b", "force": [0.5, 1]}],
      "simulation": {"dt": 1e-4, "duration": 0.08}})");
  const GradientResult result = Jacobian(scene, {"joints/k/rate"}, GradientMethod::kTangent);
  ASSERT_TRUE(result.done) << result.message;
  for (const int i : {3, 4, 5, 9, 10, 11}) EXPECT_NEAR(result.values[i], 0.0, 1e-15) << i;
}

// A force along the rail that is exactly as large as the friction is held, beside one across it.
TEST(SupportSharesTest, AForceAtTheLimitIsHeld) {
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    for (const char* support :
         {R"({"friction": 0.2, "load": 10})", R"({"friction": 0.2, "load": 10, "radius": 0.1})"}) {
      for (const char* force : {"[2, 5]", "[2, 0.1]", "[-2, 0]"}) {
        Scene scene = OnARail(support, "[1, 0]", force, stepping);
        scene.simulation.dt = 0.05;
        const GradientResult result = Jacobian(scene, {"bodies/b/mass"}, GradientMethod::kTangent);
        ASSERT_TRUE(result.done) << result.message;
        EXPECT_NEAR(result.values[0], 0.3, 1e-15) << support << force;
      }
    }
  }
}

// An arm whose two points are in line with its pivot: both slide across the arm, also where a body
// alone would turn about its centre. Torque 1 N m of friction, for all masses and steps.
TEST(SupportSharesTest, AnArmOnPointsInLineWithItsPivot) {
  for (const double mass : {0.5, 1.0, 1.001, 1.5}) {
    for (const double dt : {0.1, 0.05, 0.02, 0.01}) {
      for (const double torque : {0.95, 1.05, 1.2}) {
        Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
            {"name": "b", "mass": 1, "inertia": 0.01, "position": [0.5, 0],
             "support": {"friction": 0.2, "load": 10, "points": [[0.1, 0], [-0.1, 0]]}}],
            "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"],
                        "anchor": [0, 0]}],
            "forces": [{"name": "f", "body": "b", "torque": 1}],
            "simulation": {"dt": 0.1, "duration": 0.2, "joint_correction": "projection"}})");
        scene.bodies[0].mass = mass;
        scene.simulation.dt = dt;
        scene.forces[0].torque = torque;
        const GradientResult result =
            Jacobian(scene, {"forces/f/torque"}, GradientMethod::kTangent);
        ASSERT_TRUE(result.done) << result.message;
        const double rate = torque > 1.0 ? 0.2 * (torque - 1.0) / (0.01 + 0.25 * mass) : 0.0;
        EXPECT_NEAR(result.values[5], rate, 1e-3 * rate + 1e-12) << mass << " " << dt;
      }
    }
  }
}

// A body that turns about its support is not at rest, though the support is: the friction of a
// hinge slows it down, angle w^2 I / (2 tau).
TEST(SupportSharesTest, FrictionOfAHingeSlowsABodyThatTurnsAboutItsSupport) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 1, "inertia": 0.01, "position": [0, 0], "support": {"friction": 0.2}}],
      "joints": [{"name": "j", "type": "revolute", "bodies": ["b", "world"], "anchor": [0, 0],
                  "rate": 1, "friction": 0.02}],
      "simulation": {"dt": 0.02, "duration": 1, "stepping": "event"}})");
  const std::vector<std::string> paths = {"joints/j/rate", "joints/j/friction"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kTangent);
  ASSERT_TRUE(result.done) << result.message;
  EXPECT_NEAR(result.values[2], 0.25, 1e-9);
  EXPECT_NEAR(result.jacobian(2, 0), 0.5, 1e-7);
  EXPECT_NEAR(result.jacobian(2, 1), -12.5, 1e-6);
}

// A brake and a support hold a body together: it goes with the speed of the brake where that is the
// stronger one, else not at all, which their rows do not tell.
TEST(SupportSharesTest, ABrakeBesideASupportHasNoDerivativeBySpeed) {
  for (const char* stepping : {"fixed", "event"}) {
    for (const char* limit : {"3", "1"}) {
      const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [{"name": "b", "mass": 1,
          "inertia": 1, "position": [0, 0], "support": {"friction": 0.2, "load": 10}}],
          "joints": [{"name": "rail", "type": "prismatic", "bodies": ["b", "world"],
          "anchor": [0, 0], "axis": [1, 0], "motor": {"speed": 0, "limit": )" +
                                  std::string(limit) + R"(}}],
          "simulation": {"dt": 0.02, "duration": 0.1, "stepping": ")" +
                                  stepping + R"("}})");
      const auto verdict = [&](const char* path) {
        return Jacobian(scene, {path}, GradientMethod::kTangent).certificate.verdict;
      };
      EXPECT_EQ(verdict("joints/rail/motor/speed"),
                "one-sided: redundant contacts contradict the change of a parameter")
          << stepping << limit;
      EXPECT_EQ(verdict("bodies/b/mass"), "trustworthy") << stepping << limit;
    }
  }
}

// A car on its support and a body that a rail's friction of 2 N holds on it are braked by 3 N each,
// and stop at 2 v / 6 = 0.4 s, the end of a step: there the body begins to slide, with
// (F + 2) (T - t).
TEST(SupportSharesTest, WhatStopsOnAStepsEndWhileAnotherRowBeginsToSlide) {
  for (const double dt : {0.01, 0.05, 0.0073}) {
    Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "car", "mass": 1, "inertia": 1, "position": [0, 0],
         "velocity": [1.2000000000000002, 0], "support": {"friction": 0.3, "load": 10}},
        {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0],
         "velocity": [1.2000000000000002, 0]}],
        "joints": [{"name": "r", "type": "prismatic", "bodies": ["b", "car"], "anchor": [0, 0],
                    "axis": [1, 0], "friction": 2}],
        "forces": [{"name": "f", "body": "b", "force": [-3, 0]}],
        "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
    scene.simulation.dt = dt;
    const std::vector<std::string> paths = {"bodies/car/support/friction", "forces/f/force/x"};
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    ASSERT_TRUE(result.done) << result.message;
    EXPECT_NEAR(result.values[6 + 3], -0.6, 1e-9) << dt;
    EXPECT_NEAR(result.jacobian(6, 0), -0.8, 1e-7) << dt;
    EXPECT_NEAR(result.jacobian(6, 1), 0.26, 1e-7) << dt;
    EXPECT_NEAR(result.jacobian(6 + 3, 0), -2.0 / 3.0, 1e-7) << dt;
    EXPECT_NEAR(result.jacobian(6 + 3, 1), 2.0 / 3.0, 1e-7) << dt;
    ExpectOthersAgree(scene, paths, result);
  }
}

// Links of 0.2 m that stand on points at their hinges, the first of an arm at its pivot, and are
// pushed at the tip.
Scene Links(int num, bool has_pivot, double push, double dt, Stepping stepping) {
  std::string bodies, joints;
  for (int i = 0; i < num; ++i) {
    const std::string name = std::to_string(i);
    bodies += std::string(i > 0 ? "," : "") + R"({"name": "l)" + name +
              R"(", "mass": 0.5, "shape": {"box": {"size": [0.2, 0.04]}}, "position": [)" +
              std::to_string(0.1 + 0.2 * i) + R"(, 0],
              "support": {"friction": 0.3, "points": [[0.1, 0], [-0.1, 0]]}})";
    if (i == 0 && !has_pivot) continue;
    joints += std::string(joints.empty() ? "" : ",") + R"({"name": "j)" + name +
              R"(", "type": "revolute", "bodies": ["l)" + name + R"(", ")" +
              (i == 0 ? "world" : "l" + std::to_string(i - 1)) + R"("], "anchor": [)" +
              std::to_string(0.2 * i) + ", 0]}";
  }
  Scene scene =
      SceneOf(R"({"gravity": [0, 0], "bodies": [)" + bodies + R"(], "joints": [)" + joints +
              R"(], "forces": [{"name": "f", "body": "l)" + std::to_string(num - 1) +
              R"(", "at": [0.1, 0], "force": [0, 1]}],
              "simulation": {"dt": 0.01, "duration": 0.5}})");
  scene.forces[0].force.y() = push;
  scene.simulation.dt = dt;
  scene.simulation.stepping = stepping;
  return scene;
}

// What their friction at rest shares is found by fixed steps, where a point at a pivot has no
// velocity and a link must not be taken to be held as a whole, and by events.
TEST(SupportSharesTest, LinksThatStandOnTheirHinges) {
  const auto end = [](const Scene& scene) {
    Model<double> model;
    State<double> state, final;
    BuildModel(scene, &model, &state);
    const RolloutReport report = Rollout(model, state, nullptr, &final);
    EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
    return VectorX<double>(Eigen::Map<VectorX<double>>(final.pose.data(), 3 * scene.bodies.size()));
  };
  const VectorX<double> coarse = end(Links(3, false, 3.0, 2e-3, Stepping::kFixed));
  const VectorX<double> fine = end(Links(3, false, 3.0, 1e-3, Stepping::kFixed));
  EXPECT_GT(fine[7], 0.328);  // the last one has moved by 0.3 m
  EXPECT_LT((coarse - fine).cwiseAbs().maxCoeff(), 0.01);
  // At first order.
  const VectorX<double> arm = end(Links(2, true, 4.0, 1e-3, Stepping::kFixed));
  const VectorX<double> finer = end(Links(2, true, 4.0, 5e-4, Stepping::kFixed));
  const VectorX<double> by_events = end(Links(2, true, 4.0, 0.01, Stepping::kEvent));
  EXPECT_LT((2.0 * finer - arm - by_events).cwiseAbs().maxCoeff(), 5e-4);
  end(Links(2, false, 2.0, 0.01, Stepping::kEvent));
}

// An impact that restitution makes as a step ends is that of a moment before, or behind.
TEST(SupportSharesTest, AnImpactOnABodyOnItsSupportAsAStepEnds) {
  Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0],
       "velocity": [0.5, 0], "restitution": 0.5},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.5, 0],
       "restitution": 0.5, "support": {"friction": 0.3}}],
      "simulation": {"dt": 0.01, "duration": 0.6}})");
  const GradientResult at = Jacobian(scene, {"bodies/b/position/x"}, GradientMethod::kTangent);
  for (const double apart : {-1e-9, 1e-9}) {
    scene.bodies[1].position.x() = 0.5 + apart;
    const GradientResult beside =
        Jacobian(scene, {"bodies/b/position/x"}, GradientMethod::kTangent);
    EXPECT_LT((beside.values - at.values).cwiseAbs().maxCoeff(), 1e-8);
  }
  EXPECT_EQ(at.certificate.verdict.rfind("of the discrete map: ", 0), 0u);
}

// A pushed box on four points and a disc that it pushes off its middle come to rest together, a
// little in penetration.
TEST(SupportSharesTest, BodiesInContactComeToRestTogether) {
  for (const double dt : {0.01, 0.005, 0.002, 0.001}) {
    Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "box", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 1, "position": [0, 0],
         "velocity": [0.5, 0], "friction": 0.25, "support": {"friction": 0.5,
         "points": [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]}},
        {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 2, "position": [0.2, 0.02],
         "velocity": [0.5, 0], "friction": 0.25, "support": {"friction": 0.5}}],
        "simulation": {"dt": 0.01, "duration": 0.3}})");
    scene.simulation.dt = dt;
    const GradientResult result =
        Jacobian(scene, {"bodies/disc/mass"}, GradientMethod::kTangent, CertificatePass::kSkip);
    EXPECT_TRUE(result.done) << result.message;
    if (!result.done) continue;
    EXPECT_LT(std::abs(result.values[3]) + std::abs(result.values[9]), 1e-6) << dt;
  }
}

// The pose of the first body at the end, of a run that is done.
std::vector<double> EndOf(const Scene& scene) {
  Model<double> model;
  State<double> state, final;
  BuildModel(scene, &model, &state);
  const RolloutReport report = Rollout(model, state, nullptr, &final);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  std::vector<double> end(final.pose.begin(), final.pose.begin() + 3);
  end.insert(end.end(), final.twist.begin(), final.twist.begin() + 3);
  return end;
}

// A rope that becomes taut is 1e-15 m too long, or too short, where its body comes to rest.
TEST(SupportSharesTest, ABodyOnATautRopeComesToRest) {
  for (const double dt : {0.01, 0.005, 0.002}) {
    Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "b", "mass": 1, "inertia": 0.01, "position": [0.2, 0], "velocity": [1, 0],
         "angular_velocity": 1, "support": {"friction": 0.3, "points": [[-0.2, 0], [0.2, 0]]}}],
        "joints": [{"name": "rope", "type": "distance", "bodies": ["b", "world"],
                    "anchors": [[0.4, 0], [0.3, -0.3]], "limits": [0, 0.4]}],
        "simulation": {"dt": 0.01, "duration": 0.8}})");
    scene.simulation.dt = dt;
    const std::vector<double> end = EndOf(scene);
    EXPECT_NEAR(end[0], 0.3651, 0.01) << dt;  // where it stops by events
    for (int i = 3; i < 6; ++i) EXPECT_NEAR(end[i], 0.0, 1e-9) << dt;
  }
}

// A single point keeps nothing from turning: where it comes to rest its body goes on about it.
// Against an integrator of smoothed friction.
TEST(SupportSharesTest, ASinglePointThatRestsIsAPivot) {
  Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "l0", "mass": 1, "inertia": 0.01, "position": [0.2, 0], "angular_velocity": 3},
      {"name": "l1", "mass": 1, "inertia": 0.01, "position": [0.6, 0],
       "support": {"friction": 0.3, "points": [[0, 0]]}}],
      "joints": [{"name": "j1", "type": "revolute", "bodies": ["l1", "l0"], "anchor": [0.4, 0]}],
      "simulation": {"dt": 0.01, "duration": 0.5, "stepping": "event"}})");
  EXPECT_NEAR(EndOf(scene)[0], 0.263556, 2e-6);
}

// A limit that stops an arm on its disc in the first step leaves no direction for its friction.
TEST(SupportSharesTest, AnArmThatItsLimitStopsAtOnce) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "l0", "mass": 1, "inertia": 0.003333333, "angle": 0.5,
       "position": [0.087758256189, 0.04794255386], "support": {"friction": 0.3, "radius": 0.1}},
      {"name": "l1", "mass": 1, "inertia": 0.003333333, "angle": 0.5,
       "position": [0.263274768567, 0.143827661581], "support": {"friction": 0.3, "radius": 0.1}}],
      "joints": [{"name": "j0", "type": "revolute", "bodies": ["l0", "world"], "anchor": [0, 0],
                  "limits": [-0.5, 0], "rate": 3},
                 {"name": "j1", "type": "revolute", "bodies": ["l1", "l0"],
                  "anchor": [0.175516512378, 0.095885107721]}],
      "simulation": {"dt": 0.002, "duration": 0.1}})");
  EXPECT_LT(EndOf(scene)[2], 0.5 + 1e-9);
}

// Nine boxes on a table, 1.7 mm apart, that a disc strikes: they turn against each other, overlap
// by the error of a step, and come to rest so.
Scene StruckGrid(double dt) {
  std::string boxes;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      boxes += R"(, {"name": "b)" + std::to_string(i) + std::to_string(j) +
               R"(", "shape": {"box": {"size": [0.2, 0.2]}}, "friction": 0.2, "restitution": 0.1,
                     "support": {"friction": 0.3, "points": [[0.08, 0.08], [-0.08, 0.08],
                                                             [-0.08, -0.08], [0.08, -0.08]]},
                     "mass": )" +
               test_scenes::Text(0.5 + 0.01 * i + 0.013 * j) + R"(, "position": [)" +
               test_scenes::Text(0.2017 * i) + ", " + test_scenes::Text(0.2017 * j) + "]}";
    }
  }
  return SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "cue", "shape": {"circle": {"radius": 0.05}}, "mass": 1, "position": [-0.4, 0.073],
       "velocity": [2, 0], "friction": 0.1, "restitution": 0.3,
       "support": {"friction": 0.1, "radius": 0.05}})" +
                 boxes + R"(], "simulation": {"duration": 0.4, "dt": )" + test_scenes::Text(dt) +
                 "}}");
}

TEST(SupportSharesTest, AGridOfBoxesThatIsStruckComesToRest) {
  for (const double dt : {0.01, 0.005}) {
    Model<double> model;
    State<double> state, final;
    BuildModel(StruckGrid(dt), &model, &state);
    const RolloutReport report = Rollout(model, state, {}, &final);
    ASSERT_EQ(report.status, StepStatus::kDone) << dt << " " << report.message;
    EXPECT_LE(report.residual, 1e-10) << dt;
    EXPECT_GT(final.pose[3], 1e-3) << "the first box has moved";
    EXPECT_EQ(final.twist[3 * 9], 0.0) << "and the last one rests";
  }
}

}  // namespace
}  // namespace tangible
