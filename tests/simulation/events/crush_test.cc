// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/events/crush.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

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
  for (const auto& [friction, stepping] :
       {std::pair<std::string, std::string>("0", "fixed"), {"0.5", "fixed"}, {"0", "event"}}) {
    const RolloutReport report = RunOf(R"({"gravity": [0, 0], "bodies": [
        {"name": "still", "static": true, "shape": {"half_plane": {"normal": [1, 0]}}},
        {"name": "ram", "kinematic": true, "velocity": [-1, 0],
         "shape": {"half_plane": {"normal": [-1, 0], "offset": -0.5}}},
        {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.1, 0],
         "friction": )" + friction + R"(},
        {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0.3, 0],
         "friction": )" + friction + R"(}],
      "simulation": {"dt": 0.01, "duration": 1, "stepping": ")" +
                                       stepping + R"("}})");
    EXPECT_EQ(report.status, StepStatus::kUnsolved);
    EXPECT_NE(report.message.find("ram, which cannot yield, crushes bodies"), std::string::npos)
        << report.message;
  }
}

// Newton's law would have a ball that fits exactly between two walls rebound from one, into the
// other. It stops instead; a ball elsewhere rebounds all the same.
TEST(CrushTest, ReboundsThatWallsDoNotAllowAreGivenUp) {
  for (const int balls : {1, 4}) {
    std::string bodies;
    for (int k = 0; k < balls; ++k) {
      bodies += R"({"name": "b)" + std::to_string(k) +
                R"(", "shape": {"circle": {"radius": 0.125}}, "mass": 1, "position": [)" +
                std::to_string(0.125 + 0.25 * k) + R"(, 0], "velocity": [1, 0.5],
                "friction": 0.1, "restitution": 0.8}, )";
    }
    Model<double> model;
    State<double> state;
    BuildModel(test_scenes::SceneOf(R"({"gravity": [0, 0], "bodies": [)" + bodies + R"(
        {"name": "free", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [9, 0],
         "velocity": [1, 0], "restitution": 0.8},
        {"name": "left", "static": true, "friction": 0.1, "restitution": 0.8,
         "shape": {"half_plane": {"normal": [1, 0]}}},
        {"name": "right", "static": true, "friction": 0.1, "restitution": 0.8,
         "shape": {"box": {"size": [1, 8]}}, "position": [)" +
                                    std::to_string(0.25 * balls + 0.5) + R"(, 0]},
        {"name": "far", "static": true, "restitution": 0.8,
         "shape": {"half_plane": {"normal": [-1, 0], "offset": -9.105}}}],
        "no_contact": [["b*", "far"], ["free", "left"], ["free", "right"]],
        "simulation": {"dt": 0.01, "duration": 0.1}})"),
               &model, &state);
    const RolloutReport report = Rollout(model, state, {}, &state);
    EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
    EXPECT_EQ(report.given_up.rebounds_given_up, 1) << balls;
    for (int k = 0; k < balls; ++k) EXPECT_NEAR(state.twist[3 * k], 0.0, 1e-12) << balls;
    EXPECT_NEAR(state.twist[3 * balls], -0.8, 1e-12);
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

// A block as wide as its slot, which a force presses against one side for 0.2 s: friction brakes it
// as long, v = 1 - mu F 0.2. Both sides may press on it by any equal forces afterwards, and do not.
TEST(CrushTest, NothingSqueezesABlockInASlotBehindItsLoad) {
  for (const auto& [friction, force] : {std::pair(0.1, 4.0), {0.25, 4.0}, {0.25, 2.0}}) {
    for (const double dt : {0.01, 0.001, 0.0073}) {
      const std::string mu = R"(, "friction": )" + test_scenes::Text(friction);
      Model<double> model;
      State<double> state;
      BuildModel(test_scenes::SceneOf(R"({"gravity": [0, 0], "bodies": [
          {"name": "l", "static": true, "shape": {"half_plane": {"normal": [1, 0], "offset": -0.1}})" +
                                      mu + R"(},
          {"name": "r", "static": true, "shape": {"half_plane": {"normal": [-1, 0], "offset": -0.1}})" +
                                      mu + R"(},
          {"name": "b", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1, "position": [0, 0],
           "velocity": [0, 1])" + mu + R"(}],
        "forces": [{"name": "n", "body": "b", "force": [)" +
                                      test_scenes::Text(force) + R"(, 0], "end": 0.2}],
        "simulation": {"dt": )" + test_scenes::Text(dt) +
                                      R"(, "duration": 0.6}})"),
                 &model, &state);
      const RolloutReport report = Rollout(model, state, {}, &state);
      EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
      EXPECT_NEAR(state.twist[3 * 2 + 1], 1.0 - friction * force * 0.2, 1e-9)
          << friction << " " << dt;
    }
  }
}

// The same of a block that is held there against gravity: it falls as the force ends. And of one
// that slides between walls that move with it, or are tilted, which nothing presses: their rounded
// places come nearer to each other in many steps.
TEST(CrushTest, NothingHoldsABlockInASlotThatNothingPresses) {
  const auto twist_of_last = [](const std::string& text) {
    Model<double> model;
    State<double> state;
    BuildModel(test_scenes::SceneOf(text), &model, &state);
    const RolloutReport report = Rollout(model, state, {}, &state);
    EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
    return std::pair(state.twist[3 * 2], state.twist[3 * 2 + 1]);
  };
  for (const double dt : {0.02, 0.01, 0.001}) {
    for (const char* force : {"50", "90"}) {
      const auto twist = twist_of_last(
          R"({"gravity": [0, -10], "bodies": [
          {"name": "l", "static": true, "friction": 0.4,
           "shape": {"half_plane": {"normal": [1, 0], "offset": 0}}},
          {"name": "r", "static": true, "friction": 0.4,
           "shape": {"half_plane": {"normal": [-1, 0], "offset": -0.2}}},
          {"name": "b", "shape": {"box": {"size": [0.2, 0.4]}}, "mass": 1, "position": [0.1, 0],
           "friction": 0.4}],
        "forces": [{"name": "f", "body": "b", "force": [)" +
          std::string(force) + R"(, 0], "end": 0.2}],
        "simulation": {"dt": )" +
          test_scenes::Text(dt) + R"(, "duration": 0.5}})");
      EXPECT_NEAR(twist.second, -3.0, 1e-9) << dt << " " << force;
    }
  }
  for (const double dt : {0.01, 0.001, 0.0002}) {
    const std::string simulation =
        R"("simulation": {"dt": )" + test_scenes::Text(dt) + R"(, "duration": 0.5}})";
    const std::string wall =
        R"("kinematic": true, "velocity": [0.3, 0.5], "friction": 0.3,
            "shape": {"box": {"size": [1, 6]}})";
    const auto driven =
        twist_of_last(R"({"gravity": [0, 0], "bodies": [{"name": "l", "position": [-0.5, 0], )" +
                      wall + R"(}, {"name": "r", "position": [0.7, 0], )" + wall +
                      R"(}, {"name": "b", "shape": {"box": {"size": [0.2, 0.4]}}, "mass": 1,
              "position": [0.1, 0], "velocity": [0.3, -0.5], "friction": 0.3}], )" +
                      simulation);
    EXPECT_NEAR(driven.second, -0.5, 1e-9) << dt;
    for (const double tilt : {-2.0, 0.3}) {
      const std::string c = test_scenes::Text(std::cos(tilt)),
                        n = test_scenes::Text(std::sin(tilt));
      const std::string minus_c = test_scenes::Text(-std::cos(tilt)),
                        minus_n = test_scenes::Text(-std::sin(tilt));
      const auto tilted = twist_of_last(
          R"({"gravity": [0, 0], "bodies": [
          {"name": "l", "static": true, "friction": 0.3,
           "shape": {"half_plane": {"normal": [)" +
          c + ", " + n + R"(], "offset": -0.1}}},
          {"name": "r", "static": true, "friction": 0.3,
           "shape": {"half_plane": {"normal": [)" +
          minus_c + ", " + minus_n + R"(], "offset": -0.1}}},
          {"name": "b", "shape": {"box": {"size": [0.2, 0.4]}}, "mass": 1, "position": [0, 0],
           "angle": )" +
          test_scenes::Text(tilt) + R"(, "velocity": [)" + minus_n + ", " + c +
          R"(], "friction": 0.3}], )" + simulation);
      EXPECT_NEAR(std::hypot(tilted.first, tilted.second), 1.0, 1e-9) << dt << " " << tilt;
    }
  }
}

// The places of both sides are rounded, so that a body that just fits is in one of them by 1e-17 m.
TEST(CrushTest, ABodyThatJustFitsIntoItsSlotMayRestThere) {
  for (const double left : {0.1, 1.7, -0.4}) {
    for (const double dt : {0.1, 0.01, 0.001, 1e-4}) {
      for (const char* gravity : {"0, 0", "0, -9.81"}) {
        const std::string at = test_scenes::Text(left), to = test_scenes::Text(left + 0.2);
        const RolloutReport report = RunOf(R"({"gravity": [)" + std::string(gravity) +
                                           R"(], "bodies": [
            {"name": "b", "shape": {"box": {"size": [0.2, 0.2]}}, "mass": 1, "position": [)" +
                                           test_scenes::Text(left + 0.1) + R"(, 0.5]},
            {"name": "room", "static": true, "shape": {"polyline": {"closed": true,
             "solid": "right", "points": [[)" +
                                           at + ", 0], [" + to + ", 0], [" + to + ", 1], [" + at +
                                           R"(, 1]]}}}],
            "simulation": {"dt": )" + test_scenes::Text(dt) +
                                           R"(, "duration": )" +
                                           test_scenes::Text(std::min(0.2, 200.0 * dt)) + "}}");
        EXPECT_EQ(report.status, StepStatus::kDone) << left << " " << dt << ": " << report.message;
      }
    }
  }
}

}  // namespace
}  // namespace tangible
