// SPDX-License-Identifier: Apache-2.0
//
// Gaps that close between the ends of a motion.
#include <gtest/gtest.h>

#include <cmath>

#include "../../support/first_segment.h"
#include "../../support/gradients.h"
#include "../../support/scenes.h"
#include "tangible/simulation/stepping/step.h"

namespace tangible {
namespace {

using testing::ExpectOthersAgree;
using testing::FirstSegment;
using testing::Jacobian;
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

// The angle is exact; a projection would take the pin's error over a segment of 0.4 s to it.
TEST(EventSearchGapsTest, AJointReachesItsLimit) {
  bool found;
  const Segment s = FirstSegment(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 1, "inertia": 0.1, "position": [0.5, 0]}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0],
                "rate": 2, "limits": [-1, 0.5]}],
    "simulation": {"stepping": "event", "integrator": "runge_kutta_4", "dt": 0.01,
                   "joint_correction": "none"}})",
                                 0.4, &found);
  EXPECT_EQ(s.event, EventKind::kTouch);
  EXPECT_EQ(s.event_contact.joint, 0);
  EXPECT_EQ(s.event_contact.side, -1.0);
  EXPECT_NEAR(s.length, 0.25, 1e-13);
}

// A tip slides off a table at 1 m/s and falls from there on. It leaves where it meets the table's
// corner; the side that hands over to has another end, on which nothing depends.
TEST(EventSearchGapsTest, ATipThatLeavesAnEdgeMeetsItsEnd) {
  for (const double v : {1.0, -1.0}) {
    for (const double turn : {0.0, 0.2, -0.2}) {
      const Scene scene = test_scenes::SceneOf(
          R"({"bodies": [
          {"name": "tip", "mass": 1, "inertia": 1e6, "position": [)" +
          std::to_string(0.49 * v - 0.1 * std::sin(turn)) + ", " +
          std::to_string(0.1 * std::cos(turn)) + R"(], "angle": )" + std::to_string(turn) +
          R"(, "velocity": [)" + std::to_string(v) + R"(, 0],
           "shape": {"polygon": {"vertices": [[0, -0.1], [0.3, 0.05], [-0.3, 0.05]]}}},
          {"name": "table", "static": true, "position": [0, -0.1],
           "shape": {"box": {"size": [1, 0.2]}}}],
        "simulation": {"stepping": "event", "integrator": "runge_kutta_4", "dt": 0.05,
                       "duration": 0.05}})");
      const std::vector<std::string> paths = {"bodies/tip/shape/vertices/1/x",
                                              "bodies/tip/shape/vertices/2/x",
                                              "bodies/table/shape/size/x", "bodies/tip/velocity/x"};
      const GradientResult r = Jacobian(scene, paths, GradientMethod::kAdjoint);
      // vy = -g (0.05 - t), where |x + vx t| = 0.5.
      EXPECT_NEAR(r.jacobian(4, 0), 0.0, 1e-14);
      EXPECT_NEAR(r.jacobian(4, 1), 0.0, 1e-14);
      EXPECT_NEAR(r.jacobian(4, 2), 0.5 * 9.81, 1e-5);
      EXPECT_NEAR(r.jacobian(4, 3), -0.01 * 9.81 * v, 1e-5);
    }
  }
}

// A slider on a spinning guide, pulled to its lower limit until it spins fast enough. It leaves
// without speed, and where the step's poses cut the corner there is no touch.
TEST(EventSearchGapsTest, ALimitThatIsLeftIsTouchedOnlyByApproaching) {
  const Scene scene = test_scenes::SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 1, "inertia": 0.1, "position": [0, 0], "velocity": [0, -0.9],
       "angular_velocity": 6},
      {"name": "b", "mass": 1, "inertia": 0.1, "position": [0.3, 0], "velocity": [0, 0.9],
       "angular_velocity": 6}],
    "joints": [{"name": "slide", "type": "prismatic", "bodies": ["b", "a"], "anchor": [0.3, 0],
                "axis": [1, 0], "displacement": 0, "limits": [0, 0.1], "effort": -5.5}],
    "forces": [{"name": "spin", "body": "a", "torque": 0.5}],
    "simulation": {"stepping": "event", "integrator": "trapezoidal", "dt": 0.005,
                   "duration": 0.2, "joint_correction": "none"}})");
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper stepper(model);
  int left = 0;
  for (int k = 0; k < 40; ++k) {
    ASSERT_EQ(stepper.Step(model, 0.005 * k, 0.005, &state).status, StepStatus::kDone);
    const EventRecord& record = stepper.parts().islands[0]->events;
    for (int p = 0; p < record.num_parts; ++p) {
      if (!record.parts[p]->is_impulses) {
        left += record.parts[p]->segment.event == EventKind::kLiftOff ? 1 : 0;
        EXPECT_NE(record.parts[p]->segment.event, EventKind::kTouch) << k;
      }
    }
  }
  EXPECT_EQ(left, 1);
}

}  // namespace
}  // namespace tangible
