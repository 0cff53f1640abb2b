// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/event_search.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/first_segment.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using testing::FirstSegment;
using testing::Simulation;

TEST(EventSearchTest, ADropTouchesAtSqrtOfTwoHOverG) {
  bool found;
  const Segment s = FirstSegment(
      test_scenes::FallingBall(1.0, R"({"stepping": "event", "integrator": "trapezoidal"})"), 1.0,
      &found);
  EXPECT_EQ(s.event, EventKind::kTouch);
  EXPECT_NEAR(s.length, std::sqrt(2.0 / 9.81), 1e-15);
  EXPECT_NEAR(s.after.pose[1], 0.1, 1e-15);
}

TEST(EventSearchTest, AFastBallDoesNotTunnelThroughAThinWall) {
  bool found;
  const Segment s = FirstSegment(R"({"gravity": [0, 0], "bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.01}}, "mass": 1, "position": [-30, 0],
       "velocity": [1e4, 0]},
      {"name": "wall", "static": true, "shape": {"box": {"size": [0.001, 1]}}}], )" +
                                     Simulation() + "}",
                                 0.01, &found);
  EXPECT_EQ(s.event, EventKind::kTouch);
  EXPECT_NEAR(s.after.pose[0], -0.0105, 1e-12);
}

// A box slides over the seam of two tiles, and off two blocks that part: what is handed over has at
// times no next contact, and a contact's rate was asked of none (read before the poses' memory).
TEST(EventSearchTest, HandOversWithoutANextContact) {
  for (const double speed : {2.0, 1e3, 1e5}) {
    const std::string text = R"({"bodies": [
        {"name": "b", "shape": {"box": {"size": [1, 0.2]}}, "mass": 1, "position": [0, 0.1],
         "friction": 0.3},
        {"name": "k", "kinematic": true, "shape": {"box": {"size": [1, 1]}}, "friction": 0.3,
         "position": [-0.55, -0.5], "velocity": [)" +
                             std::to_string(-speed) + R"(, 0]},
        {"name": "l", "kinematic": true, "shape": {"box": {"size": [1, 1]}}, "friction": 0.3,
         "position": [0.55, -0.5], "velocity": [)" +
                             std::to_string(speed) +
                             R"(, 0]}], "simulation": {"dt": 0.01, "duration": 0.02,
        "stepping": "event", "integrator": "trapezoidal"}})";
    Model<double> model;
    State<double> first, last;
    BuildModel(test_scenes::SceneOf(text), &model, &first);
    const RolloutReport report = Rollout(model, first, {}, &last);
    EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
    EXPECT_LE(std::abs(last.pose[0]), 1e-9);
  }
}

TEST(EventSearchTest, ASlipEndsWhereFrictionHasStoppedIt) {
  // v0 = μ g t, from a closed contact that slides.
  Model<double> model;
  State<double> state;
  Scene scene = test_scenes::SceneOf(R"({"bodies": [
      {"name": "box", "shape": {"box": {"size": [1, 0.2]}}, "mass": 1, "position": [0, 0.1],
       "velocity": [0.981, 0], "friction": 0.5},
      {"name": "floor", "static": true, "friction": 0.5,
       "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
                                     Simulation() + "}");
  BuildModel(scene, &model, &state);
  EventSearch search(model);
  Segment segment;
  segment.length = 1.0;
  segment.middle = 0.5;
  segment.before = state;
  search.FindContacts(model, state, 1e-6, &segment.contacts);
  ASSERT_EQ(segment.contacts.size(), 2u);
  EXPECT_EQ(search.num_pairs(), 1);
  for (const ActiveContact& contact : segment.contacts) {
    segment.friction.push_back(MixedFriction(model, contact.a, contact.b));
    // The first body of a pair is that before in the scene: the tangent is to the right on it.
    segment.modes.push_back(ContactMode::kSlidingPositive);
  }
  std::string message;
  ASSERT_TRUE(search.Run(model, segment.contacts, &segment, &message)) << message;
  EXPECT_EQ(segment.event, EventKind::kSlipEnds);
  EXPECT_NEAR(segment.length, 0.2, 1e-12);
  EXPECT_NEAR(segment.after.twist[0], 0.0, 1e-12);
}

}  // namespace
}  // namespace tangible
