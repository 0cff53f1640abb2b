// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/energy_watch.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

RolloutReport RunBody(const std::string& parts, const std::string& settings) {
  const Scene scene = test_scenes::SceneOf(R"({"bodies": [{"name": "a", "mass": 1, "inertia": 1,
      "position": [1.1, 0], "velocity": [1, 0])" +
                                           parts + R"(, "simulation": )" + settings + "}");
  Model<double> model;
  State<double> first, last;
  BuildModel(scene, &model, &first);
  return Rollout(model, first, {}, &last);
}

constexpr char kSpring[] = R"(}], "springs": [{"name": "s", "bodies": ["a", "world"],
    "anchors": [[1.1, 0], [0, 0]], "stiffness": 5e4, "rest_length": 1}])";
constexpr char kByEvents[] =
    R"({"dt": 0.01, "duration": 2, "stepping": "event", "integrator": "runge_kutta_4"})";

// ω h = 2.2 in a symplectic step, λ h = 8 in an explicit one, ω h = 7 by Runge and Kutta: each
// amplifies by a factor a step.
TEST(EnergyWatchTest, StepsBeyondStabilityAreReportedAsDiverged) {
  for (const RolloutReport& report : {RunBody(kSpring, R"({"dt": 0.01, "duration": 2})"),
                                      RunBody(R"(, "linear_damping": 800}])", kByEvents),
                                      RunBody(kSpring, R"({"dt": 0.03, "duration": 2,
            "stepping": "event", "integrator": "runge_kutta_4"})")}) {
    EXPECT_EQ(report.status, StepStatus::kDiverged);
    EXPECT_NE(report.message.find("though nothing drives the scene: dt is too large"),
              std::string::npos)
        << report.message;
    EXPECT_GT(report.steps, 1);
  }
}

// A motor may bring any energy into a scene that starts nearly at rest; a brake brings none.
TEST(EnergyWatchTest, AMotorDrives) {
  const auto is_driven =
      [](const std::string& speed) {
        Model<double> model;
        State<double> state;
        BuildModel(test_scenes::SceneOf(R"({"gravity": [0, 0], "bodies": [{"name": "w", "mass": 1,
        "inertia": 1, "position": [0, 0], "angular_velocity": 1e-3}], "joints": [{"name": "h",
        "type": "revolute", "bodies": ["w", "world"], "anchor": [0, 0],
        "motor": {"speed": )" + speed + R"(, "limit": 9}}]})"),
                   &model, &state);
        return IsDriven(model, state);
      };
  EXPECT_TRUE(is_driven("10"));
  EXPECT_FALSE(is_driven("0"));
}

TEST(EnergyWatchTest, StepsThatResolveTheSpringAreDone) {
  for (const char* settings :
       {R"({"dt": 0.005, "duration": 2})",
        R"({"dt": 0.005, "duration": 2, "stepping": "event", "integrator": "trapezoidal"})",
        R"({"dt": 0.005, "duration": 2, "stepping": "event", "integrator": "runge_kutta_4"})"}) {
    EXPECT_EQ(RunBody(kSpring, settings).status, StepStatus::kDone) << settings;
  }
}

// A force may bring in any energy.
TEST(EnergyWatchTest, WhatDrivesAndWhatRestsIsNotWatched) {
  const std::string force = R"(}], "forces": [{"name": "f", "body": "a", "force": [1e9, 0]}])";
  EXPECT_EQ(RunBody(force, R"({"dt": 0.01, "duration": 2})").status, StepStatus::kDone);
  EXPECT_EQ(RunBody("}]", R"({"dt": 0.01, "duration": 1000})").status, StepStatus::kDone);
}

// Bodies at rest move by rounding, which is no energy.
TEST(EnergyWatchTest, RoundingOfBodiesAtRestIsNoGrowth) {
  for (const char* parts :
       {R"("bodies": [{"name": "box", "mass": 1, "shape": {"box": {"size": [0.3, 0.7]}},
           "position": [0.1, 0.35]}, {"name": "floor", "static": true,
           "shape": {"half_plane": {"normal": [0, 1]}}}])",
        R"("bodies": [{"name": "rod", "mass": 1.3, "inertia": 0.1, "position": [0.1, -0.3]}],
           "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"],
                       "anchor": [0.1, 0]}])",
        R"("gravity": [0, 0], "bodies": [{"name": "arm", "mass": 1, "inertia": 1,
           "position": [1, 0]}],
           "joints": [{"name": "pin", "type": "revolute", "bodies": ["arm", "world"],
                       "anchor": [0, 0], "limits": [0, 1]}])"}) {
    const Scene scene = test_scenes::SceneOf(std::string("{") + parts +
                                             R"(, "simulation": {"dt": 0.01, "duration": 1,
                                                 "stepping": "event"}})");
    Model<double> model;
    State<double> first, last;
    BuildModel(scene, &model, &first);
    EXPECT_EQ(Rollout(model, first, {}, &last).energy_grown, "") << parts;
  }
}

// A hundred times faster than the only thing that drives it is what was squeezed out of a corner.
TEST(EnergyWatchTest, WhatIsSqueezedOutIsReported) {
  Model<double> model;
  State<double> start;
  BuildModel(test_scenes::SceneOf(R"({"gravity": [0, 0], "bodies": [
      {"name": "a", "mass": 1, "inertia": 1, "position": [0, 0], "velocity": [0.1, 0]},
      {"name": "k", "kinematic": true, "shape": {"circle": {"radius": 0.1}}, "position": [1, 0],
       "velocity": [0.5, 0]}]})"),
             &model, &start);
  State<double> end = start;
  end.twist[0] = 20.0;
  EXPECT_EQ(EnergyOfSqueeze(model, start, end), "");
  end.twist[0] = 60.0;
  EXPECT_NE(EnergyOfSqueeze(model, start, end).find("move at up to 0.5 m/s, end with 1800 J"),
            std::string::npos)
      << EnergyOfSqueeze(model, start, end);
}

}  // namespace
}  // namespace tangible
