// SPDX-License-Identifier: Apache-2.0
//
// What programs say of a run that is done: what the defaults of each stepping keep, and one line on
// what they do not.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "../support/scenes.h"
#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

constexpr char kRemedy[] = R"("joint_correction": "projection")";

// Ten links by fixed steps of the defaults: their joints are open by a quarter of a link after 8 s.
std::string Chain(const std::string& duration) {
  std::string text = test_scenes::HeavyEnd("1", R"("dt": 0.01, "duration": )" + duration);
  const std::string projection = std::string(kRemedy) + ", ";
  text.erase(text.find(projection), projection.size());
  return text;
}

class WarningsTest : public ProgramTest {
 protected:
  /// Runs a scene; its summary is in summary_.
  ProgramRun Simulate(const std::string& scene, const std::string& flags = "") {
    const ProgramRun run =
        Run("tangible-simulate",
            "'" + Write("scene.json", scene) + "' --summary='" + Path("s.json") + "' " + flags);
    summary_ = json::parse(Read(Path("s.json")));
    return run;
  }
  double EnergyGain() const {
    return summary_["energy_end"].get<double>() - summary_["energy_start"].get<double>();
  }

  json summary_;
};

// 5 s in which the loop turns over and over: it keeps 20.45 J and its hinges.
TEST_F(WarningsTest, EventSteppingKeepsALoopsEnergyAndJointsByDefault) {
  const ProgramRun run =
      Simulate(test_scenes::FourBar(R"({"dt": 0.005, "duration": 5, "stepping": "event"})"));
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_EQ(run.error, "");
  EXPECT_NEAR(EnergyGain(), 0.0, 1e-6);
  EXPECT_LE(summary_["joint_drift_max"].get<double>(), 1e-10);
  EXPECT_EQ(summary_["warnings"], json::array());
}

TEST_F(WarningsTest, SemiImplicitEulerByEventsIsRefused) {
  const std::string scene =
      Write("scene.json", test_scenes::FourBar(R"({"integrator": "semi_implicit_euler", "dt": 0.005,
                                             "duration": 5, "stepping": "event"})"));
  ExpectOneLine(Run("tangible-simulate", "'" + scene + "'"), 1,
                "/simulation/integrator: expected \"runge_kutta_4\" or");
}

// A spring that the step does not resolve: the phase of a step, 3.2 rad, is unstable.
TEST_F(WarningsTest, EnergyThatGrowsByEventsIsOneLine) {
  const auto spring = [](const std::string& stiffness) {
    return R"({"gravity": [0, 0], "bodies": [
                {"name": "b", "mass": 1, "inertia": 1, "position": [1.1, 0]}],
                "springs": [{"name": "s", "bodies": ["b", "world"], "rest_length": 1,
                             "anchors": [[1.1, 0], [0, 0]], "stiffness": )" +
           stiffness + R"(}],
                "simulation": {"dt": 0.01, "duration": 0.05, "stepping": "event"}})";
  };
  ExpectOneLine(Simulate(spring("1e5")), 0, "the energy grew from 500 J to");
  EXPECT_GT(EnergyGain(), 1.0);
  EXPECT_EQ(Simulate(spring("1e3")).error, "");
}

// Discs at one place are pushed apart, each by those on top of it: by 3 m/s a disc.
TEST_F(WarningsTest, OverlapThatThrowsBodiesIsOneLine) {
  const auto discs = [](int count, double apart, double speed = 0.0) {
    json scene = {{"simulation", {{"dt", 0.01}, {"duration", 0.1}}}, {"bodies", json::array()}};
    for (int i = 0; i < count; ++i) {
      scene["bodies"].push_back({{"name", "d" + std::to_string(i)},
                                 {"shape", {{"circle", {{"radius", 0.1}}}}},
                                 {"mass", 1},
                                 {"velocity", {i % 2 == 0 ? -speed : speed, 0}},
                                 {"position", {apart * i, 1}}});
    }
    return scene.dump();
  };
  for (const double apart : {0.0, 1e-9}) {
    ExpectOneLine(Simulate(discs(60, apart)), 0, "as bodies that overlap, by up to 0.2 m");
    EXPECT_EQ(summary_["warnings"].size(), 1u);
    EXPECT_GT(EnergyGain(), 1e4);
  }
  // Energy of their own does not hide it.
  for (const double speed : {10.0, 100.0, 600.0}) {
    ExpectOneLine(Simulate(discs(60, 0.0, speed)), 0, "as bodies that overlap, by up to 0.2 m");
  }
  // Two that overlap come apart at recovery_speed; the others have no reason to.
  EXPECT_EQ(Simulate(discs(2, 0.1)).error, "");
  EXPECT_EQ(Simulate(discs(60, 0.21)).error, "");
}

// The contact point of a slender ellipse runs from one tip to the other within a step; motions are
// so short that its energy does not grow.
TEST_F(WarningsTest, ASlenderEllipseKeepsItsEnergy) {
  const ProgramRun run = Simulate(
      R"({"bodies": [{"name": "e", "shape": {"ellipse": {"radii": [1, 0.003]}}, "mass": 1,
                      "position": [0, 0.5], "angle": 0.3},
          {"name": "f", "static": true, "shape": {"half_plane": {"normal": [0, 1]}}}],
          "simulation": {"dt": 0.005, "duration": 1, "stepping": "event"}})");
  EXPECT_EQ(run.error, "");
  EXPECT_LT(EnergyGain(), 0.0);  // it lands
  EXPECT_GT(summary_["ellipse_motions"], 50);
}

TEST_F(WarningsTest, OpenJointsAreOneLineWithTheRemedy) {
  const ProgramRun run = Simulate(Chain("8"));
  ExpectOneLine(run, 0, kRemedy);
  EXPECT_NE(run.error.find("scene.json: warning: joint pin"), std::string::npos) << run.error;
  ASSERT_EQ(summary_["warnings"].size(), 1u);
  EXPECT_NE(run.error.find(summary_["warnings"][0].get<std::string>()), std::string::npos);
  // Also without a summary, and the trajectory is written all the same.
  const ProgramRun plain = Run("tangible-simulate", "'" + Path("scene.json") + "' --every=100");
  EXPECT_EQ(plain.error, run.error);
  EXPECT_EQ(std::count(plain.out.begin(), plain.out.end(), '\n'), 1 + 10 * 9);
}

TEST_F(WarningsTest, JointsThatHoldAreNotWorthALine) {
  EXPECT_EQ(Simulate(Chain("0.1")).error, "");
  EXPECT_EQ(summary_["warnings"], json::array());
  EXPECT_EQ(Simulate(test_scenes::HeavyEnd("1", R"("dt": 0.01, "duration": 8)")).error, "");
  EXPECT_EQ(summary_["warnings"], json::array());
}

TEST_F(WarningsTest, ARunThatFailsHasOneLineAlone) {
  const ProgramRun run = Simulate(R"({"bodies": [
          {"name": "a", "mass": 1, "inertia": 1, "position": [1, 0]}],
        "joints": [{"name": "pin", "type": "revolute", "bodies": ["a", "world"], "anchor": [0, 0]}],
        "springs": [{"name": "s", "bodies": ["a", "world"], "anchors": [[1, 1], [3, 1]],
                     "stiffness": 1e9, "rest_length": 1}],
        "simulation": {"dt": 0.01, "duration": 10}})");
  ExpectOneLine(run, 1, "dt is too large");
}

// A box of half a metre that slides: at 1e6 m its contacts are more than rounding.
TEST_F(WarningsTest, CoordinatesThatAreTooLargeAreOneLine) {
  const auto at = [](const std::string& x) {
    return R"({"bodies": [
        {"name": "box", "shape": {"box": {"size": [0.5, 0.5]}}, "mass": 1, "velocity": [1, 0],
         "position": [)" +
           x + R"(, 0.25]},
        {"name": "floor", "static": true,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
      "simulation": {"dt": 0.01, "duration": 0.1, "stepping": "event"}})";
  };
  EXPECT_EQ(Simulate(at("1e6")).error, "");
  EXPECT_NEAR(summary_["rounding_of_coordinates"].get<double>(), 4.02e-8, 1e-10);
  EXPECT_EQ(summary_["warnings"], json::array());
  const ProgramRun run = Simulate(at("1e9"), "--certify");
  ExpectOneLine(run, 0, "coordinates are too large: body box is 1e+09 m from the origin");
  EXPECT_NE(run.error.find(summary_["warnings"][0].get<std::string>()), std::string::npos);
  const std::string verdict = summary_["certificate"]["verdict"];
  EXPECT_NE(verdict.find("coordinates are too large"), std::string::npos) << verdict;
}

TEST_F(WarningsTest, ABatchSaysItOnce) {
  Write("scene.json", Chain("8"));
  Write("rows.csv", "gravity/y\n0\n-9.81\n-9.8\n-9.7\n");
  const ProgramRun run =
      Run("tangible-simulate", "'" + Path("scene.json") + "' --batch='" + Path("rows.csv") + "'");
  ExpectOneLine(run, 0, kRemedy);
  EXPECT_NE(run.error.find("rows.csv: line 3: warning: joint pin"), std::string::npos) << run.error;
  EXPECT_NE(run.error.find("2 more rows"), std::string::npos) << run.error;
}

// A ball that touches nothing: its position is rounding, and so it is in a batch.
TEST_F(WarningsTest, AFreeBodyFarAwayIsOneLineToo) {
  const std::string text = R"({"gravity": [0, 0], "bodies": [{"name": "ball",
      "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [1e17, 0]}],
    "simulation": {"dt": 0.01, "duration": 0.1, "stepping": "event"}})";
  EXPECT_NE(Simulate(text).error.find("coordinates are too large: body ball is 1e+17 m"),
            std::string::npos);
  EXPECT_EQ(summary_["warnings"].size(), 1u);
  Write("rows.csv", "bodies/ball/mass\n1\n2\n");
  const ProgramRun run =
      Run("tangible-simulate", "'" + Path("scene.json") + "' --batch='" + Path("rows.csv") + "'");
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_EQ(std::count(run.error.begin(), run.error.end(), '\n'), 1);
  EXPECT_NE(run.error.find("rows.csv: line 2: warning: coordinates are too large"),
            std::string::npos)
      << run.error;
}

TEST_F(WarningsTest, AGradientSaysItToo) {
  const ProgramRun run =
      Run("tangible-gradient", "'" + Write("scene.json", Chain("8")) +
                                   "' --parameters=gravity/y --out='" + Path("g.json") + "'");
  ExpectOneLine(run, 0, kRemedy);
  const std::string note = json::parse(Read(Path("g.json")))["notes"].back();
  EXPECT_NE(run.error.find(note), std::string::npos) << note;
}

TEST_F(WarningsTest, AStartBeyondALimitIsNamed) {
  const auto scene = [](const std::string& low) {
    return R"({"gravity": [0, 0], "bodies": [
        {"name": "b", "mass": 1, "inertia": 1, "position": [0, 0]}],
        "joints": [{"name": "rail", "type": "prismatic", "bodies": ["b", "world"],
                    "anchor": [0, 0], "axis": [1, 0], "limits": [)" +
           low + R"(, 2]}], "simulation": {"dt": 0.01, "duration": 0.1}})";
  };
  const ProgramRun beyond = Simulate(scene("1"), "--out=/dev/null");
  EXPECT_EQ(beyond.exit_status, 0);
  EXPECT_NE(beyond.error.find("begins with joint rail beyond its low limit by 1 m"),
            std::string::npos)
      << beyond.error;
  EXPECT_EQ(Simulate(scene("0"), "--out=/dev/null").error.find("limit"), std::string::npos);
}

// A hand that moves evenly carries a bob, which begins at rest or with the hand's speed.
TEST_F(WarningsTest, WhatHangsOnAMovingBodyAndBeginsAtRestIsNamed) {
  const auto scene = [](const std::string& velocity) {
    return R"({"bodies": [
        {"name": "hand", "kinematic": true, "position": [0, 0],
         "motion": {"interpolation": "linear", "time": [-1, 2], "x": [-1, 2]}},
        {"name": "bob", "mass": 1, "inertia": 0.1, "position": [0, -1], "velocity": )" +
           velocity + R"(}], "joints": [{"name": "pin", "type": "revolute",
        "bodies": ["bob", "hand"], "anchor": [0, 0]}],
        "simulation": {"dt": 0.01, "duration": 0.1, "stepping": "event"}})";
  };
  ExpectOneLine(Simulate(scene("[0, 0]")), 0,
                "begins with joint pin, to body hand of given motion, moving apart at 1 m/s");
  EXPECT_EQ(Simulate(scene("[1, 0]")).error, "");
}

// A disc that falls beside a half-pipe is behind its upright wall, and is pushed in through it.
TEST_F(WarningsTest, WhatComesBehindALinePastItsEndIsNamed) {
  const auto at = [](const char* x) {
    return std::string(R"({"bodies": [{"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1,
        "position": [)") +
           x + R"(, 0.5]}, {"name": "pipe", "static": true, "shape": {"polyline": {"points":
        [[-1, 0], [-0.7, -0.7], [0, -1], [0.7, -0.7], [1, 0]], "solid": "right"}}}],
        "simulation": {"dt": 0.01, "duration": 0.6, "stepping": "event"}})";
  };
  ExpectOneLine(Simulate(at("1.2")), 0, "body b is behind the line of body pipe from t = 0.4");
  EXPECT_EQ(Simulate(at("0.2")).error, "");
}

// A bob that its string has let go is where it flies.
TEST_F(WarningsTest, AJointThatHasEndedHasNoDrift) {
  const ProgramRun run = Simulate(R"({"bodies": [
      {"name": "b", "mass": 1, "inertia": 0.01, "position": [1, 0], "velocity": [0, 2]}],
      "joints": [{"name": "s", "type": "distance", "bodies": ["b", "world"],
                  "anchors": [[1, 0], [0, 0]], "until": 0.3}],
      "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_LE(summary_["joint_drift_max"].get<double>(), 1e-10);
}

}  // namespace
}  // namespace tangible
