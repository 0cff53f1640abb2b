// SPDX-License-Identifier: Apache-2.0
#include "tangible/simulation/derivatives/checkpoint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/simulation/stepping/rollout.h"

namespace tangible {
namespace {

TEST(CheckpointingTest, IsRead) {
  Checkpointing read;
  std::string error;
  ASSERT_TRUE(ParseCheckpointing("all", &read, &error));
  EXPECT_EQ(read.kind, Checkpointing::Kind::kAll);
  ASSERT_TRUE(ParseCheckpointing("every:25", &read, &error));
  EXPECT_EQ(read.kind, Checkpointing::Kind::kEvery);
  EXPECT_EQ(read.every, 25);
  ASSERT_TRUE(ParseCheckpointing("budget:0.5", &read, &error));
  EXPECT_EQ(read.kind, Checkpointing::Kind::kBudget);
  EXPECT_EQ(read.budget, 524288U);
  for (const char* wrong : {"", "al", "all:1", "every", "every:", "every:0", "every:-3",
                            "every:1.5", "every:99999999999999999999", "budget:", "budget:-1",
                            "budget:0", "budget:nan", "budget:inf", "budget:1e10", "budget:1 "}) {
    EXPECT_FALSE(ParseCheckpointing(wrong, &read, &error)) << wrong;
    EXPECT_NE(error.find("got '" + std::string(wrong) + "'"), std::string::npos) << error;
  }
}

TEST(CheckpointSpacingTest, IsOfLeastMemory) {
  for (const long steps : {1L, 7L, 100L, 10000L}) {
    for (const size_t record : {100UL, 1000UL, 30000UL}) {
      const size_t checkpoint = 1200;
      const auto memory = [&](long spacing) {
        return static_cast<double>(steps * checkpoint) / static_cast<double>(spacing) +
               static_cast<double>(record) * static_cast<double>(spacing);
      };
      const long spacing = CheckpointSpacing(steps, checkpoint, record);
      ASSERT_GE(spacing, 1);
      ASSERT_LE(spacing, steps);
      if (spacing > 1) {
        EXPECT_LE(memory(spacing), 1.01 * memory(spacing - 1)) << steps << " " << record;
      }
      if (spacing < steps) {
        EXPECT_LE(memory(spacing), 1.01 * memory(spacing + 1)) << steps << " " << record;
      }
    }
  }
  EXPECT_EQ(CheckpointSpacing(0, 100, 0), 1);
}

// A run goes on from a checkpoint with the same bits, in both ways to step.
TEST(CheckpointTest, HoldsAllThatARunGoesOnFrom) {
  for (const Stepping stepping : {Stepping::kFixed, Stepping::kEvent}) {
    Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
    scene.simulation.stepping = stepping;
    if (stepping == Stepping::kEvent) {
      scene.simulation.integrator = Integrator::kTrapezoidal;
    }
    Model<double> model;
    State<double> initial, end, final;
    BuildModel(scene, &model, &initial);
    Checkpoint checkpoint;
    Rollout(
        model, initial,
        [&](long k, double, const State<double>& state, Stepper* stepper) {
          if (k != 40) return;
          checkpoint.step = k;
          checkpoint.state = state;
          stepper->SaveGuess(&checkpoint.guess);
        },
        &end);
    ASSERT_EQ(checkpoint.step, 40);
    EXPECT_GE(checkpoint.bytes(), sizeof(double) * 2 * end.pose.size());
    Stepper other(model);
    State<double> state = checkpoint.state;
    other.SetGuess(checkpoint.guess);
    for (long k = 40; k < NumSteps(scene.simulation); ++k) {
      other.Step(model, StepTime(scene.simulation, k), StepLength(scene.simulation, k), &state);
    }
    EXPECT_EQ(state.pose, end.pose);
    EXPECT_EQ(state.twist, end.twist);
  }
}

}  // namespace
}  // namespace tangible
