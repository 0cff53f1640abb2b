// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/coverage.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "../support/sliding_box.h"
#include "tangible/verification/support/random_scene.h"

namespace tangible {
namespace {

TEST(CoverageTest, ASceneCountsWhatItHas) {
  const Scene scene = SlidingBox("0.3");
  const Coverage coverage = CoverageOf(scene, TraceRun(scene));
  for (const char* what :
       {"contact box, half_plane", "friction sliding", "bodies 1", "steps 3 to 40",
        "mixing of friction average", "joint correction none", "coefficients of a pair"}) {
    EXPECT_EQ(coverage.count(what), 1u) << what;
  }
  EXPECT_EQ(coverage.count("friction sticking"), 0u);
  Coverage sum;
  Add(coverage, &sum);
  Add(coverage, &sum);
  EXPECT_EQ(sum["friction sliding"], 2);
  const std::vector<std::string> missing = MissingCoverage(sum);
  EXPECT_NE(std::find(missing.begin(), missing.end(), "joint weld"), missing.end());
  EXPECT_EQ(std::find(missing.begin(), missing.end(), "friction sliding"), missing.end());
}

// The edge of a force's window is an event of no contact: what it covers is no pair of shapes.
TEST(CoverageTest, EventsAreNoContacts) {
  const std::vector<std::string> expected = ExpectedCoverage();
  RandomSceneOptions options;
  options.stepping = Stepping::kEvent;
  options.max_bodies = 3;
  Coverage sum;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Scene scene = RandomScene(seed, options);
    Add(CoverageOf(scene, TraceRun(scene)), &sum);
  }
  EXPECT_GT(sum["event: edge of a force's window"], 0);
  EXPECT_GT(sum["event: touch"], 0);
  EXPECT_EQ(sum["stepping event"], 20);
  for (const auto& [what, count] : sum) {
    if (what.rfind("contact ", 0) == 0) {
      EXPECT_NE(std::find(expected.begin(), expected.end(), what), expected.end()) << what;
    }
  }
}

TEST(CoverageTest, RandomScenesHaveEverything) {
  Coverage sum;
  for (unsigned seed = 1; seed <= 150; ++seed) {
    const Scene scene = RandomScene(seed);
    Add(CoverageOf(scene, TraceRun(scene)), &sum);
  }
  RandomSceneOptions by_events;
  by_events.stepping = Stepping::kEvent;
  by_events.max_bodies = 3;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Scene scene = RandomScene(seed, by_events);
    Add(CoverageOf(scene, TraceRun(scene)), &sum);
  }
  // Friction that decays with the speed, which fixed steps do not have.
  RandomSceneOptions of_mechanism;
  of_mechanism.stepping = Stepping::kEvent;
  const Scene mechanism = RandomScene(32, of_mechanism);
  Add(CoverageOf(mechanism, TraceRun(mechanism)), &sum);
  for (const std::string& what : MissingCoverage(sum)) ADD_FAILURE() << what;
  // Of two of six shapes, in either order, but for two half-planes; and of five with a spline.
  const std::vector<std::string> expected = ExpectedCoverage();
  EXPECT_EQ(std::count_if(expected.begin(), expected.end(),
                          [](const std::string& what) { return what.rfind("contact ", 0) == 0; }),
            25);
}

}  // namespace
}  // namespace tangible
