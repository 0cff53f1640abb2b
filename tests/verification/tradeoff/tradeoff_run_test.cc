// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/tradeoff/tradeoff_run.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"

namespace tangible::tradeoff {
namespace {

using test_scenes::SceneOf;

// Its period is known; here only orders of convergence matter.
constexpr char kPendulum[] = R"({"bodies": [
    {"name": "rod", "shape": {"capsule": {"length": 1, "radius": 0.03}}, "mass": 1,
     "position": [0, -0.5], "angle": -1.5707963267948966}],
  "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0],
              "angle": 1}],
  "simulation": {"dt": 0.02, "duration": 0.4}})";

TradeoffOptions Quick() {
  TradeoffOptions options;
  options.dt_factors = {1.0, 0.5, 0.25};
  options.samples = 5;
  options.repeat_seconds = 1e-9;
  options.reference_error = 1e-9;
  return options;
}

const Cell* Find(const Tradeoff& tradeoff, Stepping stepping, Integrator integrator,
                 JointCorrection correction, double dt) {
  for (const Cell& cell : tradeoff.cells) {
    if (cell.settings.stepping == stepping && cell.settings.integrator == integrator &&
        cell.settings.joint_correction == correction && std::abs(cell.settings.dt - dt) < 1e-9) {
      return &cell;
    }
  }
  return nullptr;
}

TEST(TradeoffTest, ErrorsFallWithTheOrderOfTheIntegrator) {
  const Scene scene = SceneOf(kPendulum);
  const Tradeoff tradeoff = RunTradeoff(scene, DefaultParameters(scene), Quick(), {});
  ASSERT_EQ(tradeoff.message, "");
  EXPECT_EQ(tradeoff.reference.note, "");
  EXPECT_EQ(tradeoff.reference.settings.stepping, Stepping::kEvent);
  EXPECT_LE(tradeoff.reference.trajectory_error, 1e-9);
  EXPECT_LE(tradeoff.reference.gradient_error, 1e-9);
  EXPECT_EQ(tradeoff.cells.size(), 3u * 2u * 3u);
  const struct {
    Stepping stepping;
    Integrator integrator;
    double order;
  } cases[] = {{Stepping::kFixed, Integrator::kSemiImplicitEuler, 1.0},
               {Stepping::kEvent, Integrator::kTrapezoidal, 2.0},
               {Stepping::kEvent, Integrator::kRungeKutta4, 4.0}};
  for (const auto& expected : cases) {
    const auto cell = [&](double dt) {
      return Find(tradeoff, expected.stepping, expected.integrator, JointCorrection::kProjection,
                  dt);
    };
    ASSERT_NE(cell(0.02), nullptr);
    ASSERT_TRUE(cell(0.01)->measured()) << cell(0.01)->instead;
    EXPECT_EQ(cell(0.01)->steps, 40);
    EXPECT_GT(cell(0.01)->both_seconds, cell(0.01)->run_seconds);
    // With so few steps an order shows to within a third.
    EXPECT_NEAR(std::log2(cell(0.02)->trajectory_error / cell(0.01)->trajectory_error),
                expected.order, 0.3 * expected.order);
    EXPECT_NEAR(std::log2(cell(0.02)->gradient_error / cell(0.01)->gradient_error), expected.order,
                0.3 * expected.order);
  }
}

TEST(TradeoffTest, ThreadsDoNotChangeErrors) {
  const Scene scene = SceneOf(test_scenes::FallingBall(0.3, R"({"dt": 0.02, "duration": 0.4})"));
  TradeoffOptions options = Quick();
  long last = 0;
  const Tradeoff one =
      RunTradeoff(scene, DefaultParameters(scene), options, [&](long done, long total) {
        EXPECT_EQ(done, ++last);
        EXPECT_EQ(total, 18);
      });
  EXPECT_EQ(last, 18);
  options.threads = 3;
  const Tradeoff three = RunTradeoff(scene, DefaultParameters(scene), options, {});
  ASSERT_EQ(one.cells.size(), three.cells.size());
  for (size_t i = 0; i < one.cells.size(); ++i) {
    EXPECT_EQ(one.cells[i].trajectory_error, three.cells[i].trajectory_error);
    EXPECT_EQ(one.cells[i].gradient_error, three.cells[i].gradient_error);
  }
}

// A plate that is pressed onto a ball: no stepping has a solution.
TEST(TradeoffTest, WithoutAReferenceThereIsNone) {
  const Scene scene = SceneOf(R"({"bodies": [
      {"name": "ball", "shape": {"circle": {"radius": 0.5}}, "mass": 1, "position": [0, 0.5]},
      {"name": "plate", "kinematic": true, "shape": {"box": {"size": [1, 0.2]}},
       "position": [0, 1.2], "velocity": [0, -1]},
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "simulation": {"dt": 0.01, "duration": 0.5}})");
  const Tradeoff tradeoff = RunTradeoff(scene, DefaultParameters(scene), Quick(), {});
  EXPECT_EQ(tradeoff.message.find("no reference: step "), 0u) << tradeoff.message;
  EXPECT_TRUE(tradeoff.cells.empty());
}

TEST(TradeoffTest, WhatIsOverItsBudgetIsNotRun) {
  const Scene scene = SceneOf(kPendulum);
  TradeoffOptions options = Quick();
  options.budget_seconds = 1e-9;
  const Tradeoff tradeoff = RunTradeoff(scene, DefaultParameters(scene), options, {});
  for (size_t i = 0; i < tradeoff.cells.size(); ++i) {
    EXPECT_EQ(tradeoff.cells[i].instead, i % 3 == 0 ? "" : "over 1e-09 s");
    EXPECT_FALSE(tradeoff.cells[i].failed);
  }
}

Cell Made(double trajectory, double gradient, double run, double both) {
  Cell cell;
  cell.trajectory_error = trajectory;
  cell.gradient_error = gradient;
  cell.run_seconds = run;
  cell.both_seconds = both;
  return cell;
}

Tradeoff MadeTradeoff() {
  Tradeoff tradeoff;
  tradeoff.reference.trajectory_error = 1e-6;
  tradeoff.reference.gradient_error = 1e-5;
  tradeoff.cells = {Made(1e-1, 1e-1, 1.0, 2.0),   Made(1e-2, 2e-1, 2.0, 3.0),
                    Made(9.9e-3, 1e-2, 3.0, 4.0), Made(1e-8, 1e-3, 4.0, 6.0),
                    Made(1e-9, 1e-4, 5.0, 8.0),   Made(1e-4, 1e-3, 4.5, 5.0),
                    Made(0.0, 0.0, 0.5, 0.5)};
  tradeoff.cells[6].instead = "failed";
  MarkFronts(&tradeoff);
  return tradeoff;
}

TEST(FrontTest, HoldsWhatNoCheaperCellIsAsRightAs) {
  const Tradeoff tradeoff = MadeTradeoff();
  // The third is no tenth better than the second; the fifth below the reference, as the fourth is.
  const bool trajectory[] = {true, true, false, true, false, false, false};
  const bool gradient[] = {true, false, true, false, true, true, false};
  for (size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(tradeoff.cells[i].trajectory_front, trajectory[i]) << i;
    EXPECT_EQ(tradeoff.cells[i].gradient_front, gradient[i]) << i;
  }
  EXPECT_TRUE(tradeoff.TrajectoryBelowReference(tradeoff.cells[3]));
  EXPECT_FALSE(tradeoff.GradientBelowReference(tradeoff.cells[3]));
}

TEST(FrontTest, OfTheSameTimesAndErrorsTheFirstIsTaken) {
  Tradeoff tradeoff;
  tradeoff.reference.trajectory_error = 1e-6;
  tradeoff.reference.gradient_error = 1e-6;
  tradeoff.cells = {Made(1.05e-2, 1e-2, 1.08, 2.0), Made(1e-2, 1e-2, 1.0, 1.9),
                    Made(1e-3, 1e-3, 2.3, 2.3), Made(1e-3, 1e-3, 2.0, 2.0)};
  MarkFronts(&tradeoff);
  const bool front[] = {true, false, false, true};
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(tradeoff.cells[i].trajectory_front, front[i]) << i;
  EXPECT_EQ(Cheapest(tradeoff, Target::kTrajectory, 0.1), tradeoff.cells.data());
  EXPECT_EQ(Cheapest(tradeoff, Target::kTrajectory, 1.02e-2), &tradeoff.cells[1]);
  EXPECT_EQ(Cheapest(tradeoff, Target::kTrajectory, 5e-3), &tradeoff.cells[3]);
}

TEST(CheapestTest, MeetsTheTargetWithTheReferencesOwnErrorAdded) {
  Tradeoff tradeoff = MadeTradeoff();
  const auto cheapest = [&](Target target, double error) -> int {
    const Cell* cell = Cheapest(tradeoff, target, error);
    return cell == nullptr ? -1 : static_cast<int>(cell - tradeoff.cells.data());
  };
  EXPECT_EQ(cheapest(Target::kTrajectory, 0.5), 0);
  EXPECT_EQ(cheapest(Target::kTrajectory, 0.05), 1);
  EXPECT_EQ(cheapest(Target::kTrajectory, 1e-2), 2);  // 1e-2 + 1e-6 is more
  EXPECT_EQ(cheapest(Target::kBoth, 1.2e-2), 2);
  EXPECT_EQ(cheapest(Target::kBoth, 2e-3), 5);
  EXPECT_EQ(cheapest(Target::kGradient, 1.5e-4), 4);
  EXPECT_EQ(cheapest(Target::kGradient, 1e-4), -1);
  EXPECT_EQ(cheapest(Target::kTrajectory, 5e-7), -1);
  // Without a gradient the trajectory decides.
  tradeoff.reference.gradient_error = NAN;
  EXPECT_EQ(cheapest(Target::kGradient, 1e-2), 2);
  EXPECT_EQ(cheapest(Target::kBoth, 1e-3), 5);
}

}  // namespace
}  // namespace tangible::tradeoff
