// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/support/trace.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sliding_box.h"
#include "tangible/scene/scene_json.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

TEST(TraceTest, ATraceCountsTheRunsChoices) {
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

TEST(TraceTest, RunsOfOtherModesAreOtherChoices) {
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

TEST(TraceTest, TheFirstDifferenceNamesStepContactAndModes) {
  const RunTrace slides = TraceRun(SlidingBox("0.3"));
  const RunTrace smooth = TraceRun(SlidingBox("0"));
  const std::string text = FirstDifference(slides, smooth, FrictionAtZero::kDistinct);
  EXPECT_NE(text.find("contact of box and floor sliding_right"), std::string::npos) << text;
  EXPECT_NE(text.find("became contact of box and floor closed"), std::string::npos) << text;
  EXPECT_EQ(text.rfind("step 0: ", 0), 0u) << text;
  EXPECT_EQ(FirstDifference(slides, slides, FrictionAtZero::kDistinct), "");
}

TEST(TraceTest, ADrivenContactIsAnotherChoiceThanAClosedOne) {
  // A disc touches both walls of a groove at once; with little restitution the right one stays
  // closed.
  const auto trace = [](const char* right) {
    Scene scene;
    std::string error;
    EXPECT_TRUE(ParseScene(R"({"bodies": [
      {"name": "disc", "shape": {"circle": {"radius": 0.1}}, "mass": 1.3, "position": [0, 0.4]},
      {"name": "left", "static": true,
       "shape": {"half_plane": {"normal": [0.86602540378443865, 0.5], "offset": 0}}},
      {"name": "right", "static": true,
       "shape": {"half_plane": {"normal": [-0.86602540378443865, 0.5], "offset": 0}}}],
    "pairs": [{"bodies": ["disc", "left"], "restitution": 0.9},
              {"bodies": ["disc", "right"], "restitution": )" +
                               std::string(right) + R"(}],
    "simulation": {"stepping": "event", "impact_law": "poisson", "duration": 0.23}})",
                           "groove.json", ".", &scene, &error))
        << error;
    return TraceRun(scene);
  };
  const RunTrace closed = trace("0.1");
  const RunTrace both = trace("0.8");
  EXPECT_EQ(closed.impacts, 1);
  EXPECT_EQ(both.impacts, 2);
  EXPECT_TRUE(SameChoices(both, trace("0.75"), FrictionAtZero::kDistinct));
  const std::string text = FirstDifference(closed, both, FrictionAtZero::kDistinct);
  EXPECT_NE(text.find("became contact of disc and right closed (law poisson"), std::string::npos)
      << text;
  EXPECT_NE(text.rfind(" driven"), std::string::npos) << text;
}

// A box that is thrown up from a slope lands flat, on either corner first: both gaps are rounding.
TEST(TraceTest, WhichCornerLandsFirstIsNoChoice) {
  RunTrace first;
  for (int k = 0; k < 12; ++k) {
    Scene scene;
    std::string error;
    ASSERT_TRUE(ParseScene(R"({"gravity": [2.3043894471827056, -8.17541633047606], "bodies": [
      {"name": "floor", "static": true, "position": [-0.06858104132250484, -0.2404093192268571],
       "angle": -0.2778868359961467,
       "shape": {"polygon": {"vertices": [[-9, -0.3], [9, -0.3], [10, 0.25], [-10, 0.25]]}}},
      {"name": "box", "shape": {"box": {"size": [0.18333882691507689, 0.25096885979039935]}},
       "mass": 3, "position": [0.0344234114878946, 0.12067050545870091],
       "angle": -0.2778868359961467}],
      "simulation": {"dt": 0.002, "duration": 0.002, "stepping": "event",
                     "integrator": "trapezoidal"}})",
                           "slope.json", "", &scene, &error))
        << error;
    scene.bodies[1].velocity.y() = std::ldexp(1e-3, -k);
    const RunTrace trace = TraceRun(scene);
    if (k == 0) {
      first = trace;
    }
    EXPECT_EQ(FirstDifference(first, trace, FrictionAtZero::kDistinct), "") << k;
  }
}

// Without gravity bodies coast along a slope: what is left of forces is rounding, whose changes of
// sign once ended segments without end.
TEST(TraceTest, ForcesThatAreRoundingAreNoEvents) {
  RandomSceneOptions options;
  options.stepping = Stepping::kEvent;
  Scene scene = RandomScene(8, options);
  ASSERT_TRUE(scene.gravity.isZero());
  scene.bodies[0].position.y() -= 1e-9;
  const RunTrace trace = TraceRun(scene);
  EXPECT_TRUE(trace.done) << trace.message;
  EXPECT_GT(trace.closed, 10);
}

}  // namespace
}  // namespace tangible
