// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/crush.h"

#include <gtest/gtest.h>

#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

RolloutReport RunOf(const std::string& text) {
  Model<double> model;
  State<double> state;
  BuildModel(test_scenes::SceneOf(text), &model, &state);
  return Rollout(model, state, {}, &state);
}

// A wall of given velocity pushes discs in a row against a wall that stands still: they cannot go
// anywhere, whatever the friction.
TEST(CrushTest, AWallThatCannotYieldIsNamed) {
  for (const std::string friction : {"0", "0.5"}) {
    const RolloutReport report = RunOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "still", "static": true, "shape": {"half_plane": {"normal": [1, 0]}}},
        {"name": "ram", "kinematic": true, "velocity": [-1, 0],
         "shape": {"half_plane": {"normal": [-1, 0], "offset": -0.5}}},
        {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.1, 0],
         "friction": )" + friction + R"(},
        {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.3, 0],
         "friction": )" + friction + R"(}],
      "simulation": {"dt": 0.01, "duration": 1}})");
    EXPECT_EQ(report.status, StepStatus::kUnsolved);
    EXPECT_NE(report.message.find("ram, which cannot yield, crushes bodies"), std::string::npos)
        << report.message;
  }
}

// A wedge between a ram and the floor gives way without friction and jams with much of it: the
// half-plane that pushes leans over by 30 degrees, and a disc jams where μ > tan 15°.
TEST(CrushTest, FrictionThatJamsIsSaid) {
  const auto run = [](const std::string& friction) {
    return RunOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1]}},
         "friction": )" +
                 friction + R"(},
        {"name": "ram", "kinematic": true, "velocity": [-1, 0], "friction": )" +
                 friction + R"(,
         "shape": {"half_plane": {"normal": [-0.5, -0.8660254037844386],
                                  "offset": -0.5}}},
        {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.1, 0.1],
         "friction": )" +
                 friction + R"(}],
      "simulation": {"dt": 0.01, "duration": 1}})");
  };
  const RolloutReport slides = run("0.2");
  EXPECT_EQ(slides.status, StepStatus::kDone) << slides.message;
  const RolloutReport jams = run("0.5");
  EXPECT_EQ(jams.status, StepStatus::kUnsolved);
  EXPECT_NE(jams.message.find("ram, which cannot yield, jams bodies by friction"),
            std::string::npos)
      << jams.message;
}

// Without a body of given motion nothing is said of one.
TEST(CrushTest, OthersAreNotBlamed) {
  ContactProblem<double> problem;
  ModelStructure structure;
  EXPECT_EQ(WhoCannotYield(structure, {}, problem, -1, {}), "");
}

}  // namespace
}  // namespace tangible
