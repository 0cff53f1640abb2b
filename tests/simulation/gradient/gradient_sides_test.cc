// SPDX-License-Identifier: Apache-2.0
// One-sided derivatives of event stepping, against closed forms, and where there are none.
#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "../../support/starts.h"
#include "tangible/simulation/gradient/gradient.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

constexpr double kTime = 0.0625;
constexpr char kFloor[] = R"({"name": "floor", "static": true, "friction": 0.5,
    "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}})";

Scene Of(const std::string& bodies, const std::string& more = "") {
  return SceneOf(R"({"gravity": [0, -8], "bodies": [)" + bodies + ", " + kFloor + "]" + more +
                 R"(, "simulation": {"dt": 0.0078125, "duration": 0.0625, "stepping": "event",
                     "integrator": "trapezoidal"}})");
}

GradientResult Sided(const Scene& scene, const std::string& path, DerivativeSide side) {
  return FinalStateJacobian(scene, testing::Resolve(scene, {path}),
                            {.method = GradientMethod::kTangent, .side = side});
}

double Plus(const Scene& scene, const std::string& path, int row) {
  const GradientResult result = Sided(scene, path, DerivativeSide::kPlus);
  EXPECT_TRUE(result.done) << result.message;
  EXPECT_FALSE(result.notes.empty());
  return result.done ? result.jacobian(row, 0) : NAN;
}

double Minus(const Scene& scene, const std::string& path, int row) {
  const GradientResult result = Sided(scene, path, DerivativeSide::kMinus);
  EXPECT_TRUE(result.done) << result.message;
  EXPECT_FALSE(result.notes.empty());
  return result.done ? result.jacobian(row, 0) : NAN;
}

TEST(GradientSidesTest, ABoxPushedWithItsFriction) {
  const Scene scene = Of(R"({"name": "box", "shape": {"box": {"size": [1, 0.5]}}, "mass": 1,
      "position": [0, 0.25], "friction": 0.5})",
                         R"(, "forces": [{"name": "push", "body": "box", "force": [4, 0]}])");
  // vx = t (ΔF − m g Δμ) / m where that is positive.
  EXPECT_NEAR(Plus(scene, "forces/push/force/x", 3), kTime, 1e-10);
  EXPECT_NEAR(Minus(scene, "forces/push/force/x", 3), 0.0, 1e-10);
  EXPECT_NEAR(Plus(scene, "bodies/*/friction", 3), 0.0, 1e-10);
  EXPECT_NEAR(Minus(scene, "bodies/*/friction", 3), -8.0 * kTime, 1e-10);
  EXPECT_NEAR(Plus(scene, "forces/push/force/x", 0), 0.5 * kTime * kTime, 1e-10);
}

// A block that is released on a slope slides at once: at g cos α below that of a slope without
// friction, as for any friction nearby, from both sides and without an alarm.
TEST(GradientSidesTest, ABlockReleasedOnASlope) {
  for (const auto& [along, across, friction] :
       {std::tuple(7.514895986997175, -6.305746451024952, 0.5256), std::tuple(-6.0, -8.0, 0.25),
        std::tuple(1.0, -9.75, 0.0625)}) {
    Scene scene = Of(R"({"name": "block", "shape": {"box": {"size": [0.1, 0.05]}}, "mass": 0.0822,
        "position": [0, 0.025], "friction": 0.5})");
    scene.gravity = Vector2<double>(along, across);
    for (auto& body : scene.bodies) body.friction = friction;
    for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
      scene.simulation.stepping = stepping;
      scene.simulation.integrator.reset();
      const std::vector<std::string> paths = {"bodies/*/friction", "gravity/x",
                                              "bodies/block/mass"};
      // By fixed steps a step moves with its end's speed.
      const double way = 0.5 * kTime * (kTime + (stepping == Stepping::kFixed ? 0.0078125 : 0.0));
      const double downhill = along > 0.0 ? 1.0 : -1.0;
      const double exact[] = {downhill * across * way, way, 0.0};
      for (const GradientMethod method :
           {GradientMethod::kTangent, GradientMethod::kAdjoint, GradientMethod::kJetImplicit,
            GradientMethod::kFiniteDifference}) {
        const GradientResult both = testing::Jacobian(scene, paths, method);
        EXPECT_EQ(both.certificate.verdict, "trustworthy") << along << " " << NameOf(method);
        for (int k = 0; k < 3; ++k) {
          EXPECT_NEAR(both.jacobian(0, k), exact[k], 1e-9) << paths[k] << " " << NameOf(method);
        }
      }
      for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
        for (int k = 0; k < 3; ++k) {
          const GradientResult one = Sided(scene, paths[k], side);
          ASSERT_TRUE(one.done) << one.message;
          EXPECT_NEAR(one.jacobian(0, 0), exact[k], 1e-9) << paths[k] << " " << along;
        }
      }
    }
  }
}

// The friction of a box at rest is 4 N, so that a push which begins a little before a step holds it
// for that step.
TEST(GradientSidesTest, AForceThatBeginsOrEndsOnAFixedStepsEnd) {
  Scene scene = Of(R"({"name": "box", "shape": {"box": {"size": [1, 0.5]}}, "mass": 1,
      "position": [0, 0.25], "friction": 0.5})",
                   R"(, "forces": [{"name": "push", "body": "box", "force": [8, 0],
                        "start": 0.015625, "end": 0.03125}])");
  scene.simulation.stepping = Stepping::kFixed;
  scene.simulation.integrator.reset();
  const double h = scene.simulation.dt;
  // Two steps of the push, which accelerate by 4 m/s², two more until friction has stopped it: the
  // last of those ends at rest.
  for (const auto& [path, side, x] :
       {std::tuple("forces/push/start", DerivativeSide::kPlus, -8.0 * 3.0 * h),
        std::tuple("forces/push/start", DerivativeSide::kMinus, 0.0),
        std::tuple("forces/push/end", DerivativeSide::kPlus, 8.0 * 2.0 * h),
        std::tuple("forces/push/end", DerivativeSide::kMinus, 8.0 * 2.0 * h)}) {
    const GradientResult result = Sided(scene, path, side);
    ASSERT_TRUE(result.done) << path << " " << result.message;
    GradientOptions differences;
    differences.method = GradientMethod::kFiniteDifference;
    const double sign = side == DerivativeSide::kPlus ? 1.0 : -1.0;
    const double way = 1e-4 * h;
    Scene beside = scene;
    (std::string(path) == "forces/push/start" ? *beside.forces[0].start : *beside.forces[0].end) +=
        sign * way;
    const VectorX<double> moved =
        FinalStateJacobian(beside, testing::Resolve(beside, {path}), differences).values;
    EXPECT_NEAR((moved[0] - result.values[0]) / (sign * way), x, 1e-9) << path;
    EXPECT_NEAR(result.jacobian(0, 0), x, 1e-9) << path;
  }
}

// Rows of `lowest`, `lowest` − 1, ... boxes at rest, of which a spring pulls two of the last row
// but one together.
Scene PileOf(int lowest, const char* friction, Stepping stepping) {
  std::string bodies;
  std::vector<std::string> centres;
  for (int row = 0; row < lowest; ++row) {
    for (int i = 0; i < lowest - row; ++i) {
      centres.push_back(std::to_string(0.35 * i + 0.175 * row) + ", " +
                        std::to_string(0.1 + 0.2 * row));
      bodies += (centres.size() > 1 ? ", " : "") + std::string(R"({"name": "b)") +
                std::to_string(centres.size() - 1) +
                R"(", "shape": {"box": {"size": [0.3, 0.2]}}, "mass": 1, "friction": )" + friction +
                R"(, "position": [)" + centres.back() + "]}";
    }
  }
  const size_t count = centres.size();
  Scene scene =
      Of(bodies, R"(, "springs": [{"name": "s", "bodies": ["b)" + std::to_string(count - 3) +
                     R"(", "b)" + std::to_string(count - 2) + R"("], "anchors": [[)" +
                     centres[count - 3] + "], [" + centres[count - 2] +
                     R"(]], "stiffness": 10, "rest_length": 0.25}])");
  scene.simulation.stepping = stepping;
  if (stepping == Stepping::kFixed) scene.simulation.integrator.reset();
  return scene;
}

// Redundant contacts share their friction in many ways, one of which is at its limit.
TEST(GradientSidesTest, NothingMovesAPileAtRest) {
  for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
    const Scene scene = PileOf(4, "0.5", stepping);
    for (const char* path : {"bodies/b7/velocity/x", "bodies/b7/mass", "gravity/y"}) {
      for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
        const GradientResult result = Sided(scene, path, side);
        ASSERT_TRUE(result.done) << path << " " << result.message;
        EXPECT_LE(result.jacobian.cwiseAbs().maxCoeff(), 1e-9) << path;
      }
    }
  }
}

// By fixed steps of 0.05 s a wall whose face is at 0.4 m stops a disc of radius 0.2 m on the end of
// the second step, where the gap is 0 to rounding. Beside that it stops a step earlier or later, in
// the end at the same place with the same loss of speed along the wall.
TEST(GradientSidesTest, ADiscThatAWallStopsOnAFixedStepsEnd) {
  const auto scene_of = [](const std::string& friction, const std::string& along) {
    return SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "disc", "shape": {"circle": {"radius": 0.2}}, "mass": 0.5, "position": [0, 0],
         "velocity": [2, )" +
                   along + R"(], "friction": )" + friction + R"(},
        {"name": "wall", "static": true, "shape": {"box": {"size": [1, 4]}},
         "position": [0.9, 0], "friction": )" +
                   friction + R"(}],
        "joints": [{"name": "upright", "type": "fixed_angle", "bodies": ["disc", "world"]}],
        "simulation": {"dt": 0.05, "duration": 0.25}})");
  };
  for (const auto& [friction, along] : {std::pair("0", "0"), std::pair("0.25", "1")}) {
    const Scene scene = scene_of(friction, along);
    for (const char* path :
         {"bodies/disc/velocity/x", "bodies/disc/position/x", "bodies/wall/position/x"}) {
      const GradientResult plus = Sided(scene, path, DerivativeSide::kPlus);
      const GradientResult minus = Sided(scene, path, DerivativeSide::kMinus);
      ASSERT_TRUE(plus.done && minus.done) << plus.message << minus.message;
      for (const GradientMethod method :
           {GradientMethod::kTangent, GradientMethod::kAdjoint, GradientMethod::kJetImplicit}) {
        const GradientResult both =
            FinalStateJacobian(scene, testing::Resolve(scene, {path}), {.method = method});
        ASSERT_TRUE(both.done) << both.message;
        // Its place and its speeds; its way along the wall depends on when it was slowed.
        for (const int row : {0, 3, 4}) {
          EXPECT_NEAR(plus.jacobian(row, 0), minus.jacobian(row, 0), 1e-12) << path << " " << row;
          EXPECT_NEAR(both.jacobian(row, 0), plus.jacobian(row, 0), 1e-12)
              << path << " " << row << " " << NameOf(method) << " " << friction;
        }
      }
    }
  }
}

// What both sides agree on is the derivative, by every method and without an alarm.
TEST(GradientSidesTest, APileAtRestHasNoKinks) {
  for (const auto& [lowest, friction, stepping] :
       {std::tuple(4, "0.5", Stepping::kFixed), std::tuple(4, "0.3", Stepping::kFixed),
        std::tuple(5, "0.25", Stepping::kFixed), std::tuple(3, "0.8", Stepping::kFixed),
        std::tuple(4, "0.5", Stepping::kEvent), std::tuple(3, "0.3", Stepping::kEvent)}) {
    const Scene scene = PileOf(lowest, friction, stepping);
    const std::vector<std::string> paths = {"bodies/b4/velocity/x", "bodies/b4/mass", "gravity/y",
                                            "bodies/*/friction", "springs/s/stiffness"};
    for (const GradientMethod method : {GradientMethod::kTangent, GradientMethod::kAdjoint,
                                        GradientMethod::kJet, GradientMethod::kJetImplicit}) {
      if (stepping == Stepping::kEvent && method != GradientMethod::kTangent) continue;
      GradientOptions options;
      options.method = method;
      const GradientResult result =
          FinalStateJacobian(scene, testing::Resolve(scene, paths), options);
      ASSERT_TRUE(result.done) << result.message;
      const std::string where = std::to_string(lowest) + " boxes in the lowest row, friction " +
                                friction + ", method " + std::to_string(static_cast<int>(method));
      EXPECT_LE(result.jacobian.cwiseAbs().maxCoeff(), 1e-12) << where;
      EXPECT_EQ(result.certificate.verdict, "trustworthy") << where;
    }
  }
}

TEST(GradientSidesTest, ADiscPulledUpWithItsWeight) {
  const Scene scene = Of(R"({"name": "disc", "shape": {"circle": {"radius": 0.5}}, "mass": 2,
      "position": [0, 0.5], "friction": 0.5})",
                         R"(, "forces": [{"name": "pull", "body": "disc", "force": [0, 16]}])");
  EXPECT_NEAR(Plus(scene, "forces/pull/force/y", 4), kTime / 2.0, 1e-10);
  EXPECT_NEAR(Minus(scene, "forces/pull/force/y", 4), 0.0, 1e-10);
  // Heavier it stays, lighter it rises: v = t (F / m − g).
  EXPECT_NEAR(Plus(scene, "bodies/disc/mass", 4), 0.0, 1e-10);
  EXPECT_NEAR(Minus(scene, "bodies/disc/mass", 4), -kTime * 16.0 / 4.0, 1e-9);
}

TEST(GradientSidesTest, BesideAJumpThereIsNone) {
  // Turned by whatever angle, a box that lands flat lands on one corner first.
  const Scene scene = Of(R"({"name": "box", "shape": {"box": {"size": [1, 0.5]}}, "mass": 1,
      "position": [0, 0.30], "velocity": [0, -2], "friction": 0.5, "restitution": 0.5})");
  for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
    const GradientResult result = Sided(scene, "bodies/box/angle", side);
    EXPECT_FALSE(result.done);
    EXPECT_NE(result.message.find("parameter bodies/box/angle: no derivative from "),
              std::string::npos)
        << result.message;
    EXPECT_NE(result.message.find("jumps by"), std::string::npos) << result.message;
  }
}

TEST(GradientSidesTest, WhereAGapJustClosesThereIsNoneOnTheSideOfTheImpact) {
  // Thrown up with 0.25 m/s the disc rises by 0.25² / 16 m, just to the ceiling: faster it strikes
  // that at a speed of √(2 · 0.25 τ).
  const Scene scene = Of(R"({"name": "disc", "shape": {"circle": {"radius": 0.5}}, "mass": 1,
      "position": [0, 1], "velocity": [0, 0.25], "restitution": 1},
    {"name": "ceiling", "static": true, "restitution": 1,
     "shape": {"half_plane": {"normal": [0, -1], "offset": -1.50390625}}})");
  const GradientResult faster = Sided(scene, "bodies/disc/velocity/y", DerivativeSide::kPlus);
  EXPECT_FALSE(faster.done);
  EXPECT_NE(faster.message.find("no derivative from above"), std::string::npos) << faster.message;
  EXPECT_NEAR(Minus(scene, "bodies/disc/velocity/y", 1), kTime, 1e-10);
}

TEST(GradientSidesTest, AParametersRangeMayEndBeforeTheSideBegins) {
  Scene scene = Of(R"({"name": "box", "shape": {"box": {"size": [1, 0.5]}}, "mass": 1,
      "position": [0, 0.25], "friction": 0.5})",
                   R"(, "forces": [{"name": "push", "body": "box", "force": [8e-9, 0]}])");
  for (BasicBody<double>& body : scene.bodies) {
    body.friction = 1e-9;
  }
  const GradientResult result = Sided(scene, "bodies/*/friction", DerivativeSide::kMinus);
  EXPECT_FALSE(result.done);
  EXPECT_NE(result.message.find("its range ends within"), std::string::npos) << result.message;
}

// (−3 f(p) + 4 f(p + h) − f(p + 2h)) / 2h of a rod's final state by its vertical speed.
VectorX<double> DifferenceOfRods(double friction, double speed_x, double h) {
  const auto final = [&](double speed_y) {
    Model<double> model;
    State<double> state;
    BuildModel(test_scenes::SlidingRod(friction, speed_x, speed_y), &model, &state);
    State<double> after;
    EXPECT_EQ(Rollout(model, state, {}, &after).status, StepStatus::kDone);
    VectorX<double> values(6);
    for (int i = 0; i < 3; ++i) {
      values[i] = after.pose[3 + i];
      values[3 + i] = after.twist[3 + i];
    }
    return values;
  };
  return (-3.0 * final(0.0) + 4.0 * final(h) - final(2.0 * h)) / (2.0 * h);
}

// Thrown up the rod slides on for a flight of 2 v / g before it jams, thrown down it jams at once.
TEST(GradientSidesTest, ARodThatJamsHasADerivativeOfEachSide) {
  const Scene scene = test_scenes::SlidingRod(3.0, -2.0);
  VectorX<double> columns[2];
  for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
    const double sign = side == DerivativeSide::kPlus ? 1.0 : -1.0;
    const GradientResult result = Sided(scene, "bodies/rod/velocity/y", side);
    ASSERT_TRUE(result.done) << result.message;
    const VectorX<double> expected = DifferenceOfRods(3.0, -2.0, sign * 2e-4);
    columns[sign > 0.0 ? 0 : 1] = result.jacobian.col(0);
    for (int i = 0; i < 6; ++i) {
      // Runs are as accurate as the touching tolerance, of 5e-11 m.
      EXPECT_NEAR(result.jacobian(i, 0), expected[i], 2e-5) << i << ", side " << sign;
    }
    // What does not open the contact has both sides, and they are the same.
    const GradientResult along = Sided(scene, "bodies/rod/velocity/x", side);
    ASSERT_TRUE(along.done) << along.message;
    EXPECT_NEAR(along.jacobian(3, 0), 0.514339, 1e-6);
  }
  EXPECT_NEAR(columns[0][3], -0.0686, 1e-4);
  EXPECT_NEAR(columns[0][4], 0.5249, 1e-4);
  EXPECT_NEAR(columns[0][5], 0.7005, 1e-4);
  EXPECT_NEAR(columns[1][3], -0.4305, 1e-4);
  EXPECT_NEAR(columns[1][4], 0.2362, 1e-4);
  EXPECT_NEAR(columns[1][5], 0.9761, 1e-4);
}

// With less friction than jams it both sides are one.
TEST(GradientSidesTest, ARodThatSlidesHasOneDerivative) {
  const double friction = 0.9 * test_scenes::JammingFriction();
  const Scene scene = test_scenes::SlidingRod(friction, -2.0);
  for (const DerivativeSide side : {DerivativeSide::kPlus, DerivativeSide::kMinus}) {
    const double sign = side == DerivativeSide::kPlus ? 1.0 : -1.0;
    const GradientResult result = Sided(scene, "bodies/rod/velocity/y", side);
    ASSERT_TRUE(result.done) << result.message;
    EXPECT_EQ(result.certificate.verdict, "trustworthy");
    const VectorX<double> expected = DifferenceOfRods(friction, -2.0, sign * 2e-4);
    for (int i = 0; i < 6; ++i) {
      EXPECT_NEAR(result.jacobian(i, 0), expected[i], 1e-4 * expected.cwiseAbs().maxCoeff())
          << i << ", side " << sign;
    }
  }
}

// A striker under 1 N that a target of its own mass stops dead, after 1/2 m at `under` m/s^2: a
// heavier target sends it back, against friction, and its load brings it to rest and on; a lighter
// one lets it slide on. By its own speed it stops dead for every one, and there is no kink.
void ExpectStoppedDead(const Scene& scene, double friction, double end) {
  const double onward = 1.0 - friction;
  const double back = 1.0 + friction;
  const double struck = std::sqrt(1.0 + onward);  // at 1 m/s in the beginning
  const double left = end - (struck - 1.0) / onward;
  const double slope = -0.5 * struck;
  EXPECT_NEAR(Plus(scene, "bodies/target/mass", 3), slope * onward / back, 1e-7);
  EXPECT_NEAR(Minus(scene, "bodies/target/mass", 3), slope, 1e-7);
  EXPECT_NEAR(Minus(scene, "bodies/target/mass", 0), slope * left, 1e-7);
  const GradientResult result =
      FinalStateJacobian(scene, testing::Resolve(scene, {"bodies/target/mass"}), {});
  EXPECT_NE(result.certificate.verdict.find("an impact stops it"), std::string::npos)
      << result.certificate.verdict;
}

TEST(GradientSidesTest, AStrikerThatIsStoppedDeadAndDrivenOn) {
  const std::string bodies =
      R"({"gravity": [0, 0], "bodies": [
      {"name": "striker", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0],
       "velocity": [1, 0], "friction": 0, "restitution": 1 SUPPORT},
      {"name": "target", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.7, 0],
       "friction": 0, "restitution": 1}],
      "forces": [{"name": "load", "body": "striker", "force": [1, 0]}] JOINT,
      "simulation": {"duration": 1, "stepping": "event"}})";
  const auto with = [&](const std::string& support, const std::string& joint, double dt) {
    std::string text = bodies;
    text.replace(text.find(" SUPPORT"), 8, support);
    text.replace(text.find(" JOINT"), 6, joint);
    Scene scene = SceneOf(text);
    scene.simulation.dt = dt;
    return scene;
  };
  for (const double dt : {0.01, 0.25}) {
    const std::string rail = R"(, "joints": [{"name": "rail", "type": "prismatic",
        "bodies": ["striker", "world"], "anchor": [0, 0], "axis": [1, 0], "friction": )";
    ExpectStoppedDead(with("", rail + "0.5}]", dt), 0.5, 1.0);
    // Without friction, or held by it, there is no kink.
    for (const char* friction : {"0", "1.25"}) {
      const Scene scene = with("", rail + friction + "}]", dt);
      EXPECT_EQ(FinalStateJacobian(scene, testing::Resolve(scene, {"bodies/target/mass"}), {})
                    .certificate.verdict,
                "trustworthy")
          << friction;
    }
  }
  ExpectStoppedDead(with(R"(, "support": {"load": 1, "friction": 0.5})", "", 0.01), 0.5, 1.0);
}

// A puck at rest under a load beyond its support's friction: v(T) is v0 + a T for a start onward,
// and a T + v0 (F - R) / (F + R) for one against the load.
TEST(GradientSidesTest, APuckAtRestUnderALoadBeyondItsSupport) {
  for (const double load : {8.0, -6.0}) {
    Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "puck", "mass": 1, "inertia": 1, "position": [0, 0],
         "support": {"load": 10, "friction": 0.5}}],
        "forces": [{"name": "f", "body": "puck", "force": [8, 0]}],
        "simulation": {"dt": 0.01, "duration": 0.5, "stepping": "event"}})");
    scene.forces[0].force.x() = load;
    const double slow = (std::abs(load) - 5.0) / (std::abs(load) + 5.0);
    EXPECT_NEAR(Plus(scene, "bodies/puck/velocity/x", 3), load > 0.0 ? 1.0 : slow, 1e-6);
    EXPECT_NEAR(Minus(scene, "bodies/puck/velocity/x", 3), load > 0.0 ? slow : 1.0, 1e-6);
    const GradientResult by_load =
        FinalStateJacobian(scene, testing::Resolve(scene, {"forces/f/force/x"}), {});
    EXPECT_EQ(by_load.certificate.verdict, "trustworthy");
    EXPECT_NEAR(by_load.jacobian(3, 0), 0.5, 1e-9);
  }
}

// A puck that its support stops exactly on the end of a fixed step: v_k = v − k h μ L / m for k up
// to n, where v_n is a little above 0 on one side, and nothing on the other.
TEST(GradientSidesTest, ASupportThatStopsOnAFixedStepsEnd) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "puck", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [1, 0],
       "support": {"load": 10, "friction": 0.5}}],
      "simulation": {"dt": 0.01, "duration": 0.5}})");
  EXPECT_NEAR(Plus(scene, "bodies/puck/velocity/x", 0), 0.2, 1e-7);
  EXPECT_NEAR(Minus(scene, "bodies/puck/velocity/x", 0), 0.19, 1e-7);
  EXPECT_NEAR(Plus(scene, "bodies/puck/support/friction", 0), -0.19, 1e-7);
  EXPECT_NEAR(Minus(scene, "bodies/puck/support/friction", 0), -0.21, 1e-7);
}

// A window that ends, or opens, as its force steps from 1 N to 3 N: what is gained or lost on each
// side is the force of that side. As another force steps, there is one derivative.
TEST(GradientSidesTest, AWindowsEdgeWhereItsOwnSignalSteps) {
  for (const bool is_end : {true, false}) {
    for (const double edge : {0.5, 0.505}) {
      Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
          {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0]}],
          "forces": [{"name": "f", "body": "b", "force": [0, 0], "start": 0.125, "end": 0.875}],
          "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
      Signal load;
      load.time = {0.0, edge};
      load.x = {1.0, 3.0};
      load.y = {0.0, 0.0};
      scene.forces[0].force_signal = load;
      (is_end ? scene.forces[0].end : scene.forces[0].start) = edge;
      const std::string path = is_end ? "forces/f/end" : "forces/f/start";
      for (const Stepping stepping : {Stepping::kEvent, Stepping::kFixed}) {
        // Fixed steps look beside a window's edge where it is on a step's end.
        if (stepping == Stepping::kFixed && edge != 0.5) continue;
        scene.simulation.stepping = stepping;
        EXPECT_NEAR(Plus(scene, path, 3), is_end ? 3.0 : -3.0, 1e-9) << edge;
        EXPECT_NEAR(Minus(scene, path, 3), is_end ? 1.0 : -1.0, 1e-9) << edge;
      }
      scene.simulation.stepping = Stepping::kEvent;
      EXPECT_EQ(
          FinalStateJacobian(scene, testing::Resolve(scene, {path}), {}).certificate.one_sided,
          std::string(is_end ? "end" : "start") + " of force f at " +
              (edge == 0.5 ? "0.5" : "0.505") + " s is where its own signal steps");
      std::swap(scene.forces[0].force_signal->x[0], scene.forces[0].force_signal->x[1]);
      scene.forces[0].force_signal->x[1] = scene.forces[0].force_signal->x[0];
      EXPECT_EQ(FinalStateJacobian(scene, testing::Resolve(scene, {path}), {}).certificate.verdict,
                "trustworthy");
    }
  }
}

// A brake that holds exactly as much as it can: its limit has two sides. The mass has one
// derivative, as nothing moves whatever it is.
TEST(GradientSidesTest, AKinkOnWhichAParameterDoesNotActIsNone) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "mass": 1, "inertia": 0.01, "position": [0, 0]}],
      "joints": [{"name": "j", "type": "prismatic", "bodies": ["b", "world"], "anchor": [0, 0],
                  "axis": [1, 0], "effort": 2, "motor": {"speed": 0, "limit": 2}}],
      "simulation": {"dt": 0.01, "duration": 0.2, "stepping": "event"}})");
  const auto verdict = [&](const char* path) {
    return FinalStateJacobian(scene, testing::Resolve(scene, {path}), {}).certificate.verdict;
  };
  EXPECT_EQ(verdict("bodies/b/mass"), "trustworthy");
  EXPECT_EQ(verdict("joints/j/motor/limit").find("near a kink"), 0u)
      << verdict("joints/j/motor/limit");
}

// A ball that falls without gravity touches the floor without load after an inelastic impact.
TEST(GradientSidesTest, AContactWithoutLoadIsNoKinkOfWhatSlidesAlong) {
  const Scene scene = SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1.1],
       "velocity": [0.5, -2]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.01, "duration": 0.9, "stepping": "event"}})");
  const GradientResult result = FinalStateJacobian(
      scene, testing::Resolve(scene, {"bodies/b/velocity/x", "bodies/b/velocity/y"}), {});
  EXPECT_EQ(result.certificate.verdict, "trustworthy");
  EXPECT_NEAR(result.jacobian(0, 0), 0.9, 1e-9);
  EXPECT_NEAR(result.jacobian(1, 1), 0.0, 1e-9);
}

}  // namespace
}  // namespace tangible
