// SPDX-License-Identifier: Apache-2.0
//
// Two bodies on paths that were recorded together, so that their knots are at the same times:
// derivatives by the delay of each, against closed forms.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using test_scenes::Text;
using testing::ExpectOthersAgree;
using testing::Jacobian;
using testing::JacobianOf;

const std::vector<std::string> kDelays = {"bodies/first/motion/delay",
                                          "bodies/second/motion/delay"};
// Along x at 1, `fast` and 0 m/s, with knots at 0.1 and 0.2 s.
std::string Pusher(const std::string& name, double y, double fast, const std::string& shape) {
  return R"({"name": ")" + name + R"(", "kinematic": true, "shape": )" + shape +
         R"(, "motion": {"interpolation": "linear", "time": [-1, 0.1, 0.2, 9], "x": [-1, 0.1, )" +
         Text(0.1 + 0.1 * fast) + ", " + Text(0.1 + 0.1 * fast) + R"(]}, "position": [0, )" +
         Text(y) + "]}";
}

std::string Block(const std::string& name, double x, double y) {
  return R"({"name": ")" + name + R"(", "shape": {"circle": {"radius": 0.1}}, "mass": 2,
             "position": [)" +
         Text(x) + ", " + Text(y) + "]}";
}

std::string EventsFor(double dt, double duration) {
  return R"(], "gravity": [0, 0], "simulation": {"stepping": "event", "dt": )" + Text(dt) +
         R"(, "duration": )" + Text(duration) + "}}";
}

constexpr char kDisc[] = R"({"circle": {"radius": 0.1}})";

// Both push a disc from 0.05 s on, and let go as they stop: x = x₂ + v (T − 0.2 − delay).
Scene TwoPushed(double dt) {
  return SceneOf(R"({"bodies": [)" + Pusher("first", 0.0, 2.0, kDisc) + ", " +
                 Pusher("second", 1.0, 3.0, kDisc) + ", " + Block("a", 0.25, 0.0) + ", " +
                 Block("b", 0.25, 1.0) + EventsFor(dt, 0.5));
}

TEST(DrivenPairsTest, EachBodyIsPushedByItsOwn) {
  for (const double dt : {0.05, 0.1, 0.02, 0.5}) {
    const Scene scene = TwoPushed(dt);
    const GradientResult result = Jacobian(scene, kDelays, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.values[0], 0.5 + 2.0 * 0.3, 1e-12) << dt;
    EXPECT_NEAR(result.values[6], 0.6 + 3.0 * 0.3, 1e-12) << dt;
    EXPECT_NEAR(result.jacobian(0, 0), -2.0, 1e-9) << dt;
    EXPECT_NEAR(result.jacobian(0, 1), 0.0, 1e-9) << dt;
    EXPECT_NEAR(result.jacobian(6, 0), 0.0, 1e-9) << dt;
    EXPECT_NEAR(result.jacobian(6, 1), -3.0, 1e-9) << dt;
    EXPECT_EQ(result.certificate.verdict, "trustworthy") << dt;
    ExpectOthersAgree(scene, kDelays, result);
  }
}

// The second one's knots matter to nothing: the disc is near both, and the first one pushes it.
TEST(DrivenPairsTest, TheOtherPassesBy) {
  const Scene scene = SceneOf(R"({"bodies": [)" + Pusher("first", 0.3, 3.0, kDisc) + ", " +
                              Pusher("second", 0.0, 2.0, kDisc) + ", " + Block("a", 0.25, 0.0) +
                              EventsFor(0.05, 0.5));
  const GradientResult result = Jacobian(scene, kDelays, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.jacobian(0, 0), 0.0, 1e-9);
  EXPECT_NEAR(result.jacobian(0, 1), -2.0, 1e-9);
  ExpectOthersAgree(scene, kDelays, result);
}

// Both push one disc: their delays together have a derivative, each of them has two.
TEST(DrivenPairsTest, BothPushOneDisc) {
  const Scene scene = SceneOf(R"({"bodies": [)" + Pusher("first", 0.05, 2.0, kDisc) + ", " +
                              Pusher("second", -0.05, 2.0, kDisc) + ", " + Block("a", 0.3, 0.0) +
                              EventsFor(0.05, 0.5));
  const std::vector<std::string> together = {"bodies/*/motion/delay"};
  const GradientResult result = Jacobian(scene, together, GradientMethod::kAdjoint);
  EXPECT_NEAR(result.jacobian(0, 0), -2.0, 1e-9);
  ExpectOthersAgree(scene, together, result);
  const GradientResult apart = JacobianOf(scene, kDelays, GradientMethod::kTangent);
  EXPECT_FALSE(apart.done);
  EXPECT_NE(apart.message.find("the speed of body first and the speed of body second, which both "
                               "change at t = 0.2 s"),
            std::string::npos)
      << apart.message;
}

// A disc that its pusher reaches exactly at a knot of both.
TEST(DrivenPairsTest, AKnotAtTheInstantOfAnImpact) {
  // The second pusher reaches its disc at its knot: it goes on at 3 m/s from there.
  for (const double dt : {0.05, 0.04}) {
    const Scene scene = SceneOf(R"({"bodies": [)" + Pusher("first", 0.0, 2.0, kDisc) + ", " +
                                Pusher("second", 1.0, 3.0, kDisc) + ", " + Block("a", 0.25, 0.0) +
                                ", " + Block("b", 0.37, 1.0) + EventsFor(dt, 0.5));
    const GradientResult result = Jacobian(scene, kDelays, GradientMethod::kAdjoint);
    EXPECT_NEAR(result.jacobian(0, 0), -2.0, 1e-9) << dt;
    EXPECT_NEAR(result.jacobian(6, 0), 0.0, 1e-9) << dt;
    EXPECT_NEAR(result.jacobian(6, 1), -3.0, 1e-9) << dt;
    ExpectOthersAgree(scene, kDelays, result);
  }
}

TEST(DrivenPairsTest, PivotsThatAreShakenTogether) {
  const auto pivot = [](const std::string& name, double x, double v) {
    return R"({"name": ")" + name + R"(", "kinematic": true, "motion": {
        "interpolation": "linear", "time": [-1, 0.2, 0.4, 9], "x": [0, 0, )" +
           Text(v) + ", " + Text(v) + R"(], "offset": [)" + Text(x) + ", 0]}}";
  };
  const auto rod = [](const std::string& name, double x) {
    return R"({"name": ")" + name + R"(", "shape": {"box": {"size": [0.04, 1]}}, "mass": 1,
        "position": [)" +
           Text(x) + R"(, -0.5]})";
  };
  const auto hinge = [](const std::string& pivot_name, const std::string& rod_name, double x) {
    return R"({"name": "h)" + rod_name + R"(", "type": "revolute", "bodies": [")" + pivot_name +
           R"(", ")" + rod_name + R"("], "anchor": [)" + Text(x) + ", 0]}";
  };
  const Scene scene = SceneOf(
      R"({"bodies": [)" + pivot("first", 0.0, 0.05) + ", " + pivot("second", 3.0, -0.08) + ", " +
      rod("a", 0.0) + ", " + rod("b", 3.0) + R"(], "joints": [)" + hinge("first", "a", 0.0) + ", " +
      hinge("second", "b", 3.0) +
      R"(], "gravity": [0, -9.81], "simulation": {"stepping": "event", "dt": 0.005, "duration": 0.8}})");
  const GradientResult result = Jacobian(scene, kDelays, GradientMethod::kAdjoint);
  EXPECT_GT(result.jacobian.col(0).head(6).cwiseAbs().maxCoeff(), 0.1);
  EXPECT_GT(result.jacobian.col(1).tail(6).cwiseAbs().maxCoeff(), 0.1);
  // Where the other one's knot splits a motion changes the integrator's error.
  EXPECT_LT(result.jacobian.col(1).head(6).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_LT(result.jacobian.col(0).tail(6).cwiseAbs().maxCoeff(), 1e-5);
  ExpectOthersAgree(scene, kDelays, result);
}

// A block on a table that two fingers push, of which the second one starts a little later: their
// inelastic impacts end in both contacts at rest, without gravity.
Scene TwoFingers(double y, double later) {
  const auto finger = [](const std::string& name, double at, double delay) {
    return R"({"name": ")" + name + R"(", "kinematic": true, "friction": 0.3,
               "shape": {"circle": {"radius": 0.02}}, "motion": {"delay": )" +
           Text(delay) + R"(, "time": [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
               "x": [-0.124, -0.111, -0.077, -0.029, 0.026, 0.026, 0.026]},
               "position": [-0.124, )" +
           Text(at) + "]}";
  };
  return SceneOf(R"({"no_contact": [["first", "second"]], "bodies": [)" +
                 finger("first", y, 0.013) + ", " + finger("second", -0.071, 0.013 + later) +
                 R"(, {"name": "b", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 1.23,
                       "position": [0, 0], "friction": 0.3, "support": {"friction": 0.3, "points":
                       [[0.08, 0.08], [-0.08, 0.08], [-0.08, -0.08], [0.08, -0.08]]}})" +
                 EventsFor(0.01, 0.5));
}

TEST(DrivenPairsTest, TwoFingersPushABlock) {
  for (const double y : {0.057, 0.071}) {
    for (const double later : {0.0141, 0.0142, 0.015}) {
      const Scene scene = TwoFingers(y, later);
      Model<double> model;
      State<double> initial;
      BuildModel(scene, &model, &initial);
      State<double> final;
      const RolloutReport report = Rollout(model, initial, {}, &final);
      ASSERT_EQ(report.status, StepStatus::kDone) << later << " " << report.message;
      EXPECT_LT(report.events, 250) << y << " " << later;
      EXPECT_GT(final.pose[6], 0.14);
    }
  }
  const GradientResult result =
      Jacobian(TwoFingers(0.057, 0.0141), kDelays, GradientMethod::kAdjoint);
  ExpectOthersAgree(TwoFingers(0.057, 0.0141), kDelays, result);
}

}  // namespace
}  // namespace tangible
