// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../support/drift.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::SceneOf;

constexpr double kGravity = 9.81;

struct Rolled {
  RolloutReport report;
  State<double> final;
};

Rolled Try(const std::string& text) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(text), &model, &state);
  Rolled run;
  run.report = Rollout(model, state, nullptr, &run.final);
  return run;
}

Rolled Simulate(const std::string& text) {
  Rolled run = Try(text);
  EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
  return run;
}

std::string Settings(const char* integrator, double duration, const std::string& more = "") {
  return R"("simulation": {"stepping": "event", "dt": 0.01, "integrator": ")" +
         std::string(integrator) + R"(", "duration": )" + std::to_string(duration) + more + "}";
}

std::string Ball(double height, double speed, double spin, double e, double mu) {
  const auto text = [](double x) { return std::to_string(x); };
  return R"("bodies": [{"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
      "position": [0, )" +
         text(0.1 + height) + R"(], "velocity": [)" + text(speed) + R"(, 0],
      "angular_velocity": )" +
         text(spin) + R"(, "restitution": )" + text(e) + R"(, "friction": )" + text(mu) + R"(},
    {"name": "floor", "static": true, "restitution": )" +
         text(e) + R"(, "friction": )" + text(mu) + R"(,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )";
}

TEST(EventStepTest, BouncesAsTheFormulaSays) {
  const Rolled run = Simulate("{" + Ball(1.0, 0, 0, 0.8, 0) + Settings("trapezoidal", 1.5) + "}");
  const double u = std::sqrt(2.0 * kGravity);
  const double t1 = u / kGravity;
  const double t2 = t1 + 2.0 * 0.8 * u / kGravity;
  const double left = 1.5 - t2;
  EXPECT_NEAR(run.final.pose[1], 0.1 + 0.64 * u * left - 0.5 * kGravity * left * left, 1e-12);
  EXPECT_NEAR(run.final.twist[1], 0.64 * u - kGravity * left, 1e-12);
  EXPECT_EQ(run.report.events, 2);
  EXPECT_EQ(run.report.given_up.total(), 0);
}

TEST(EventStepTest, ABouncingBallComesToRest) {
  const Rolled run = Simulate("{" + Ball(0.5, 0, 0, 0.6, 0) + Settings("trapezoidal", 3) + "}");
  EXPECT_NEAR(run.final.pose[1], 0.1, 1e-14);
  EXPECT_NEAR(run.final.twist[1], 0.0, 1e-14);
  EXPECT_GT(run.report.events, 10);
  EXPECT_EQ(run.report.given_up.total(), 0);
}

TEST(EventStepTest, AnEndlessSeriesOfBouncesIsCutShortAndCounted) {
  // Four impacts within the step of 0.01 s.
  for (const int limit : {3, 5}) {
    const Rolled run =
        Simulate("{" + Ball(0.00001, 0, 0, 0.99, 0) +
                 Settings("trapezoidal", 0.01,
                          R"(, "restitution_threshold": 0, "max_events_per_step": )" +
                              std::to_string(limit)) +
                 "}");
    EXPECT_EQ(run.report.given_up.total(), limit == 3 ? 1 : 0);
  }
  // Without a threshold the series never ends: it is over once its rest is next to nothing.
  const Rolled zeno = Simulate("{" + Ball(0.0001, 0, 0, 0.9, 0) +
                               R"("simulation": {"stepping": "event", "integrator": "trapezoidal",
                               "dt": 0.1, "duration": 0.2, "restitution_threshold": 0}})");
  EXPECT_EQ(zeno.report.given_up.total(), 0);
  EXPECT_EQ(zeno.report.bounces_ended, 1);
  EXPECT_NEAR(zeno.final.pose[1], 0.1, 1e-12);
}

// It rocks from corner to corner, each time less: without end, were it not held.
TEST(EventStepTest, ABoxThatRocksComesToRest) {
  for (const char* integrator : {"trapezoidal", "runge_kutta_4"}) {
    const Rolled run =
        Simulate(R"({"bodies": [{"name": "box", "shape": {"box": {"size": [0.15, 0.3]}},
        "mass": 1, "position": [0, 0.152], "angle": 0.01, "friction": 0.6},
      {"name": "floor", "static": true, "friction": 0.6,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
                 Settings(integrator, 1.0) + "}");
    EXPECT_GT(run.report.given_up.total(), 0);
    EXPECT_LT(run.report.events, 60);
    EXPECT_NEAR(run.final.pose[1], 0.15, 1e-10);
    EXPECT_NEAR(run.final.pose[2], 0.0, 1e-9);
    EXPECT_NEAR(run.final.twist[2], 0.0, 1e-9);
  }
}

// Its damping acts within 1e-9 s, far below what an explicit integrator can do with steps of 2 ms.
TEST(EventStepTest, ABodyTooStiffForItsIntegratorIsRefusedSoon) {
  const Rolled run = Try(R"({"bodies": [
      {"name": "link", "shape": {"box": {"size": [0.05, 0.24]}}, "mass": 4.7e-10,
       "position": [-1.115, 0.784], "angle": 0.784, "angular_damping": 0.007}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["link", "world"],
       "anchor": [-1.2, 0.869], "damping": 0.076, "limits": [-0.018, 0.19]}],
    "springs": [{"name": "spring", "bodies": ["link", "world"],
       "anchors": [[-1.106, 0.815], [-0.347, 1.5]], "stiffness": 4.1, "damping": 0.456,
       "rest_length": 0.57}],
    "simulation": {"dt": 0.002, "duration": 0.008, "stepping": "event",
                   "integrator": "runge_kutta_4", "joint_correction": "projection"}})");
  EXPECT_NE(run.report.status, StepStatus::kDone);
  EXPECT_FALSE(run.report.message.empty());
}

TEST(EventStepTest, ASlidingDiscRolls) {
  // v = v0 − μ g t until v = r ω: t = v0 / (3 μ g), v = 2 v0 / 3.
  const Rolled run = Simulate("{" + Ball(0, 2, 0, 0, 0.3) + Settings("trapezoidal", 0.8) + "}");
  const double t = 2.0 / (3.0 * 0.3 * kGravity);
  EXPECT_NEAR(run.final.twist[0], 4.0 / 3.0, 1e-13);
  EXPECT_NEAR(run.final.twist[2], -40.0 / 3.0, 1e-12);
  EXPECT_NEAR(run.final.pose[0], 2.0 * t - 0.5 * 0.3 * kGravity * t * t + 4.0 / 3.0 * (0.8 - t),
              1e-13);
  EXPECT_EQ(run.report.events, 1);
}

TEST(EventStepTest, ABlockStopsWhereItsEnergyIsSpent) {
  const Rolled run = Simulate(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
       "velocity": [2, 0], "friction": 0.4},
      {"name": "floor", "static": true, "friction": 0.4,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
                              Settings("runge_kutta_4", 1.0) + "}");
  EXPECT_NEAR(run.final.pose[0], 4.0 / (2.0 * 0.4 * kGravity), 1e-13);
  EXPECT_NEAR(run.final.pose[1], 0.1, 1e-14);
  EXPECT_NEAR(run.final.pose[2], 0.0, 1e-14);
  EXPECT_NEAR(run.final.twist[0], 0.0, 1e-14);
}

TEST(EventStepTest, ARampOfForceStartsASlideWhereFrictionEnds) {
  // F = 5 t against μ m g = 0.4 · 2 · 9.81: it sticks until t = 1.5696 s, then slides with
  // a = (F − μ m g) / m.
  Model<double> model;
  Scene scene = SceneOf(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
       "friction": 0.4},
      {"name": "floor", "static": true, "friction": 0.4,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "forces": [{"name": "push", "body": "box", "force": [0, 0], "at": [0, -0.1]}], )" +
                        Settings("runge_kutta_4", 2.0) + "}");
  Signal ramp;
  ramp.interpolation = Signal::Interpolation::kLinear;
  ramp.time = {0.0, 10.0};
  ramp.x = {0.0, 50.0};
  scene.forces[0].force_signal = ramp;
  State<double> state;
  BuildModel(scene, &model, &state);
  const RolloutReport report = Rollout(model, state, nullptr, &state);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  const double start = 0.4 * 2.0 * kGravity / 5.0;
  const double left = 2.0 - start;
  EXPECT_NEAR(state.twist[0], 5.0 * left * left / 4.0, 1e-12);
  EXPECT_NEAR(state.pose[0], 5.0 * left * left * left / 12.0, 1e-12);
}

TEST(EventStepTest, ABlockLiftsOffAnAcceleratedTable) {
  // A ball on a table that swings down faster than gravity pulls: it leaves, and lands again.
  const Rolled run = Simulate(R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 1.15]},
      {"name": "table", "shape": {"box": {"size": [1, 0.1]}}, "mass": 1, "position": [0, 1]}],
    "joints": [{"name": "rail", "type": "prismatic", "bodies": ["table", "world"], "anchor": [0, 1],
                "axis": [0, 1]}],
    "springs": [{"name": "s", "bodies": ["table", "world"], "anchors": [[0, 1], [0, 0]],
                 "stiffness": 100, "rest_length": 1.5}], )" +
                              Settings("runge_kutta_4", 1.0) + "}");
  // Up by a force of 50 N against 19.62 N; past the spring's rest length both would part.
  EXPECT_GE(run.report.events, 2);
  EXPECT_GT(run.final.pose[1], run.final.pose[4] + 0.15 - 1e-12);
}

TEST(EventStepTest, TouchingBallsPassTheBlowOn) {
  const Rolled run = Simulate(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [-0.5, 0],
       "velocity": [1, 0], "restitution": 1},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0],
       "restitution": 1},
      {"name": "c", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.3, 0],
       "restitution": 1}], )" +
                              Settings("trapezoidal", 1.0) + "}");
  EXPECT_NEAR(run.final.twist[0], 0.0, 1e-14);
  EXPECT_NEAR(run.final.twist[3], 0.0, 1e-14);
  EXPECT_NEAR(run.final.twist[6], 1.0, 1e-14);
  EXPECT_EQ(run.report.events, 2);
}

TEST(EventStepTest, AForceWindowsEdgesAreMet) {
  // 2 N on 1 kg from 0.013 to 0.187 s.
  const Rolled run = Simulate(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 1, "inertia": 1, "position": [0, 0]}],
    "forces": [{"name": "f", "body": "a", "force": [2, 0], "start": 0.013, "end": 0.187}], )" +
                              Settings("trapezoidal", 0.5) + "}");
  EXPECT_NEAR(run.final.twist[0], 2.0 * 0.174, 1e-15);
  EXPECT_NEAR(run.final.pose[0], 0.174 * 0.174 + 2.0 * 0.174 * (0.5 - 0.187), 1e-15);
  EXPECT_EQ(run.report.events, 2);
}

TEST(EventStepTest, PainlevesRodIsGivenAnImpulse) {
  // A rod that slides on its tip at a steep angle under much friction: accelerations have no
  // solution (I/m a² small, μ > 4/3). It goes on, and says that it took the way out.
  const Rolled run = Simulate(R"({"bodies": [
      {"name": "rod", "shape": {"capsule": {"length": 2, "radius": 1e-6}}, "mass": 1,
       "inertia": 0.3333333333333333, "position": [-0.4539904997395468, 0.8910075241883679],
       "angle": 2.0420352248333655, "velocity": [1, 0], "friction": 3},
      {"name": "floor", "static": true, "friction": 3,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
                              Settings("runge_kutta_4", 0.2) + "}");
  EXPECT_TRUE(std::isfinite(run.final.pose[2]));
  EXPECT_LE(run.report.penetration_max, 1e-6);
}

// The accelerations of a tall one are rounding, and differ from iteration to iteration.
// Spin presses the disc against the wall by μ times the floor's impulse, and the wall holds it down
// by μ² times that: for μ ≥ 1 nothing lifts it, and no impulses give the floor's rebound. It stays
// in the corner, where friction takes its spin.
TEST(EventStepTest, ADiscThatSpinsIntoACornerStaysThere) {
  for (const double friction : {0.9, 1.0, 1.5}) {
    for (const double restitution : {0.2, 0.9}) {
      const std::string surface = R"("friction": )" + std::to_string(friction) +
                                  R"(, "restitution": )" + std::to_string(restitution);
      const Rolled run = Simulate(
          R"({"bodies": [{"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, )" +
          surface + R"(, "position": [0.1, 0.101], "velocity": [0, -0.3], "angular_velocity": 2},
          {"name": "floor", "static": true, )" +
          surface + R"(, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}},
          {"name": "wall", "static": true, )" +
          surface + R"(, "shape": {"half_plane": {"normal": [1, 0], "offset": 0}}}], )" +
          Settings("runge_kutta_4", 2.0) + "}");
      EXPECT_NEAR(run.final.pose[1], 0.1, 1e-9) << friction;
      EXPECT_GE(run.final.pose[0], 0.1 - 1e-9);
      if (friction < 1.0) {
        EXPECT_EQ(run.report.given_up.rebounds_given_up, 0);
        continue;
      }
      EXPECT_NEAR(run.final.pose[0], 0.1, 1e-9);
      EXPECT_GE(run.report.given_up.rebounds_given_up, 1);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(run.final.twist[i], 0.0, 1e-9);
    }
  }
}

TEST(EventStepTest, StacksStayWhereTheyAre) {
  for (const int count : {4, 20}) {
    std::string bodies;
    for (int i = 0; i < count; ++i) {
      bodies +=
          R"({"name": "b)" + std::to_string(i) +
          R"(", "shape": {"box": {"size": [1, 1]}}, "mass": 1, "friction": 0.5, "position": [0, )" +
          std::to_string(i + 0.5) + "]}, ";
    }
    const Rolled run = Simulate(R"({"bodies": [)" + bodies + R"({"name": "floor", "static": true,
      "friction": 0.5, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
                                Settings("trapezoidal", 0.5) + "}");
    EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
    for (int i = 0; i < count; ++i) {
      EXPECT_NEAR(run.final.pose[3 * i], 0.0, 1e-12);
      EXPECT_NEAR(run.final.pose[3 * i + 1], i + 0.5, 1e-12);
    }
  }
}

// A corner of the upper block turns about the end of the lower one's edge: it counts as above it as
// far as 1e-9 of the faces beyond, where the nearest points are farther apart than what touches.
// The contact was lost for a step, 0.33 mm deep.
TEST(EventStepTest, ACornerBesideTheEndOfAnEdgeStaysInContact) {
  const Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "upper", "shape": {"polygon": {"vertices": [
         [0.2172722523731747, 0.11134611783597859], [0.09257429200142808, 0.2677124143295845],
         [-0.24040058725099456, -0.14982487769098152], [-0.06020681367051084, -0.2366016255144931]]}},
       "mass": 1, "position": [-0.7945584979125818, 0.6536154470935059], "friction": 1e6,
       "angle": -0.20181138962694448, "velocity": [0.4231411696624664, -0.2049162925496712],
       "angular_velocity": -1.925717382830912},
      {"name": "lower", "shape": {"polygon": {"vertices": [
         [0.1474442653043695, 0.1945902829981777], [-0.032749508276114225, 0.2813670308216893],
         [-0.15158686679321143, -0.23929345611938038], [0.04841313320678853, -0.2392934561193804]]}},
       "mass": 1, "position": [-1.0484131298101453, 0.2392934561193804], "friction": 1e6},
      {"name": "floor", "static": true, "friction": 1e6,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.01, "duration": 0.03, "stepping": "event",
                     "integrator": "runge_kutta_4"}})");
  Model<double> model;
  State<double> first, last;
  BuildModel(scene, &model, &first);
  double deepest = 0.0;
  const RolloutReport report = Rollout(
      model, first,
      [&](long, double, const State<double>& state, Stepper*) {
        deepest = std::max(deepest, DeepestPenetration(model, state));
      },
      &last);
  EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_LE(deepest, 1e-9);
}

// Three links under 100 kg whip faster than dt resolves: the projection's error shrank by a third a
// round, and what was left of it, 2 mm, was taken for rounding.
TEST(EventStepTest, JointsHoldAlsoWhereTheirProjectionConvergesSlowly) {
  const testing::DriftOfRun run = testing::RunForDrift(test_scenes::SceneOf(R"({"bodies": [
      {"name": "l0", "shape": {"capsule": {"length": 0.3, "radius": 0.02}}, "mass": 1,
       "position": [0.15, 2]},
      {"name": "l1", "shape": {"capsule": {"length": 0.3, "radius": 0.02}}, "mass": 1,
       "position": [0.45, 2]},
      {"name": "l2", "shape": {"capsule": {"length": 0.3, "radius": 0.02}}, "mass": 100,
       "position": [0.75, 2]}],
      "joints": [
      {"name": "j0", "type": "revolute", "bodies": ["l0", "world"], "anchor": [0, 2]},
      {"name": "j1", "type": "revolute", "bodies": ["l1", "l0"], "anchor": [0.3, 2]},
      {"name": "j2", "type": "revolute", "bodies": ["l2", "l1"], "anchor": [0.6, 2]}],
      "no_contact": [["l*", "l*"]],
      "simulation": {"dt": 0.02, "duration": 1.5, "stepping": "event",
                     "integrator": "runge_kutta_4", "joint_correction": "projection"}})"));
  EXPECT_LE(run.largest, 1e-9);
  EXPECT_TRUE(run.report.status == StepStatus::kDone ||
              run.report.message.find("dt is too large") != std::string::npos)
      << run.report.message;
}

// A wheel's speed misses its axle's by 1e-6 m/s as the run starts. Until the joint is satisfied
// nobody knows which way it slides: friction had turned it back by 23 rad/s within a step.
TEST(EventStepTest, TwistsThatJointsDoNotAllowAreCorrectedBeforeAnythingSlides) {
  for (const char* integrator : {"trapezoidal", "runge_kutta_4"}) {
    const std::string text = R"({"bodies": [
        {"name": "cart", "shape": {"box": {"size": [1.2, 0.2]}}, "mass": 5, "position": [0, 0.4],
         "velocity": [1, 0]},
        {"name": "w0", "shape": {"circle": {"radius": 0.2}}, "mass": 0.5, "position": [-0.5, 0.2],
         "velocity": [1, 0], "angular_velocity": -5, "friction": 0.9},
        {"name": "w1", "shape": {"circle": {"radius": 0.2}}, "mass": 0.5, "position": [0.5, 0.2],
         "velocity": [0.999999, 0], "angular_velocity": -5, "friction": 0.9},
        {"name": "floor", "static": true, "friction": 0.9,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
        "joints": [
        {"name": "a", "type": "revolute", "bodies": ["w0", "cart"], "anchor": [-0.5, 0.2]},
        {"name": "b", "type": "revolute", "bodies": ["w1", "cart"], "anchor": [0.5, 0.2]}], )" +
                             Settings(integrator, 0.1) + "}";
    Scene scene;
    std::string error;
    ASSERT_TRUE(ParseScene(text, "scene", ".", &scene, &error)) << error;
    Model<double> model;
    State<double> first, last;
    BuildModel(scene, &model, &first);
    const RolloutReport report = Rollout(model, first, {}, &last);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
    for (int body = 1; body <= 2; ++body) {
      EXPECT_NEAR(last.twist[3 * body], 1.0, 1e-6) << integrator;
      EXPECT_NEAR(last.twist[3 * body + 2], -5.0, 1e-5) << integrator;
    }
  }
}

// A bar hinged to the world and to a carriage that drives away: consistent in accelerations, not
// in twists.
TEST(EventStepTest, ContradictoryJointsAreReported) {
  const std::string text = R"({"bodies": [
      {"name": "bar", "shape": {"box": {"size": [1, 0.1]}}, "mass": 1, "position": [0.5, 0]},
      {"name": "carriage", "kinematic": true, "position": [1, 0], "velocity": [1, 0]}],
      "joints": [{"name": "still", "type": "revolute", "bodies": ["bar", "world"], "anchor": [0, 0]},
      {"name": "driven", "type": "revolute", "bodies": ["bar", "carriage"], "anchor": [1, 0]}], )" +
                           Settings("trapezoidal", 0.5) + "}";
  Scene scene;
  std::string error;
  ASSERT_TRUE(ParseScene(text, "scene", ".", &scene, &error)) << error;
  Model<double> model;
  State<double> first, last;
  BuildModel(scene, &model, &first);
  const RolloutReport report = Rollout(model, first, {}, &last);
  EXPECT_EQ(report.status, StepStatus::kUnsolved);
  EXPECT_NE(report.message.find("contradicts"), std::string::npos) << report.message;
}

// 1e-9 kg in a slide with damping of 3e8 / s, which the integrator amplifies: searches for its
// stops would take millions of evaluations.
// Transverse waves of its links turn by 20 rad a step: the implicit stage has other solutions too.
TEST(EventStepTest, AChainWithAHeavyEndKeepsItsEnergy) {
  Model<double> model;
  State<double> state;
  BuildModel(
      SceneOf(test_scenes::HeavyEnd(
          "1e6",
          R"("dt": 0.001, "duration": 0.4, "stepping": "event", "integrator": "trapezoidal")")),
      &model, &state);
  const auto energy = [&] { return KineticEnergy(model, state) + PotentialEnergy(model, state); };
  const double before = energy();
  double fastest = 0.0;
  const RolloutReport report = Rollout(
      model, state,
      [&](long, double, const State<double>& at, Stepper*) {
        fastest = std::max(fastest, KineticEnergy(model, at));
      },
      &state);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_GT(fastest, 1e4);
  EXPECT_NEAR(energy(), before, 1e-6 * fastest);
}

// Events are bounded pair by pair: many bodies that land in one step are no series without end.
TEST(EventStepTest, ManyBodiesMayLandInOneStep) {
  std::string bodies;
  constexpr int kBodies = 150;
  for (int i = 0; i < kBodies; ++i) {
    bodies += R"({"name": "b)" + std::to_string(i) +
              R"(", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "restitution": 0.5,
        "velocity": [0, -1], "position": [)" +
              std::to_string(i) + ", " + std::to_string(0.1 + 2e-5 * (1 + i / 3)) + "]}, ";
  }
  const Rolled run =
      Simulate(R"({"gravity": [0, 0], "bodies": [)" + bodies +
               R"({"name": "floor", "static": true, "restitution": 0.5,
      "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
               Settings("runge_kutta_4", 0.01, R"(, "max_events_per_step": 2)") + "}");
  EXPECT_EQ(run.report.events, kBodies);
  EXPECT_EQ(run.report.given_up.total(), 0);
  for (int i = 0; i < kBodies; ++i) {
    EXPECT_NEAR(run.final.twist[3 * i + 1], 0.5, 1e-12);
  }
}

// A disc that rattles between two walls gives its rebounds up; another one keeps its own.
TEST(EventStepTest, OnlyThePairWithTooManyEventsGivesUpItsRebounds) {
  const Rolled run =
      Simulate(R"({"gravity": [0, 0], "bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "restitution": 1,
       "velocity": [3, 0], "position": [0, 0]},
      {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "restitution": 1,
       "velocity": [0, -3], "position": [0, 2.12]},
      {"name": "left", "static": true, "restitution": 1,
       "shape": {"half_plane": {"normal": [1, 0], "offset": -0.10001}}},
      {"name": "right", "static": true, "restitution": 1,
       "shape": {"half_plane": {"normal": [-1, 0], "offset": -0.10001}}},
      {"name": "floor", "static": true, "restitution": 1,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 2}}}],
      "no_contact": [["disc", "floor"]], )" +
               Settings("runge_kutta_4", 0.01, R"(, "max_events_per_step": 5)") + "}");
  EXPECT_EQ(run.report.given_up.rebounds_given_up, 1);
  EXPECT_NEAR(run.final.twist[0], 0.0, 1e-12);
  EXPECT_NEAR(run.final.twist[4], 3.0, 1e-12);
}

TEST(EventStepTest, ABodyTooStiffForItsStepIsRefusedSoon) {
  const Rolled run = Try(R"({"bodies": [{"name": "bead", "shape": {"circle": {"radius": 0.07}},
      "mass": 1.39e-9, "position": [-1.12, 0.429], "angle": 0.711, "linear_damping": 0.353}],
    "joints": [{"name": "slide", "type": "prismatic", "bodies": ["bead", "world"],
      "anchor": [-1.2, 0.52], "axis": [0.99, 0.286], "displacement": 0.0082, "rate": -1.49,
      "limits": [0.00534, 0.01]}],
    "simulation": {"duration": 0.0012, "stepping": "event", "integrator": "runge_kutta_4",
      "max_events_per_step": 5}})");
  EXPECT_EQ(run.report.status, StepStatus::kUnsolved);
  EXPECT_NE(run.report.message.find("6000 evaluations"), std::string::npos) << run.report.message;
}

}  // namespace
}  // namespace tangible
