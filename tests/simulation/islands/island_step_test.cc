// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/islands/island_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "island_scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

using test_scenes::Number;
using test_scenes::Row;
using test_scenes::SceneOf;

struct Course {
  RolloutReport report;
  State<double> final;
  long motions = 0;  // of a body over a segment, after the first step
  long impacts = 0;
  int most_islands = 0;
};

Course Simulate(const std::string& text) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(text), &model, &state);
  Course run;
  run.report = Rollout(
      model, state,
      [&](long k, double, const State<double>&, Stepper* stepper) {
        if (k < 2) return;
        const IslandRecords& records = stepper->parts();
        run.most_islands = std::max(run.most_islands, records.num_islands);
        for (int i = 0; i < records.num_islands; ++i) {
          const EventRecord& events = records.islands[i]->events;
          for (int p = 0; p < events.num_parts; ++p) {
            const EventPart& part = *events.parts[p];
            run.impacts += part.is_impulses ? 1 : 0;
            run.motions += part.is_impulses ? 0 : part.segment.stages[0].problem.num_bodies;
          }
        }
      },
      &run.final);
  EXPECT_EQ(run.report.status, StepStatus::kDone) << run.report.message;
  return run;
}

std::vector<int> UpTo(int count) {
  std::vector<int> balls(static_cast<size_t>(count));
  std::iota(balls.begin(), balls.end(), 0);
  return balls;
}

// Poses and twists of order 1, in which the first step, of all bodies together, leaves rounding
// that impacts multiply by less than ten.
constexpr double kRounding = 1e-13;

TEST(IslandStep, EachBallMovesAsAlone) {
  constexpr int kBalls = 6;
  constexpr double kDuration = 1.2;
  const Course together = Simulate(Row(UpTo(kBalls), kDuration));
  EXPECT_GE(together.most_islands, 3);
  long events = 0;
  for (int ball = 0; ball < kBalls; ++ball) {
    const Course alone = Simulate(Row({ball}, kDuration));
    events += alone.report.events;
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(together.final.pose[3 * (2 + ball) + i], alone.final.pose[3 * 2 + i], kRounding);
      EXPECT_NEAR(together.final.twist[3 * (2 + ball) + i], alone.final.twist[3 * 2 + i],
                  kRounding);
    }
  }
  EXPECT_EQ(together.report.events, events);
  EXPECT_GT(events, 5 * kBalls);
  EXPECT_NEAR(together.final.pose[3], -0.2 * kDuration, kRounding);
  EXPECT_NEAR(together.final.pose[4], -0.02 + 0.01 * kDuration, kRounding);
  EXPECT_EQ(together.final.twist[3], -0.2);
}

// An event costs motions of the bodies of its island alone, but for one in a step, which may end
// the motions of all: the motions of each body are bounded however many there are.
TEST(IslandStep, TheCostOfAnEventIsThatOfItsIsland) {
  constexpr int kBalls = 100;
  const Course course = Simulate(Row(UpTo(kBalls), 0.7));
  const long steps = course.report.steps - 1;
  EXPECT_GT(course.impacts, 3 * steps);
  EXPECT_LE(course.motions, 2 * kBalls * steps + 2 * course.impacts);
  // If every event ended the motions of all, these would be more than twice as many.
  EXPECT_LT(2 * course.motions, kBalls * (steps + course.impacts));
}

std::string Free(const std::string& bodies, double duration, const std::string& more = "") {
  return R"({"gravity": [0, 0], "bodies": [)" + bodies + "]" + more +
         R"(, "simulation": {"stepping": "event", "dt": 0.1, "duration": )" + Number(duration) +
         "}}";
}

std::string Disc(const std::string& name, double mass, double x, double y, double vx) {
  return R"({"name": ")" + name + R"(", "shape": {"circle": {"radius": 0.1}}, "mass": )" +
         Number(mass) + R"(, "position": [)" + Number(x) + ", " + Number(y) +
         R"(], "velocity": [)" + Number(vx) + R"(, 0], "restitution": 1})";
}

// Two discs of equal mass swap their velocities, in the same step as two others far away; a fifth
// flies alone all the time.
TEST(IslandStep, BodiesThatMeetAreOneIsland) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(Free(Disc("left", 1, 0, 0, 1) + "," + Disc("right", 1, 1.2, 0, -0.5) + "," +
                              Disc("far", 1, 0, 7, 1) + "," + Disc("third", 1, 0, 20, 1) + "," +
                              Disc("fourth", 1, 1.21, 20, -0.5),
                          2.0)),
             &model, &state);
  std::vector<int> islands, bodies_of_last;
  State<double> final;
  const RolloutReport report = Rollout(
      model, state,
      [&](long k, double, const State<double>&, Stepper* stepper) {
        if (k < 2) return;
        const IslandRecords& records = stepper->parts();
        islands.push_back(records.num_islands);
        const IslandRecord& last = *records.islands[records.num_islands - 1];
        bodies_of_last.push_back(last.part ? last.part->structure->num_blocks() : 5);
      },
      &final);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_EQ(report.events, 2);
  // Without events all are one island; those that meet are two others.
  EXPECT_EQ(islands.front(), 1);
  EXPECT_EQ(islands.back(), 1);
  const auto meet = std::find(islands.begin(), islands.end(), 3);
  ASSERT_NE(meet, islands.end());
  EXPECT_EQ(bodies_of_last[meet - islands.begin()], 2);
  // They meet at t = 1 / 1.5.
  const double met = 1.0 / 1.5;
  EXPECT_NEAR(final.pose[0], met - 0.5 * (2.0 - met), 1e-13);
  EXPECT_NEAR(final.pose[3], 1.2 - 0.5 * met + (2.0 - met), 1e-13);
  EXPECT_NEAR(final.pose[6], 2.0, 1e-13);
  EXPECT_NEAR(final.twist[0], -0.5, 1e-14);
  EXPECT_NEAR(final.twist[3], 1.0, 1e-14);
}

// A heavy disc throws a light one at rest so far within a step that it meets a third one, which the
// first guess of the islands cannot know. One-dimensional elastic impacts.
TEST(IslandStep, ABodyThatIsThrownOutOfItsIslandIsFound) {
  const double heavy = 1000.0, speed = 1.0;
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(Free(Disc("heavy", heavy, 0, 0, speed) + "," + Disc("light", 1, 0.33, 0, 0) +
                              "," + Disc("third", 1, 0.60, 0, 0) + "," + Disc("far", 1, 0, 7, 0),
                          0.2)),
             &model, &state);
  State<double> final;
  int most_blocks = 0;
  const RolloutReport report = Rollout(
      model, state,
      [&](long k, double, const State<double>&, Stepper* stepper) {
        if (k < 2) return;
        const IslandRecords& records = stepper->parts();
        for (int i = 0; i < records.num_islands && !records.IsWhole(); ++i) {
          most_blocks = std::max(most_blocks, records.islands[i]->part->structure->num_blocks());
        }
      },
      &final);
  ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  EXPECT_EQ(most_blocks, 3);
  const double thrown = 2.0 * heavy / (heavy + 1.0) * speed;
  const double slower = (heavy - 1.0) / (heavy + 1.0) * speed;
  const double first = 0.13 / speed;
  const double second = first + 0.07 / thrown;
  EXPECT_NEAR(final.twist[6], thrown, 1e-13);
  EXPECT_NEAR(final.twist[3], 0.0, 1e-13);
  EXPECT_NEAR(final.twist[0], slower, 1e-13);
  EXPECT_NEAR(final.pose[6], 0.60 + thrown * (0.2 - second), 1e-12);
  EXPECT_NEAR(final.pose[3], 0.40, 1e-12);
}

// A run that is continued from a state and its guess has the same bits.
TEST(IslandStep, ContinuesWithTheSameBits) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(Row(UpTo(5), 1.5)), &model, &state);
  Stepper stepper(model);
  StepperGuess guess;
  State<double> half;
  for (int k = 0; k < 150; ++k) {
    if (k == 120) {
      stepper.SaveGuess(&guess);
      half = state;
    }
    ASSERT_EQ(stepper.Step(model, 0.01 * k, 0.01, &state).status, StepStatus::kDone);
  }
  EXPECT_FALSE(guess.events.contacts.empty());
  Stepper other(model);
  other.SetGuess(guess);
  for (int k = 120; k < 150; ++k) {
    ASSERT_EQ(other.Step(model, 0.01 * k, 0.01, &half).status, StepStatus::kDone);
  }
  EXPECT_EQ(half.pose, state.pose);
  EXPECT_EQ(half.twist, state.twist);
}

// Impulses and forces of the islands are listed with the bodies and joints of the scene.
TEST(IslandStep, TheStepIsReportedByTheBodiesOfTheScene) {
  Model<double> model;
  State<double> state;
  BuildModel(SceneOf(R"({"bodies": [
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1]}}},
      {"name": "flies", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 9]},
      {"name": "a", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [3, 5]},
      {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 2, "position": [6, 5]},
      {"name": "rests", "shape": {"circle": {"radius": 0.1}}, "mass": 3, "position": [9, 0.1]},
      {"name": "lands", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [12, 0.102]},
      {"name": "too", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [15, 0.1021]}],
    "joints": [{"name": "ja", "type": "revolute", "bodies": ["a", "world"], "anchor": [3, 5]},
               {"name": "jb", "type": "revolute", "bodies": ["b", "world"], "anchor": [6, 5]}],
    "simulation": {"stepping": "event", "dt": 0.01, "duration": 1}})"),
             &model, &state);
  Stepper stepper(model);
  StepReport report;
  // Two bodies land after 0.0202 s.
  for (int k = 0; k < 3; ++k) {
    report = stepper.Step(model, 0.01 * k, 0.01, &state);
    ASSERT_EQ(report.status, StepStatus::kDone) << report.message;
  }
  EXPECT_EQ(report.events, 2);
  EXPECT_EQ(report.islands, 3);
  const StepRecord& record = stepper.record();
  ASSERT_EQ(record.contacts.size(), 3u);
  EXPECT_EQ(record.contacts[0].a, 0);
  EXPECT_EQ(record.contacts[0].b, 4);
  EXPECT_EQ(record.contacts[1].b, 5);
  EXPECT_EQ(record.contacts[2].b, 6);
  EXPECT_NEAR(record.solution.normal_impulse[0], 3 * 9.81 * 0.01, 1e-14);
  EXPECT_NEAR(record.solution.normal_impulse[1], 9.81 * 0.03, 1e-13);  // its momentum
  ASSERT_EQ(record.solution.joint_impulse.size(), 6u);
  EXPECT_NEAR(record.solution.joint_impulse[1], 1 * 9.81 * 0.01, 1e-14);
  EXPECT_NEAR(record.solution.joint_impulse[4], 2 * 9.81 * 0.01, 1e-14);
  EXPECT_EQ(report.mode_switches, 2);
}

}  // namespace
}  // namespace tangible
