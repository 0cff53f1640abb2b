// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/differences.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "sliding_box.h"

namespace tangible {
namespace {

TEST(DifferencesTest, DifferencesAreDerivativesOnBothKindsOfSides) {
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

TEST(DifferencesTest, StepsOfOneSizeAreGivenWithTheirModes) {
  const Scene scene = SlidingBox("0.3");
  const RunTrace trace = TraceRun(scene);
  const DifferenceColumn column = FiniteDifferences(scene, trace, RoundingNoise(scene, trace),
                                                    PathTo(scene, "bodies/box/velocity/x"));
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(column.plain[k].status, DifferenceStatus::kJudged);
    EXPECT_DOUBLE_EQ(column.plain[k].step, kPlainSteps[k]);
    EXPECT_NEAR(column.plain[k].values[0], 0.1, 1e-9);
  }
}

TEST(DifferencesTest, AKinkAtTheValueIsReportedWithItsContact) {
  // A box that neither slides nor is pushed sticks; with friction it slides at any speed.
  Scene scene = SlidingBox("0.3");
  scene.bodies[0].velocity.x() = 0.3 * 9.81 * 0.01;  // stops exactly at the end of its first step
  scene.simulation.duration = scene.simulation.dt;
  const RunTrace trace = TraceRun(scene);
  const DifferenceColumn column = FiniteDifferences(scene, trace, RoundingNoise(scene, trace),
                                                    PathTo(scene, "bodies/box/velocity/x"));
  EXPECT_EQ(column.status, DifferenceStatus::kChoicesDiffer);
  EXPECT_NE(column.where.find("contact of box and floor"), std::string::npos) << column.where;
  EXPECT_EQ(column.plain[0].status, DifferenceStatus::kChoicesDiffer);
  EXPECT_EQ(column.plain[0].values.size(), 6);
}

TEST(DifferencesTest, SidesWithChoicesOfTheirOwnMayAgree) {
  // Pushed up it flies and lands, pushed down it strikes: friction loses or gains as much.
  Scene scene = SlidingBox("0.3");
  scene.simulation.stepping = Stepping::kEvent;
  scene.simulation.integrator = Integrator::kRungeKutta4;
  const RunTrace trace = TraceRun(scene);
  const VectorX<double> noise = RoundingNoise(scene, trace);
  const ParameterPath up = PathTo(scene, "bodies/box/velocity/y");
  EXPECT_EQ(FiniteDifferences(scene, trace, noise, up).status, DifferenceStatus::kChoicesDiffer);
  const DifferenceColumn column =
      FiniteDifferences(scene, trace, noise, up, ChoicesDiffer::kCompareSides);
  ASSERT_EQ(column.status, DifferenceStatus::kJudged);
  EXPECT_NEAR(column.values[3], 0.3, column.errors[3] + 1e-9);
  EXPECT_LT(column.errors[3], 1e-6);
  // Higher it falls at first, deeper it is pushed out: those do not agree.
  EXPECT_EQ(FiniteDifferences(scene, trace, noise, PathTo(scene, "bodies/box/position/y"),
                              ChoicesDiffer::kCompareSides)
                .status,
            DifferenceStatus::kChoicesDiffer);
}

// A block that turns on a slope, on a step's end: runs beside it make other choices until they are
// so near that differences are rounding, and both sides have the same derivative.
TEST(DifferencesTest, ACoincidenceIsNotLeftToTheShortestSteps) {
  const Scene scene = test_scenes::SceneOf(R"({"gravity": [1.6, -8], "bodies": [
      {"name": "floor", "static": true, "shape": {"half_plane": {"normal": [0, 1]}}},
      {"name": "box", "shape": {"box": {"size": [0.2, 0.1]}}, "mass": 1, "position": [0, 0.05],
       "velocity": [-0.3, 0]}],
      "pairs": [{"bodies": ["box", "floor"], "friction": 0.1}],
      "simulation": {"stepping": "event", "dt": 0.125, "duration": 0.875}})");
  const RunTrace trace = TraceRun(scene);
  const DifferenceColumn column =
      FiniteDifferences(scene, trace, RoundingNoise(scene, trace), PathTo(scene, "gravity/y"),
                        ChoicesDiffer::kCompareSides);
  ASSERT_EQ(column.status, DifferenceStatus::kJudged);
  // v = 0.3 stops after t = v / (1.6 + 8 μ) and s = v t / 2; then it returns by
  // (1.6 − 8 μ) (T − t)² / 2.
  const double dt = -0.3 * 0.1 / (2.4 * 2.4);  // by g = 8
  const double expected = 0.5 * 0.3 * dt;
  const double back = -0.5 * 0.1 * 0.75 * 0.75 - 0.8 * 0.75 * dt;
  EXPECT_NEAR(column.values[0], -(back - expected), column.errors[0] + 1e-9);
  EXPECT_LT(column.errors[0], 1e-6);
}

TEST(DifferencesTest, ATwistThatGapsSetIsAsUncertainAsThey) {
  const Scene scene = SlidingBox("0.3");
  const RunTrace trace = TraceRun(scene);
  const VectorX<double> noise = RoundingNoise(scene, trace);
  // ε x / h, x about 0.1 m and h = 0.01 s.
  EXPECT_GE(noise[4], 2.2e-16 * 0.1 / 0.01);
  EXPECT_LT(noise[0], noise[4]);
}

}  // namespace
}  // namespace tangible
