// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/stepping/rollout.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "../../support/scenes.h"
#include "tangible/verification/support/random_scene.h"
#include "tangible/verification/support/trace.h"

namespace tangible {
namespace {

TEST(RolloutTest, TwoRunsHaveTheSameBits) {
  int moved = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    Model<double> model;
    State<double> initial, first, second;
    BuildModel(RandomScene(seed), &model, &initial);
    Stepper stepper(model);
    Rollout(model, initial, {}, &stepper, &first);
    Rollout(model, initial, {}, &stepper, &second);  // the stepper's memory is used again
    EXPECT_TRUE(first == second) << seed;
    Rollout(model, initial, {}, &second);
    EXPECT_TRUE(first == second) << seed;
    moved += first == initial ? 0 : 1;
  }
  EXPECT_GE(moved, 28);  // friction on the plane may hold all that a scene has
}

TEST(RolloutTest, ObserverSeesEveryStateWithItsRecord) {
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> initial, final;
  BuildModel(scene, &model, &initial);
  long next = 0;
  const RolloutReport report = Rollout(
      model, initial,
      [&](long k, double t, const State<double>& state, Stepper* stepper) {
        EXPECT_EQ(k, next++);
        EXPECT_EQ(t, StepTime(scene.simulation, k));
        EXPECT_EQ(stepper == nullptr, k == 0);
        if (stepper != nullptr) {
          EXPECT_EQ(stepper->record().time, StepTime(scene.simulation, k - 1));
          EXPECT_EQ(stepper->record().new_twist, state.twist);
        }
        final = state;
      },
      &initial);  // the final state may be the initial one
  EXPECT_EQ(next, 64);
  EXPECT_EQ(report.steps, 63);
  EXPECT_NEAR(report.time, 0.63, 1e-15);
  EXPECT_TRUE(final == initial);
  EXPECT_GT(report.contacts_max, 0);
  EXPECT_LE(report.residual, 1e-10);
}

// Only the guess is missing where the second range begins.
TEST(RolloutTest, TwoRangesAreTheWholeRun) {
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> initial, whole, halfway, end;
  BuildModel(scene, &model, &initial);
  Stepper stepper(model);
  const RolloutReport all = Rollout(model, initial, {}, &stepper, &whole);
  std::vector<long> seen;
  const StateObserver note = [&](long k, double t, const State<double>&, Stepper*) {
    EXPECT_EQ(t, StepTime(scene.simulation, k));
    seen.push_back(k);
  };
  const RolloutReport first = Rollout(model, initial, note, &stepper, &halfway, {0, 30});
  const RolloutReport second = Rollout(model, halfway, note, &stepper, &end, {30, -1});
  EXPECT_EQ(first.steps, 30);
  EXPECT_EQ(first.steps + second.steps, all.steps);
  EXPECT_EQ(second.time, all.time);
  EXPECT_EQ(seen.size(), 31u + 34u);
  EXPECT_EQ(seen[31], 30);
  EXPECT_FALSE(halfway == whole);
  for (size_t i = 0; i < whole.pose.size(); ++i) {
    EXPECT_NEAR(end.pose[i], whole.pose[i], 1e-12) << i;
    EXPECT_NEAR(end.twist[i], whole.twist[i], 1e-10) << i;
  }
}

TEST(RolloutTest, AResumedRunHasTheSameBits) {
  // Modes and impulses are part of the state: with them the second half is the same.
  const Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  Model<double> model;
  State<double> state;
  BuildModel(scene, &model, &state);
  Stepper whole(model), half(model);
  for (int k = 0; k < 60; ++k) {
    if (k == 30) half.SetGuess(whole.record());
    State<double> copy = state;
    ASSERT_EQ(whole.Step(model, 0.01 * k, 0.01, &state).status, StepStatus::kDone);
    if (k >= 30) {
      ASSERT_EQ(half.Step(model, 0.01 * k, 0.01, &copy).status, StepStatus::kDone);
      EXPECT_TRUE(copy == state) << k;
    }
  }
}

TEST(RolloutTest, ReportsAddUp) {
  RolloutReport report;
  StepReport step;
  step.rung = Rung::kPivotingFromGuess;
  step.closed = 3;
  step.gap_min = -0.2;
  step.mode_switches = 2;
  step.residual = 1e-12;
  step.solver.whole_system = 5;
  step.pairs_compared = 2000000000;
  report.Add(step);
  step.rung = Rung::kRestarts;
  step.closed = 1;
  step.gap_min = 0.1;
  report.Add(step);
  EXPECT_EQ(report.SolvedBy(Rung::kNone, Rung::kModeChanges), 0);
  EXPECT_EQ(report.SolvedBy(Rung::kModeChanges, Rung::kPivotingFromGuess), 1);
  EXPECT_EQ(report.SolvedBy(Rung::kInteriorPoint, Rung::kPivotingFromOpen), 0);
  EXPECT_EQ(report.SolvedBy(Rung::kNone, Rung::kLemke), 2);
  EXPECT_EQ(report.contacts_max, 3);
  EXPECT_EQ(report.mode_switches, 4);
  EXPECT_EQ(report.penetration_max, 0.2);
  EXPECT_EQ(report.solver.whole_system, 10);
  EXPECT_EQ(report.pairs_compared, 4000000000);
}

TEST(RandomSceneTest, IsAValidFileAndReachesWhatItIsFor) {
  int closed = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const Scene scene = RandomScene(seed);
    EXPECT_EQ(SceneToJson(scene), SceneToJson(RandomScene(seed)));
    const bool signals =
        std::any_of(scene.forces.begin(), scene.forces.end(),
                    [](const auto& f) {
                      return f.force_signal || f.torque_signal || f.force_servos[0] ||
                             f.force_servos[1] || f.torque_servo;
                    }) ||
        std::any_of(scene.joints.begin(), scene.joints.end(),
                    [](const auto& j) { return j.effort_signal || j.effort_servo; });
    if (!signals) {  // a signal, or a servo's target, is a file, which is not there
      Scene read;
      std::string error;
      EXPECT_TRUE(ParseScene(SceneToJson(scene), "random.json", ".", &read, &error)) << error;
    }
    closed += seed <= 20 ? TraceRun(scene).closed : 0;
  }
  EXPECT_GT(closed, 100);
}

}  // namespace
}  // namespace tangible
