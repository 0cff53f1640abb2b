// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/fit_parts.h"

#include <gtest/gtest.h>

#include <utility>

#include "../../support/fit_scenes.h"
#include "tangible/estimation/fit/fit_checkpoint.h"

namespace tangible {
namespace {

/// A falling ball whose damping and speed are found from three starts.
struct BallFit {
  FitOptions options;
  RecordingsProblem problem;

  BallFit() : problem(Residuals()) {
    options.starts = 3;
    options.seed = 5;
    options.profiles = {"bodies/ball/linear_damping"};
  }
  static RolloutResiduals Residuals() {
    const Scene scene = MakeScene(kFallingBall);
    std::vector<FitParameter> parameters = {Parameter("bodies/ball/linear_damping", 0.2),
                                            Parameter("bodies/ball/velocity/x", 2.0)};
    parameters[0].lower = 0.01;
    parameters[0].upper = 2.0;
    parameters[1].lower = -5.0;
    parameters[1].upper = 5.0;
    return MakeResiduals(scene, {}, parameters, Observe(scene, 5, 0.01, 3));
  }
  FitResult Run(FitParts* parts) {
    if (parts == nullptr) return Fit(options, &problem, {});
    FitPartLogs logs(parts);
    return Fit(options, &problem, {}, logs.Next());
  }
};

TEST(FitPartsTest, AFitThatTakesOverPartsHasTheBitsOfOneThatMakesThem) {
  BallFit fit;
  const FitResult alone = fit.Run(nullptr);
  ASSERT_EQ(alone.status, FitStatus::kConverged);
  ASSERT_EQ(alone.starts.size(), 3U);
  ASSERT_EQ(alone.profiles.size(), 1U);
  FitParts parts;
  // In any order, and not all of them.
  const auto starts = MakeStarts(fit.options, &fit.problem, {2, 0});
  ASSERT_TRUE(starts[0] && starts[1]);
  EXPECT_EQ(starts[0]->told.initial, alone.starts[2].initial);
  parts.starts = {{2, *starts[0]}, {0, *starts[1]}};
  parts.profiles = MakeProfiles(fit.options, &fit.problem, parts.starts, fit.options.profiles);
  ASSERT_EQ(parts.profiles.size(), 1U);
  const FitResult shared = fit.Run(&parts);
  EXPECT_EQ(shared.estimate, alone.estimate);
  EXPECT_EQ(shared.final_cost, alone.final_cost);
  EXPECT_EQ(shared.rollouts, alone.rollouts);
  EXPECT_EQ(shared.agreement, alone.agreement);
  EXPECT_EQ(shared.message, alone.message);
  ASSERT_EQ(shared.profiles.size(), 1U);
  ASSERT_EQ(shared.profiles[0].points.size(), alone.profiles[0].points.size());
  for (size_t i = 0; i < alone.profiles[0].points.size(); ++i) {
    EXPECT_EQ(shared.profiles[0].points[i].cost, alone.profiles[0].points[i].cost);
  }
  EXPECT_EQ(shared.intervals[0].low, alone.intervals[0].low);
}

// What is taken over is not made again: a mark in it is found in the result.
TEST(FitPartsTest, PartsAreTaken) {
  BallFit fit;
  FitParts parts;
  parts.starts[1] = *MakeStarts(fit.options, &fit.problem, {1}).front();
  parts.starts[1].told.message = "made elsewhere";
  parts.starts[1].rollouts += 1000;
  parts.profiles = MakeProfiles(fit.options, &fit.problem, {}, fit.options.profiles);
  FinishedProfile& profile = parts.profiles.begin()->second;
  profile.profile.points.resize(1);
  const FitResult alone = fit.Run(nullptr);
  const FitResult marked = fit.Run(&parts);
  EXPECT_EQ(marked.starts[1].message, "made elsewhere");
  EXPECT_EQ(marked.rollouts, alone.rollouts + 1000);
  EXPECT_EQ(marked.profiles[0].points.size(), 1U);
  // A profile around another estimate is made anew.
  profile.estimate[0] += 1e-9;
  EXPECT_EQ(fit.Run(&parts).profiles[0].points.size(), alone.profiles[0].points.size());
}

TEST(FitPartsTest, WithoutAFirstPointThereAreNone) {
  BallFit fit;
  const Scene scene = MakeScene(kFallingBall);
  // The restitution of a ball that touches nothing has no effect.
  RecordingsProblem problem(MakeResiduals(scene, {}, {Parameter("bodies/ball/restitution", 0.1)},
                                          Observe(scene, 5, 0.01, 3)));
  fit.options.profiles = {"bodies/ball/restitution"};
  const auto starts = MakeStarts(fit.options, &problem, {0, 1});
  EXPECT_FALSE(starts[0].has_value());
  EXPECT_FALSE(starts[1].has_value());
  EXPECT_TRUE(MakeProfiles(fit.options, &problem, {}, fit.options.profiles).empty());
}

}  // namespace
}  // namespace tangible
