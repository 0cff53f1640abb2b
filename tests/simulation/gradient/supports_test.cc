// SPDX-License-Identifier: Apache-2.0
//
// Bodies on a table seen from above, by fixed steps, against closed forms of the discrete and of
// the continuous motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;
using testing::ExpectOthersAgree;
using testing::Jacobian;

constexpr double kG = 9.81;

// One body "b" of 2 kg with these keys, and what the scene has beside it.
Scene Table(const std::string& keys, double dt, double duration,
            const std::string& gravity = "0, 0", const std::string& rest = "") {
  return SceneOf(R"({"gravity": [)" + gravity + R"(], "bodies": [{"name": "b", "mass": 2, )" +
                 keys + "}" + rest + R"(], "simulation": {"dt": )" + std::to_string(dt) +
                 R"(, "duration": )" + std::to_string(duration) + "}}");
}

const char kSlides[] =
    R"("inertia": 0.1, "position": [0.5, 0.2], "velocity": [0.6, 0.8], "angular_velocity": 3,
       "support": {"friction": 0.25})";

// v_k = v − k μ g h along its direction until it would turn round; then rest, to the bit.
TEST(SupportsTest, ABlockSlidesStraightAndStops) {
  const double h = 0.01, a = 0.25 * kG;
  const int n = static_cast<int>(std::floor(1.0 / (a * h)));  // steps after which it moves
  const Scene scene = Table(kSlides, h, 1.0);
  const std::vector<std::string> paths = {"bodies/b/velocity/x", "bodies/b/support/friction",
                                          "bodies/b/mass", "bodies/b/angle"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  const double way = h * (n - 0.5 * a * h * n * (n + 1));
  EXPECT_NEAR(result.values[0], 0.5 + 0.6 * way, 1e-13);
  EXPECT_NEAR(result.values[1], 0.2 + 0.8 * way, 1e-13);
  EXPECT_EQ(result.values[3], 0.0);
  EXPECT_EQ(result.values[4], 0.0);
  EXPECT_NEAR(result.values[5], 3.0, 1e-14);  // no torque
  EXPECT_NEAR(way, 0.5 / a, 0.5 * h);         // v² / (2 μ g)
  // The way by the speed n h, which changes along x by 0.6; its direction turns by 0.8 / |v|.
  EXPECT_NEAR(result.jacobian(0, 0), 0.6 * 0.6 * n * h + 0.64 * way, 1e-12);
  EXPECT_NEAR(result.jacobian(1, 0), 0.8 * 0.6 * n * h - 0.48 * way, 1e-12);
  EXPECT_NEAR(result.jacobian(0, 1), -0.6 * 0.5 * kG * h * h * n * (n + 1), 1e-12);
  // The load follows the mass.
  EXPECT_NEAR(result.jacobian(0, 2), 0.0, 1e-13);
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  ExpectOthersAgree(scene, paths, result);
}

TEST(SupportsTest, AGivenLoadDoesNotFollowTheMass) {
  std::string keys = kSlides;
  keys.replace(keys.find("0.25}"), 5, "0.25, \"load\": 19.62}");
  const Scene scene = Table(keys, 0.01, 0.2);
  const std::vector<std::string> paths = {"bodies/b/support/load", "bodies/b/mass"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  const double way = 0.5 * 0.01 * 0.01 * 20 * 21;  // of a unit of deceleration
  EXPECT_NEAR(result.jacobian(0, 0), -0.6 * 0.25 / 2.0 * way, 1e-13);
  EXPECT_NEAR(result.jacobian(0, 1), 0.6 * 0.25 * 19.62 / 4.0 * way, 1e-13);
  ExpectOthersAgree(scene, paths, result);
  ParameterPath path;
  std::string error;
  EXPECT_FALSE(ResolveParameter(Table(kSlides, 0.01, 0.2), "bodies/b/support/load", &path, &error));
  EXPECT_NE(error.find("mass * 9.81"), std::string::npos) << error;
}

// On a tilted table it stays exactly where gravity is within the cone, and slides beyond.
TEST(SupportsTest, ATableThatIsTilted) {
  const std::string keys =
      R"("inertia": 0.1, "position": [0.3, 0.1], "support": {"friction": 0.25})";
  for (const char* support :
       {"0.25", "0.25, \"radius\": 0.2", "0.25, \"points\": [[1, 0], [0, 1]]"}) {
    std::string own = keys;
    own.replace(own.find("0.25"), 4, support);
    const bool turns = support[4] != '\0' && support[7] == 'p';
    const Scene below = Table(own, 0.01, 1.0, turns ? "0.5, -0.5" : "1.4, -2.0");
    const GradientResult rests = Jacobian(below, {"gravity/x"}, GradientMethod::kTangent);
    EXPECT_EQ(rests.values[0], 0.3) << support;
    EXPECT_EQ(rests.values[1], 0.1) << support;
    EXPECT_EQ(rests.values[2], 0.0) << support;
    EXPECT_EQ(rests.jacobian.cwiseAbs().maxCoeff(), 0.0);
    EXPECT_EQ(rests.certificate.verdict, "trustworthy");
  }
  const Scene above = Table(keys, 0.01, 1.0, "1.8, -2.4");
  const std::vector<std::string> paths = {"gravity/x", "gravity/y", "bodies/b/support/friction"};
  const GradientResult slides = Jacobian(above, paths, GradientMethod::kAdjoint);
  const double left = 3.0 - 0.25 * kG;
  const double ways = 0.5 * 0.01 * 0.01 * 100 * 101;
  EXPECT_NEAR(slides.values[0], 0.3 + 0.6 * left * ways, 1e-12);
  EXPECT_NEAR(slides.values[1], 0.1 - 0.8 * left * ways, 1e-12);
  // Along gravity 1, across it the share of the direction.
  EXPECT_NEAR(slides.jacobian(0, 0), (0.36 + 0.64 * left / 3.0) * ways, 1e-12);
  EXPECT_NEAR(slides.jacobian(1, 2), 0.8 * kG * ways, 1e-11);
  ExpectOthersAgree(above, paths, slides);
  // Exactly on the limit it rests, and the derivative has two sides.
  const double limit = 0.25 * 2.0 * kG / 2.0;
  Scene kink = Table(keys, 0.01, 0.1);
  kink.gravity = Vector2<double>(limit, 0.0);
  const GradientResult at_kink = Jacobian(kink, {"gravity/x"}, GradientMethod::kTangent);
  EXPECT_EQ(at_kink.values[0], 0.3);
  EXPECT_EQ(at_kink.certificate.verdict.rfind("near a kink", 0), 0u) << at_kink.certificate.verdict;
}

// Two points turn about their middle: a torque 2 μ (N / 2) a.
TEST(SupportsTest, TwoPointsSpin) {
  const Scene scene = Table(R"("inertia": 0.3, "position": [0.5, 0.2], "angular_velocity": 4,
      "support": {"friction": 0.25, "points": [[0.3, 0], [-0.3, 0]]})",
                            0.001, 0.5);
  const std::vector<std::string> paths = {"bodies/b/support/friction", "bodies/b/inertia",
                                          "bodies/b/support/points/0/x", "bodies/b/mass",
                                          "bodies/b/angular_velocity"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  const double a = 0.25 * 2.0 * kG * 0.3 / 0.3;
  const double ways = 0.5 * 0.001 * 0.001 * 500 * 501;
  EXPECT_NEAR(result.values[2], 4.0 * 0.5 - a * ways, 1e-12);
  EXPECT_NEAR(result.values[5], 4.0 - a * 0.5, 1e-12);
  EXPECT_NEAR(result.values[0], 0.5, 1e-13);
  EXPECT_NEAR(result.jacobian(5, 0), -a / 0.25 * 0.5, 1e-11);
  EXPECT_NEAR(result.jacobian(5, 1), a / 0.3 * 0.5, 1e-11);
  EXPECT_NEAR(result.jacobian(5, 4), 1.0, 1e-12);
  ExpectOthersAgree(scene, paths, result);
}

// A disc that slides and spins stops both at once, with v / (R ω) → 0.653 whatever it started with:
// the ratio comes near slowly, so that steps are a share of the time that is left.
TEST(SupportsTest, ADiscThatSlidesAndSpinsStopsBothAtOnce) {
  for (const char* start : {"\"velocity\": [1, 0], \"angular_velocity\": 3",
                            "\"velocity\": [0.2, 0.1], \"angular_velocity\": 12"}) {
    Scene scene = Table(std::string(R"("shape": {"circle": {"radius": 0.1}}, "position": [0, 0],
        "support": {"friction": 0.25, "radius": 0.1}, )") +
                            start,
                        0.01, 0.6);
    Model<double> model;
    State<double> state;
    BuildModel(scene, &model, &state);
    Stepper stepper(model);
    const auto speed = [&state] { return std::hypot(state.twist[0], state.twist[1]); };
    double now = 0.0;
    for (int k = 0; speed() > 1e-10; ++k) {
      ASSERT_LT(k, 10000);
      const double h = 0.005 * std::max(speed(), 0.1 * state.twist[2]) / (0.25 * kG);
      ASSERT_EQ(stepper.Step(model, now, h, &state).status, StepStatus::kDone);
      now += h;
    }
    EXPECT_NEAR(speed() / (0.1 * state.twist[2]), 0.653, 1e-3) << start;
    ASSERT_EQ(stepper.Step(model, now, 0.01, &state).status, StepStatus::kDone);
    EXPECT_EQ(speed(), 0.0);
    EXPECT_EQ(state.twist[2], 0.0);
  }
}

TEST(SupportsTest, ADiscsDerivatives) {
  const Scene scene = Table(R"("shape": {"circle": {"radius": 0.1}}, "position": [0, 0],
      "velocity": [0.8, 0.3], "angular_velocity": 9,
      "support": {"friction": 0.25, "radius": 0.08, "load": 15})",
                            0.005, 0.8);
  const std::vector<std::string> paths = {"bodies/b/support/friction", "bodies/b/support/radius",
                                          "bodies/b/support/load",     "bodies/b/mass",
                                          "bodies/b/velocity/y",       "bodies/b/angular_velocity"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_EQ(result.values[5], 0.0);
  for (Eigen::Index c = 0; c < result.jacobian.cols(); ++c) {
    EXPECT_GT(result.jacobian.col(c).cwiseAbs().maxCoeff(), 1e-4) << paths[c];
  }
  ExpectOthersAgree(scene, paths, result);
}

// A block on three feet that is pushed off its centre by another one, which a force pushes, with
// friction between them; a wall stops the second.
TEST(SupportsTest, BlocksThatPushEachOther) {
  const std::string block = R"("shape": {"box": {"size": [0.4, 0.3]}}, "position": [0, 0],
      "angle": 0.05, "friction": 0.2, "support": {"friction": 0.2,
      "points": [[0.15, 0.1], [-0.15, 0.1], [0, -0.12]], "shares": [2, 1, 1.5]})";
  Scene scene = Table(block, 0.005, 0.5, "0, 0", R"(,
      {"name": "p", "mass": 1, "shape": {"circle": {"radius": 0.1}}, "position": [-0.32, 0.06],
       "friction": 0.2, "support": {"friction": 0.3, "radius": 0.07}},
      {"name": "wall", "static": true, "shape": {"half_plane": {"normal": [-1, 0], "offset": -0.5}}})");
  BasicForce<double> push;
  push.name = "push";
  push.body = 1;
  push.force = Vector2<double>(14.0, 1.0);
  push.end = 0.3;
  scene.forces.push_back(push);
  const std::vector<std::string> paths = {
      "bodies/b/support/friction", "bodies/b/support/points/1/y", "bodies/b/support/shares/2",
      "bodies/p/support/radius",   "forces/push/force/x",         "bodies/b/mass"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  EXPECT_GT(result.values[0], 0.05);  // it has been moved
  EXPECT_GT(std::abs(result.values[2] - 0.05), 0.02);
  for (Eigen::Index c = 0; c < result.jacobian.cols(); ++c) {
    EXPECT_GT(result.jacobian.col(c).cwiseAbs().maxCoeff(), 1e-6) << paths[c];
  }
  ExpectOthersAgree(scene, paths, result);
}

// A hinge at one end and a foot at the other: a pendulum that friction stops, held with rows of the
// hinge that depend on those of the foot.
TEST(SupportsTest, AnArmOnAHingeIsStopped) {
  Scene scene = Table(R"("inertia": 0.2, "position": [0.4, 0], "velocity": [0, 0.4],
      "angular_velocity": 1, "support": {"friction": 0.25, "points": [[0.4, 0], [0.3, 0.2]]})",
                      0.001, 1.0);
  BasicJoint<double> hinge;
  hinge.name = "hinge";
  hinge.bodies[0] = 0;
  scene.joints.push_back(hinge);
  const std::vector<std::string> paths = {"joints/hinge/rate", "bodies/b/support/friction"};
  const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
  // The arms of the two feet about the hinge.
  const double torque = 0.25 * 2.0 * kG * 0.5 * (0.8 + std::hypot(0.7, 0.2));
  const double turn = 0.5 * (0.2 + 2.0 * 0.16) / torque;
  EXPECT_NEAR(result.values[2], turn, 1e-3);
  EXPECT_NEAR(result.values[5], 0.0, 1e-12);
  EXPECT_NEAR(result.jacobian(2, 1), -turn / 0.25, 0.01);
  ExpectOthersAgree(scene, paths, result);
}

// Pressed against a wall beyond its friction it rests between both.
TEST(SupportsTest, AgainstAWall) {
  for (const char* support :
       {"0.25", "0.25, \"radius\": 0.1", "0.25, \"points\": [[0.1, 0], [-0.1, 0]]"}) {
    const Scene scene =
        Table(std::string(R"("shape": {"circle": {"radius": 0.1}}, "position": [0, 0.1],
        "support": {"friction": )") +
                  support + "}",
              0.01, 0.3, "0, -4", R"(,
        {"name": "wall", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})");
    const GradientResult result = Jacobian(scene, {"gravity/y"}, GradientMethod::kTangent);
    EXPECT_NEAR(result.values[1], 0.1, 1e-12) << support;
    EXPECT_NEAR(result.values[4], 0.0, 1e-12) << support;
  }
}

// What brakes or pushes a puck along its direction leaves that of its friction as it is; across it
// the friction is that of the new speed, m v' = m v - h mu N v' / |v'|. Two pucks that a rod ties,
// and one that meets a wall head on.
TEST(SupportsTest, AcrossAStraightMotionFrictionIsThatOfTheNewSpeed) {
  const Scene tied = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [1, 0],
       "support": {"friction": 1, "load": 1}},
      {"name": "a", "mass": 1, "inertia": 1, "position": [2, 0], "velocity": [1, 0],
       "support": {"friction": 0.5, "load": 1}}],
      "joints": [{"name": "rod", "type": "distance", "bodies": ["b", "a"],
                  "anchors": [[0, 0], [2, 0]]}],
      "simulation": {"dt": 0.1, "duration": 0.1}})");
  const Scene head_on = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 1, "shape": {"circle": {"radius": 0.25}}, "position": [0, 0],
       "velocity": [1, 0], "restitution": 0.5, "friction": 0,
       "support": {"friction": 1, "load": 1}},
      {"name": "wall", "static": true, "restitution": 0.5, "friction": 0,
       "shape": {"half_plane": {"normal": [-1, 0], "offset": -0.25}}}],
      "simulation": {"dt": 0.1, "duration": 0.1}})");
  const std::vector<std::string> paths = {"bodies/b/velocity/y"};
  for (const auto& [scene, speed] : {std::pair(tied, 0.925), std::pair(head_on, 0.5)}) {
    const GradientResult result = Jacobian(scene, paths, GradientMethod::kAdjoint);
    ASSERT_TRUE(result.done) << result.message;
    Eigen::Index of_b = 0;
    while (result.outputs[static_cast<size_t>(of_b)] != "b/vx") ++of_b;
    EXPECT_NEAR(std::abs(result.values[of_b]), speed, 1e-12);
    EXPECT_NEAR(result.jacobian(of_b + 1, 0), 1.0 / (1.0 + 0.1 / speed), 1e-10);
    ExpectOthersAgree(scene, paths, result);
  }
}

// A pusher reaches a block that rests on two points exactly as a step ends: it does not move in
// that step, not even by rounding, and is taken along in the next.
TEST(SupportsTest, APusherArrivesAsAStepEnds) {
  for (const double dt : {0.005, 0.002, 0.001}) {
    for (const char* y : {"0", "0.04", "0.06"}) {
      const Scene scene = Table(
          R"("shape": {"box": {"size": [0.3, 0.2]}}, "position": [0, 0], "friction": 0.2,
             "support": {"friction": 0.2, "points": [[0.1, 0], [-0.1, 0]]})",
          dt, 0.3, "0, 0",
          R"(, {"name": "p", "kinematic": true, "friction": 0.2,
          "shape": {"circle": {"radius": 0.05}}, "velocity": [0.5, 0], "position": [-0.3, )" +
              std::string(y) + "]}");
      Model<double> model;
      State<double> state, final;
      BuildModel(scene, &model, &state);
      const RolloutReport report = Rollout(model, state, nullptr, &final);
      EXPECT_EQ(report.status, StepStatus::kDone) << dt << " " << y << ": " << report.message;
      EXPECT_GT(final.pose[0], 0.02) << dt << " " << y;
      EXPECT_LT(final.pose[0], 0.0501) << dt << " " << y;
    }
  }
}

}  // namespace
}  // namespace tangible
