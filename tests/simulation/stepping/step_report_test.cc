// SPDX-License-Identifier: Apache-2.0
// What a step's model leaves out, beside the same step with it in; and what its solves leaned on.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

struct Ran {
  explicit Ran(const Scene& scene) {
    Model<double> model;
    State<double> initial;
    BuildModel(scene, &model, &initial);
    report = Rollout(model, initial, {}, &final);
  }
  RolloutReport report;
  State<double> final;
};

// The largest difference of two final states, m, rad, m/s and rad/s.
double Apart(const State<double>& x, const State<double>& y) {
  double apart = 0.0;
  for (size_t i = 0; i < x.pose.size(); ++i) {
    apart = std::max({apart, std::abs(x.pose[i] - y.pose[i]), std::abs(x.twist[i] - y.twist[i])});
  }
  return apart;
}

// `discs` discs in rows of four that fall onto a floor and each other; dt 0.01 s, 0.3 s.
Scene FallingDiscs(int discs, double friction) {
  std::string bodies;
  for (int i = 0; i < discs; ++i) {
    const double x = 0.22 * (i % 4) + 0.03 * (i / 4 % 2);
    bodies += R"({"name": "d)" + std::to_string(i) +
              R"(", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [)" +
              std::to_string(x) + ", " + std::to_string(0.12 + 0.24 * (i / 4)) +
              R"(], "velocity": [0, -1], "angular_velocity": 2},)";
  }
  Scene scene = test_scenes::SceneOf(R"({"bodies": [)" + bodies + R"({"name": "floor",
      "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.01, "duration": 0.3}})");
  for (BasicBody<double>& body : scene.bodies) {
    body.friction = friction;
  }
  return scene;
}

TEST(StepReportTest, OpenContactsBeyondReachHaveNoRows) {
  Scene scene = FallingDiscs(12, 0.3);
  const Ran reduced(scene);
  scene.simulation.contact_margin = 10.0;
  const Ran full(scene);
  ASSERT_EQ(reduced.report.status, StepStatus::kDone);
  ASSERT_EQ(full.report.status, StepStatus::kDone);
  // In full: 66 pairs of discs and 12 of a disc and the floor in each of 30 steps.
  EXPECT_EQ(full.report.contacts, 30 * 78);
  EXPECT_EQ(full.report.beyond_reach, 0);
  EXPECT_LT(reduced.report.contacts, 30 * 30);
  EXPECT_GT(reduced.report.beyond_reach, 0);
  EXPECT_EQ(reduced.report.pairs_near, reduced.report.contacts + reduced.report.beyond_reach);
  EXPECT_EQ(reduced.report.contacts_max, full.report.contacts_max);
  EXPECT_LT(Apart(reduced.final, full.final), 1e-9);
}

TEST(StepReportTest, AContactWithoutFrictionHasOneRow) {
  const Ran reduced(FallingDiscs(8, 0.0));
  const Ran full(FallingDiscs(8, 1e-200));  // three rows, and an impulse of nothing
  EXPECT_EQ(reduced.report.single_rows, reduced.report.contacts);
  EXPECT_EQ(reduced.report.lcp_rows, reduced.report.contacts);
  EXPECT_EQ(full.report.single_rows, 0);
  EXPECT_EQ(full.report.lcp_rows, 3 * full.report.contacts);
  EXPECT_GT(reduced.report.contacts_max, 0);
  EXPECT_LT(Apart(reduced.final, full.final), 1e-9);
}

TEST(StepReportTest, ADiscOnWhichNothingExertsATorqueHasNoAngle) {
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    // By events only discs that do not meet: rebounds without end are given up at instants that
    // rounding chooses.
    const int discs = stepping == Stepping::kFixed ? 8 : 4;
    Scene scene = FallingDiscs(discs, 0.0);
    scene.simulation.stepping = stepping;
    const Ran reduced(scene);
    // Friction that is nothing, but is there: all angles are unknowns.
    Scene with_friction = FallingDiscs(discs, 1e-200);
    with_friction.simulation.stepping = stepping;
    const Ran full(with_friction);
    ASSERT_EQ(reduced.report.status, StepStatus::kDone);
    ASSERT_EQ(full.report.status, StepStatus::kDone);
    EXPECT_GT(reduced.report.angles_left_out, reduced.report.steps);
    EXPECT_LE(reduced.report.angles_left_out, discs * reduced.report.steps);
    EXPECT_EQ(full.report.angles_left_out, 0);
    EXPECT_LT(Apart(reduced.final, full.final), 1e-9);
    // Nothing turns them: 2 rad/s, to the bit.
    int turning = 0;
    for (size_t i = 2; i < reduced.final.twist.size(); i += 3) {
      turning += reduced.final.twist[i] == 2.0 ? 1 : 0;
    }
    EXPECT_EQ(turning, discs);
  }
  // A box has an angle without friction too; discs beside it have none.
  Scene mixed = FallingDiscs(4, 0.0);
  for (BasicBody<double>& body : mixed.bodies) {
    if (body.name == "d0") {
      body.shape = {ShapeType::kBox, {0.2, 0.2}};
    }
  }
  mixed.simulation.duration = 0.05;
  mixed.simulation.dt = 0.05;
  const Ran ran(mixed);
  EXPECT_GE(ran.report.contacts, 5);
  EXPECT_EQ(ran.report.angles_left_out, 3);
}

TEST(StepReportTest, WithoutAnInequalityThereIsNoLcp) {
  Scene scene = test_scenes::SceneOf(test_scenes::WhippingChain(0.3));
  scene.no_contact.clear();
  for (BasicBody<double>& body : scene.bodies) {
    body.position.x() += 3.0;
  }
  BasicBody<double> ball = scene.bodies[0];
  ball.name = "ball";
  ball.shape = {ShapeType::kCircle, {0.1}};
  ball.position = {-3.0, 0.0};
  scene.bodies.push_back(ball);
  const Ran reduced(scene);
  EXPECT_EQ(reduced.report.SolvedBy(Rung::kDirect, Rung::kDirect), reduced.report.steps);
  EXPECT_EQ(reduced.report.lcp_rows, 0);
  scene.simulation.contact_margin = 100.0;
  const Ran full(scene);
  EXPECT_EQ(full.report.SolvedBy(Rung::kDirect, Rung::kDirect), 0);
  EXPECT_EQ(full.report.SolvedBy(Rung::kModeChanges, Rung::kModeChanges), full.report.steps);
  EXPECT_GT(full.report.lcp_rows, 0);
  EXPECT_LT(Apart(reduced.final, full.final), 1e-9);
}

TEST(StepReportTest, TheBroadPhaseComparesFewerThanAllPairs) {
  for (const int discs : {32, 64, 128}) {
    Scene scene = FallingDiscs(discs, 0.3);
    scene.simulation.duration = 0.02;
    const Ran run(scene);
    const long all = (discs + 1L) * discs / 2;
    EXPECT_GE(run.report.pairs_compared, run.report.pairs_near);
    EXPECT_LT(run.report.pairs_compared, run.report.steps * all / 2) << discs;
    scene.simulation.stepping = Stepping::kEvent;
    const Ran by_events(scene);
    EXPECT_GT(by_events.report.pairs_compared, 0);
    EXPECT_LT(by_events.report.pairs_compared, by_events.report.steps * all / 2) << discs;
  }
}

// Boxes on each other, the upper one of `ratio` times the mass, which slides the lower one along.
// With a friction of 0.5 it would be about to tip over it.
Scene HeavyOnLight(double ratio, const std::string& stepping) {
  Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "light", "shape": {"box": {"size": [1, 1]}}, "mass": 1, "position": [0, 0.5],
       "velocity": [0.3, 0], "friction": 0.4},
      {"name": "heavy", "shape": {"box": {"size": [1, 1]}}, "mass": 1, "position": [0, 1.5],
       "velocity": [0.3, 0], "friction": 0.4},
      {"name": "floor", "static": true, "friction": 0.5,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 0.05, "stepping": ")" +
                                     stepping + R"("}})");
  scene.bodies[1].mass = ratio;
  return scene;
}

TEST(StepReportTest, SystemsThatDoNotRefineCondensedAreSeen) {
  const Ran equal(HeavyOnLight(1.0, "event"));
  EXPECT_EQ(equal.report.status, StepStatus::kDone);
  EXPECT_EQ(equal.report.solver.whole_system, 0);
  const Ran refined(HeavyOnLight(1e12, "event"));
  EXPECT_EQ(refined.report.status, StepStatus::kDone);
  EXPECT_EQ(refined.report.solver.whole_system, 0);
  // Beyond what a double adds: 1 kg is nothing to it.
  const Ran spread(HeavyOnLight(1e17, "event"));
  EXPECT_EQ(spread.report.status, StepStatus::kDone);
  EXPECT_GT(spread.report.solver.whole_system, 0);
}

TEST(StepReportTest, IslandsThatFailApartAreSeen) {
  // Four pairs of discs apart, and one that two walls drive both ways.
  Scene scene = FallingDiscs(8, 0.0);
  for (int i = 0; i < 8; ++i) {
    scene.bodies[i].position = {1.0 * (i / 2), 0.1 + 0.2 * (i % 2)};
    scene.bodies[i].velocity = {0.0, 0.0};
  }
  EXPECT_EQ(Ran(scene).report.solver.islands_together, 0);
  BasicBody<double> press;
  press.name = "press";
  press.motion = Motion::kKinematic;
  press.shape = {ShapeType::kHalfPlane, {0.0, -1.0, 0.0}};
  press.position = {0.0, 0.39};
  press.velocity = {0.0, -1.0};
  scene.bodies.push_back(press);
  const Ran pressed(scene);
  EXPECT_EQ(pressed.report.status, StepStatus::kUnsolved);
  EXPECT_EQ(pressed.report.solver.islands_together, 1);
  EXPECT_GE(pressed.report.solver.dense, 1);
}

TEST(StepReportTest, ProjectionsThatNewtonCannotDoAreSeen) {
  Scene scene = test_scenes::SceneOf(test_scenes::WhippingChain(2.0));
  scene.simulation.dt = 0.05;
  EXPECT_GT(Ran(scene).report.damped_projections, 0);
  scene.simulation.dt = 1e-4;
  scene.simulation.duration = 0.01;
  EXPECT_EQ(Ran(scene).report.damped_projections, 0);
}

}  // namespace
}  // namespace tangible
