// SPDX-License-Identifier: Apache-2.0
//
// Gaps that close between the ends of a motion.
#include <gtest/gtest.h>

#include <cmath>

#include "first_segment.h"

namespace tangible {
namespace {

using testing::FirstSegment;
using testing::Simulation;

TEST(EventSearchGapsTest, ARotatingCornerAndAGrazingOneAreNotMissed) {
  // A spinning bar above the floor: its end sweeps below it in the middle of the step, and is up
  // again at its end. At height z the end, 0.5 from the middle, touches if z < 0.5.
  for (const double height : {0.3, 0.499, 0.49999}) {
    bool found;
    const Segment s = FirstSegment(
        R"({"gravity": [0, 0], "bodies": [
        {"name": "bar", "shape": {"capsule": {"length": 0.9, "radius": 0.05}}, "mass": 1,
         "position": [0, )" +
            std::to_string(height) +
            R"(], "angular_velocity": 3.141592653589793},
        {"name": "floor", "static": true,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
            Simulation() + "}",
        1.0, &found);
    EXPECT_EQ(s.event, EventKind::kTouch) << height;
    // 0.45 sin θ + 0.05 = z.
    EXPECT_NEAR(std::sin(3.141592653589793 * s.length), (height - 0.05) / 0.45, 1e-9) << height;
    EXPECT_LT(s.length, 0.5);
  }
  bool found;
  const Segment s = FirstSegment(R"({"gravity": [0, 0], "bodies": [
      {"name": "bar", "shape": {"capsule": {"length": 0.9, "radius": 0.05}}, "mass": 1,
       "position": [0, 0.500001], "angular_velocity": 3.141592653589793},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}], )" +
                                     Simulation() + "}",
                                 1.0, &found);
  EXPECT_EQ(s.event, EventKind::kStepEnd);
}

TEST(EventSearchGapsTest, AJointReachesItsLimit) {
  bool found;
  const Segment s = FirstSegment(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 1, "inertia": 0.1, "position": [0.5, 0]}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "rate": 2, "limits": [-1, 0.5]}],
    "simulation": {"stepping": "event", "integrator": "runge_kutta_4", "dt": 0.01}})",
                                 0.4, &found);
  EXPECT_EQ(s.event, EventKind::kTouch);
  EXPECT_EQ(s.event_contact.joint, 0);
  EXPECT_EQ(s.event_contact.side, -1.0);
  EXPECT_NEAR(s.length, 0.25, 1e-13);
}

}  // namespace
}  // namespace tangible
