// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/joint_opening.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "../../support/built.h"
#include "tangible/simulation/stepping/rollout.h"
#include "tangible/simulation/stepping/tolerances.h"

namespace tangible {
namespace {

using testing::Build;
using testing::Built;

// A rod of 2 m without a shape and a box of 0.6 m by 0.8 m, joined; `joint` has the type's keys.
Built RodAndBox(const std::string& joint, const std::string& simulation = "{}") {
  return Build(R"({"bodies": [
      {"name": "rod", "mass": 3, "inertia": 1, "position": [0, 0]},
      {"name": "box", "shape": {"box": {"size": [0.6, 0.8]}}, "mass": 1, "position": [1, 0]}],
    "joints": [{"name": "j", "bodies": ["rod", "box"], )" +
               joint + R"(}], "simulation": )" + simulation + "}");
}

constexpr char kHinge[] = R"("type": "revolute", "anchor": [0.5, 0])";

double OpeningOf(const Built& built) {
  JointWatch watch(built.model);
  watch.Look(built.model, built.state, 0.0);
  return watch.opening();
}

TEST(JointWatch, MeasuresAHingeBesideTheSmallerBody) {
  Built built = RodAndBox(kHinge);
  EXPECT_EQ(OpeningOf(built), 0.0);
  // The box is 1 m from corner to corner, the rod √(12 · 1 / 3) = 2 m long.
  built.state.pose[0] += 0.03;
  built.state.pose[1] -= 0.04;
  EXPECT_NEAR(OpeningOf(built), 0.05, 1e-15);
}

TEST(JointWatch, MeasuresAngles) {
  for (const char* joint : {R"("type": "weld", "anchor": [0.5, 0])", R"("type": "fixed_angle")",
                            R"("type": "prismatic", "anchor": [0, 0], "axis": [1, 0])"}) {
    Built built = RodAndBox(joint);
    EXPECT_EQ(OpeningOf(built), 0.0) << joint;
    // About the anchor: the points stay together but for what a circle falls short of its tangent.
    built.state.pose[2] += 0.02;
    if (std::string(joint).find("weld") != std::string::npos) {
      built.state.pose[0] += 0.5 * (1.0 - std::cos(0.02));
      built.state.pose[1] -= 0.5 * std::sin(0.02);
    }
    EXPECT_NEAR(OpeningOf(built), 0.02, 1e-15) << joint;
    const std::string message = OpenJointOf(built.model, built.state, 1.5);
    EXPECT_NE(message.find("is open by 0.02 rad at t = 1.5 s"), std::string::npos) << message;
  }
}

TEST(JointWatch, MeasuresDistancesAndWhatIsAcrossASlider) {
  Built distance = RodAndBox(R"("type": "distance", "anchors": [[0, 0], [1, 0]])");
  distance.state.pose[0] -= 0.03;
  EXPECT_NEAR(OpeningOf(distance), 0.03, 1e-15);
  Built slider = RodAndBox(R"("type": "prismatic", "anchor": [0, 0], "axis": [1, 0])");
  slider.state.pose[0] += 0.4;
  EXPECT_NEAR(OpeningOf(slider), 0.0, 1e-15);
  slider.state.pose[1] += 0.03;
  EXPECT_NEAR(OpeningOf(slider), 0.03, 1e-15);
}

TEST(JointWatch, KeepsTheWidestOfARunAndSaysOneLineFromAHundredthOn) {
  Built built = RodAndBox(kHinge);
  JointWatch watch(built.model);
  EXPECT_TRUE(watch.watches());
  EXPECT_EQ(watch.Message(built.model), "");
  const double x = built.state.pose[0];
  built.state.pose[0] = x + 0.0099;
  watch.Look(built.model, built.state, 0.1);
  EXPECT_EQ(watch.Message(built.model), "");
  built.state.pose[0] = x + 0.025;
  watch.Look(built.model, built.state, 0.2);
  built.state.pose[0] = x;
  watch.Look(built.model, built.state, 0.3);
  EXPECT_NEAR(watch.opening(), 0.025, 1e-15);
  EXPECT_EQ(watch.Message(built.model),
            "joint j is open by 0.025 m at t = 0.2 s, more than a hundredth of body box (1 m): "
            "expected \"joint_correction\": \"projection\" in \"simulation\", which keeps joints "
            "closed, got \"none\"");
  built.state.pose[0] = std::numeric_limits<double>::quiet_NaN();
  watch.Look(built.model, built.state, 0.4);
  EXPECT_NEAR(watch.opening(), 0.025, 1e-15);
}

TEST(JointWatch, DoesNotWatchWhatIsKeptClosed) {
  EXPECT_FALSE(
      JointWatch(RodAndBox(kHinge, R"({"joint_correction": "projection"})").model).watches());
  EXPECT_FALSE(JointWatch(RodAndBox(kHinge, R"({"stepping": "event"})").model).watches());
  EXPECT_TRUE(
      JointWatch(RodAndBox(kHinge, R"({"stepping": "event", "joint_correction": "none"})").model)
          .watches());
}

// The chain of the defaults by fixed steps: its joints come apart, and with projection they do not.
TEST(JointWatch, SeesAChainThatComesApart) {
  std::string text = test_scenes::HeavyEnd("1", R"("dt": 0.01, "duration": 8)");
  const std::string projection = R"("joint_correction": "projection", )";
  text.erase(text.find(projection), projection.size());
  auto [model, state] = Build(text);
  JointWatch watch(model);
  const RolloutReport report = Rollout(
      model, state,
      [&, &model = model](long, double t, const State<double>& at, Stepper*) {
        watch.Look(model, at, t);
      },
      &state);
  ASSERT_EQ(report.status, StepStatus::kDone);
  EXPECT_GT(watch.opening(), kOpenJoint);
}

}  // namespace
}  // namespace tangible
