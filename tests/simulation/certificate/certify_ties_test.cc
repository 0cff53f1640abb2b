// SPDX-License-Identifier: Apache-2.0
//
// By events, what people write in round numbers: two things at one instant, or one exactly at its
// limit. Where both sides differ the verdict says so, and where nothing does it does not.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using test_scenes::Text;
using testing::Jacobian;

std::string ForSeconds(double duration, const std::string& dt = "0.015625") {
  return R"(, "no_contact": [["*", "*"]], "simulation": {"stepping": "event", "dt": )" + dt +
         R"(, "duration": )" + Text(duration) + "}}";
}

std::string VerdictAtTie(const Scene& scene, const std::string& path) {
  return Jacobian(scene, {path}, GradientMethod::kTangent).certificate.verdict;
}

bool Says(const std::string& verdict, const std::string& what) {
  return verdict.find(what) != std::string::npos;
}

// A slider of 2 kg with another body welded to it stops by friction of 16 N in 0.5 s. Released
// before that the other body flies on at the speed of that instant, 4 (0.5 − t).
Scene StopsAsWeldEnds(double until) {
  return SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "w", "mass": 2, "position": [0, 0], "shape": {"circle": {"radius": 0.125}}},
      {"name": "v", "mass": 2, "position": [2, 0], "shape": {"circle": {"radius": 0.125}}}],
    "joints": [{"name": "p", "type": "prismatic", "bodies": ["w", "world"], "anchor": [0, 0],
                "axis": [1, 0], "rate": 2, "friction": 16},
               {"name": "c", "type": "weld", "bodies": ["v", "w"], "anchor": [1, 0],
                "until": )" +
                 Text(until) + "}]" + ForSeconds(1.0));
}

TEST(CertifyTiesTest, AJointThatEndsAsItsBodiesStopIsAKink) {
  for (const char* path : {"joints/c/until", "joints/p/friction", "joints/p/rate"}) {
    const std::string verdict = VerdictAtTie(StopsAsWeldEnds(0.5), path);
    EXPECT_TRUE(Says(verdict, "as joint c ends")) << path << ": " << verdict;
  }
  // Before the stop, and behind it.
  const GradientResult before =
      Jacobian(StopsAsWeldEnds(0.45), {"joints/c/until"}, GradientMethod::kTangent);
  EXPECT_EQ(before.certificate.verdict, "trustworthy");
  EXPECT_NEAR(before.jacobian(9, 0), -4.0, 1e-9);
  EXPECT_EQ(VerdictAtTie(StopsAsWeldEnds(0.55), "joints/c/until"), "trustworthy");
}

// Friction has stopped the disc in 2/3 s: nothing depends on when its joint ends.
TEST(CertifyTiesTest, AJointThatEndsAtRestChangesNothing) {
  for (const double until : {0.6875, 0.703125, 0.71, 0.75, 0.8125}) {
    for (const double friction : {3.0, 6.0, 7.0}) {
      const Scene scene =
          SceneOf(R"({"gravity": [0, 0], "bodies": [
          {"name": "a", "mass": 8, "position": [0, 0], "shape": {"circle": {"radius": 0.5}}}],
        "joints": [{"name": "h", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                    "rate": 2, "friction": )" +
                  Text(friction) + R"(, "until": )" + Text(until) + "}]" + ForSeconds(1.0));
      const GradientResult result = Jacobian(scene, {"joints/h/until"}, GradientMethod::kAdjoint);
      EXPECT_LT(result.jacobian.cwiseAbs().maxCoeff(), 1e-30) << until << " " << friction;
      EXPECT_EQ(result.certificate.verdict, "trustworthy");
      testing::ExpectOthersAgree(scene, {"joints/h/until"}, result);
    }
  }
}

// 2 kg on a vertical slider under 8 m/s², held by a servo of 16 N/m: at its limit of 16 N, or with
// some of it left.
TEST(CertifyTiesTest, AServoThatHoldsWithAllItHasIsAtAKink) {
  const auto scene = [](double limit) {
    return SceneOf(R"({"gravity": [0, -8], "bodies": [
        {"name": "w", "mass": 2, "position": [0, 0], "shape": {"circle": {"radius": 0.125}}}],
      "joints": [{"name": "p", "type": "prismatic", "bodies": ["w", "world"], "anchor": [0, 0],
                  "axis": [0, 1], "effort": {"target": 1, "stiffness": 16, "limit": )" +
                   Text(limit) + "}}]" + ForSeconds(0.5));
  };
  for (const char* path : {"joints/p/effort/target", "gravity/y", "joints/p/effort/limit"}) {
    const std::string verdict = VerdictAtTie(scene(16.0), path);
    EXPECT_TRUE(Says(verdict, "near a kink") && Says(verdict, "stays on its bound"))
        << path << ": " << verdict;
    EXPECT_EQ(VerdictAtTie(scene(16.5), path), "trustworthy") << path;
    EXPECT_EQ(VerdictAtTie(scene(15.5), path), "trustworthy") << path;
  }
}

// A rope becomes taut as the path of its end stops: just before that it pulls, and just after it
// does not.
TEST(CertifyTiesTest, ARopeThatIsTautAsItsEndStopsIsAJump) {
  for (const double limit : {1.5, 1.6}) {
    const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "k", "kinematic": true, "position": [0.5, 0],
         "motion": {"interpolation": "linear", "time": [0, 1, 2], "x": [0.5, 1.5, 1.5]}},
        {"name": "b", "mass": 1, "position": [0, 0], "shape": {"circle": {"radius": 0.1}}}],
      "joints": [{"name": "r", "type": "distance", "bodies": ["b", "k"],
                  "anchors": [[0, 0], [0.5, 0]], "limits": [0, )" +
                                Text(limit) + "]}]" + ForSeconds(1.5));
    const std::string verdict = VerdictAtTie(scene, "joints/r/limits/1");
    EXPECT_EQ(Says(verdict, "discontinuous"), limit == 1.5) << limit << ": " << verdict;
    EXPECT_EQ(verdict == "trustworthy", limit == 1.6) << verdict;
  }
}

// A row of discs on a table that touch, struck at its end. A gap between two of them, however
// small, makes one impact two.
TEST(CertifyTiesTest, ARowThatTouchesJumpsWithItsGapsAlone) {
  const auto disc = [](const std::string& name, double x, double speed) {
    return R"({"name": ")" + name + R"(", "mass": 1, "shape": {"circle": {"radius": 0.1}},
               "restitution": 0.9, "support": {"friction": 0.1, "radius": 0.1},
               "position": [)" +
           Text(x) + R"(, 0], "velocity": [)" + Text(speed) + ", 0]}";
  };
  const Scene scene =
      SceneOf(R"({"gravity": [0, 0], "bodies": [)" + disc("cue", -0.4, 2.0) + ", " +
              disc("a", 0.0, 0.0) + ", " + disc("b", 0.2, 0.0) + ", " + disc("c", 0.4, 0.0) +
              R"(], "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.3}})");
  EXPECT_TRUE(Says(VerdictAtTie(scene, "bodies/a/position/x"), "discontinuous"));
  EXPECT_TRUE(Says(VerdictAtTie(scene, "bodies/c/position/x"), "discontinuous"));
  // What opens no gap changes no impact: all are struck as before.
  for (const char* path : {"bodies/cue/velocity/x", "bodies/cue/position/x", "bodies/b/mass"}) {
    EXPECT_FALSE(Says(VerdictAtTie(scene, path), "discontinuous")) << path;
  }
  EXPECT_EQ(VerdictAtTie(scene, "bodies/cue/velocity/x"), "trustworthy");
}

// Two fingers that touch a block as they begin to push it: they meet it at once whatever its mass.
TEST(CertifyTiesTest, WhatTouchesFromTheStartMeetsAtOnce) {
  const auto finger = [](const std::string& name, const std::string& y) {
    return R"({"name": ")" + name + R"(", "kinematic": true, "shape": {"circle": {"radius": 0.02}},
               "motion": {"interpolation": "linear", "time": [0, 1], "x": [-0.12, 0.08]},
               "position": [-0.12, )" +
           y + "]}";
  };
  const Scene scene =
      SceneOf(R"({"gravity": [0, 0], "no_contact": [["p", "q"]], "bodies": [)" +
              finger("p", "0.06") + ", " + finger("q", "-0.06") +
              R"(, {"name": "b", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 1, "friction": 0.3,
            "position": [0, 0], "support": {"friction": 0.3, "points": [[0.08, 0.08], [-0.08, 0.08], [-0.08, -0.08],
                                                    [0.08, -0.08]]}}],
         "simulation": {"stepping": "event", "dt": 0.01, "duration": 0.2}})");
  EXPECT_EQ(VerdictAtTie(scene, "bodies/b/mass"), "trustworthy");
  EXPECT_NE(VerdictAtTie(scene, "bodies/b/position/x"), "trustworthy");
}

// A double pendulum that gravity presses against the limit of its first hinge, while the second one
// strikes its own as the run starts: a rate that opens the first one, however small, changes that.
TEST(CertifyTiesTest, ALimitThatIsPressedAsTheRunStartsJumpsWithItsRate) {
  const Scene scene = SceneOf(R"({"gravity": [0, -8], "bodies": [
      {"name": "b0", "mass": 2, "position": [0, 0], "shape": {"circle": {"radius": 0.5}}},
      {"name": "b1", "mass": 1, "position": [1, -1], "shape": {"circle": {"radius": 0.5}}}],
    "joints": [
      {"name": "j0", "type": "revolute", "bodies": ["b0", "world"], "anchor": [-0.5, 0],
       "limits": [0, 1], "limit_restitution": 1},
      {"name": "j1", "type": "revolute", "bodies": ["b1", "b0"], "anchor": [0.5, -1], "rate": -1,
       "limits": [0, 1], "limit_restitution": 0}])" +
                              ForSeconds(0.03125));
  EXPECT_TRUE(Says(VerdictAtTie(scene, "joints/j0/rate"), "discontinuous"));
  EXPECT_FALSE(Says(VerdictAtTie(scene, "joints/j1/rate"), "discontinuous"));
}

}  // namespace
}  // namespace tangible
