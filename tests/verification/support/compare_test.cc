// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/compare.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tangible/scene/parameter.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

/// A box of friction mu, pushed along a floor at 1 m/s, for ten steps.
Scene SlidingBox(const std::string& mu) {
  Scene scene;
  std::string error;
  EXPECT_TRUE(ParseScene(R"({"bodies": [
    {"name": "box", "shape": {"box": {"size": [0.4, 0.2]}}, "mass": 2, "position": [0, 0.1],
     "velocity": [1, 0], "friction": )" +
                             mu + R"(},
    {"name": "floor", "static": true, "friction": 0.5,
     "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
    "pairs": [{"bodies": ["box", "floor"], "friction": )" +
                             mu + R"(}],
    "simulation": {"dt": 0.01, "duration": 0.1}})",
                         "scene.json", "", &scene, &error))
      << error;
  return scene;
}

ParameterPath PathTo(const Scene& scene, const std::string& text) {
  ParameterPath path;
  std::string error;
  EXPECT_TRUE(ResolveParameter(scene, text, &path, &error)) << error;
  return path;
}

TEST(CompareTest, EntriesAgreeWithinTheirBound) {
  EXPECT_TRUE(Agree(1.0 + 0.9e-6, 1.0, 1e-6, 0.0));
  EXPECT_FALSE(Agree(1.0 + 1.1e-6, 1.0, 1e-6, 0.0));
  EXPECT_FALSE(Agree(1e-10, 0.0, 1e-6, 100.0));
  EXPECT_TRUE(Agree(0.9e-11, 0.0, 1e-6, 100.0));  // 1e-13 S
  EXPECT_TRUE(Agree(1e-10, 0.0, 1e-6, 100.0, 1e-11));
  EXPECT_FALSE(Agree(NAN, 1.0, 1e-6, 1.0));
  EXPECT_FALSE(Agree(1.0, NAN, 1e-6, 1.0));
}

TEST(CompareTest, ATraceCountsTheRunsChoices) {
  const RunTrace trace = TraceRun(SlidingBox("0.3"));
  ASSERT_TRUE(trace.done) << trace.message;
  ASSERT_EQ(trace.steps.size(), 10u);
  ASSERT_EQ(trace.values.size(), 6);
  EXPECT_EQ(trace.closed, 20);  // two corners a step
  EXPECT_EQ(trace.sliding, 20);
  EXPECT_EQ(trace.sticking + trace.impacts + trace.limits + trace.recoveries, 0);
  // Euler's sum of 10 steps of 0.01 s at 1 − 0.3 · 9.81 t.
  EXPECT_NEAR(trace.values[3], 1.0 - 0.3 * 9.81 * 0.1, 1e-12);
}

TEST(CompareTest, RunsOfOtherModesAreOtherChoices) {
  const RunTrace slides = TraceRun(SlidingBox("0.3"));
  const RunTrace slower = TraceRun(SlidingBox("0.4"));
  const RunTrace stops = TraceRun(SlidingBox("2.5"));
  const RunTrace smooth = TraceRun(SlidingBox("0"));
  EXPECT_TRUE(SameChoices(slides, slower, FrictionAtZero::kDistinct));
  EXPECT_GT(stops.sticking, 0);
  EXPECT_FALSE(SameChoices(slides, stops, FrictionAtZero::kDistinct));
  EXPECT_FALSE(SameChoices(slides, smooth, FrictionAtZero::kDistinct));
  EXPECT_TRUE(SameChoices(slides, smooth, FrictionAtZero::kMaySlide));
  EXPECT_FALSE(SameChoices(stops, smooth, FrictionAtZero::kMaySlide));
}

TEST(CompareTest, DifferencesAreDerivativesOnBothKindsOfSides) {
  for (const char* mu : {"0.3", "0"}) {  // at 0 from one side only
    const Scene scene = SlidingBox(mu);
    const RunTrace trace = TraceRun(scene);
    const VectorX<double> noise = RoundingNoise(scene, trace);
    EXPECT_GT(noise.minCoeff(), 0.0);
    EXPECT_LT(noise.maxCoeff(), 1e-12);
    const DifferenceColumn column =
        FiniteDifferences(scene, trace, noise, PathTo(scene, "pairs/box:floor/friction"));
    ASSERT_EQ(column.status, DifferenceStatus::kJudged) << mu;
    // v_x = v_0 − μ g t, x the sum over steps of h v: g h² (1 + … + 10).
    EXPECT_NEAR(column.values[3], -9.81 * 0.1, column.errors[3] + 1e-12) << mu;
    EXPECT_NEAR(column.values[0], -9.81 * 1e-4 * 55.0, column.errors[0] + 1e-12) << mu;
    EXPECT_LT(column.errors[3], 1e-8) << mu;
  }
}

TEST(CompareTest, ContributionsAreNotLessThanTheDerivative) {
  const Scene scene = SlidingBox("0.3");
  const std::vector<ParameterPath> parameters = {PathTo(scene, "pairs/box:floor/friction"),
                                                 PathTo(scene, "bodies/box/velocity/x")};
  const MatrixX<double> sum = ContributionMagnitudes(scene, parameters);
  ASSERT_EQ(sum.rows(), 6);
  ASSERT_EQ(sum.cols(), 2);
  EXPECT_GE(sum(3, 0), 9.81 * 0.1);
  EXPECT_GE(sum(0, 1), 0.1);
  EXPECT_GE(sum(3, 1), 1.0);
  for (int j = 0; j < 2; ++j) {
    EXPECT_GE(sum.col(j).minCoeff(), 0.1 * sum.col(j).maxCoeff() * (1.0 - 1e-15)) << j;
  }
}

}  // namespace
}  // namespace tangible
