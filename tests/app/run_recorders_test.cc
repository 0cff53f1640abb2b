// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/run_recorders.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "../support/scenes.h"
#include "tangible/simulation/stepping/invariants.h"
#include "tangible/simulation/stepping/joint_projection.h"

namespace tangible {
namespace {

int looks = 0;
// Each look is a second after the one before.
double CountingClock() { return ++looks; }

struct RecordedRun {
  Model<double> model;
  State<double> initial, last;
  RunRecorders recorders;
  RolloutReport report;
  // By the definition, at every state.
  double drift = 0.0;
  int islands = 0;

  RecordedRun(const std::string& scene, const std::function<void(RecordedRun*)>& ask) {
    looks = 0;
    BuildModel(test_scenes::SceneOf(scene), &model, &initial);
    recorders.clock = &CountingClock;
    ask(this);
    report = Rollout(
        model, initial,
        [&](long k, double t, const State<double>& state, Stepper* stepper) {
          recorders.Add(model, k, t, state, stepper);
          drift = std::max(drift, JointDrift(model, state));
          if (stepper == nullptr) return;
          std::vector<std::pair<int, int>> closed;
          AddClosedContacts(stepper->record(), &closed);
          islands = std::max(islands, CountIslands(*model.structure, closed.data(), closed.size()));
        },
        &last);
    EXPECT_EQ(report.status, StepStatus::kDone) << report.message;
  }
};

// A pendulum whose joint drifts, and balls that bounce on each other; 600 steps.
std::string SwingAndBounce() {
  return R"({"bodies": [
      {"name": "bob", "mass": 1, "inertia": 0.1, "position": [1, 3]},
      {"name": "low", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [5, 0.1]},
      {"name": "high", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [5, 0.5],
       "restitution": 0.5}, )" +
         std::string(test_scenes::kFloor) + R"(],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["bob", "world"], "anchor": [0, 3]}],
    "simulation": {"dt": 0.002, "duration": 1.2}})";
}

constexpr int kSteps = 600;

TEST(RunRecordersTest, WithoutASummaryNobodyLooksAtTheClock) {
  const RecordedRun run(SwingAndBounce(), [](RecordedRun* made) {
    made->recorders.trajectory.emplace(*made->model.structure, 1);
    made->recorders.contacts.emplace();
  });
  EXPECT_EQ(run.report.steps, kSteps);
  EXPECT_EQ(looks, 0);
  EXPECT_EQ(run.recorders.seconds, 0.0);
}

TEST(RunRecordersTest, TheClockIsReadAroundRowsAndForManyStepsAtOnce) {
  const RecordedRun alone(SwingAndBounce(),
                          [](RecordedRun* made) { made->recorders.summary.emplace(); });
  EXPECT_GT(looks, 0);
  EXPECT_LE(looks, 2 * kSteps / 100);
  // A second each time: the work between two looks is what counts.
  EXPECT_EQ(alone.recorders.seconds, 0.5 * looks);
  const RecordedRun rows(SwingAndBounce(), [](RecordedRun* made) {
    made->recorders.trajectory.emplace(*made->model.structure, 50);
    made->recorders.summary.emplace();
  });
  EXPECT_EQ(looks, 2 * (kSteps / 50 + 1));
  EXPECT_EQ(rows.recorders.seconds, kSteps / 50 + 1.0);
}

TEST(RunRecordersTest, FiguresOfManyStepsAtOnceAreThoseOfEachStep) {
  for (const long every : {1L, 7L, 1000000L}) {
    RecordedRun run(SwingAndBounce(), [every](RecordedRun* made) {
      made->recorders.trajectory.emplace(*made->model.structure, every);
      made->recorders.summary.emplace();
    });
    const OrderedJson summary = run.recorders.summary->ToJson(run.model, run.report, run.last);
    EXPECT_GT(run.drift, 0.0);
    EXPECT_EQ(summary.at("joint_drift_max"), run.drift) << every;
    EXPECT_EQ(run.islands, 3);
    EXPECT_EQ(summary.at("islands_max"), run.islands) << every;
    EXPECT_EQ(summary.at("momentum_end")[0], Momentum(run.model, run.last)[0]) << every;
  }
}

}  // namespace
}  // namespace tangible
