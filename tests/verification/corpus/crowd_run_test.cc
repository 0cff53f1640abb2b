// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/crowd_run.h"

#include <gtest/gtest.h>

#include "tangible/scene/scene_json.h"
#include "tangible/scene/validate.h"
#include "tangible/verification/corpus/crowd_scene.h"

namespace tangible::corpus {
namespace {

TEST(CrowdSceneTest, ScenesAreValidDifferentAndRepeat) {
  for (size_t kind = 0; kind < CrowdKinds().size(); ++kind) {
    const int k = static_cast<int>(kind);
    const Scene scene = CrowdScene(1, 0, k, 60, 10);
    EXPECT_EQ(Validate(scene, CrowdKinds()[kind]), "");
    EXPECT_GE(scene.bodies.size(), 23u);
    const std::string text = SceneToJson(scene);
    EXPECT_EQ(text, SceneToJson(CrowdScene(1, 0, k, 60, 10)));
    EXPECT_NE(text, SceneToJson(CrowdScene(1, 1, k, 60, 10)));
    EXPECT_NE(text, SceneToJson(CrowdScene(2, 0, k, 60, 10)));
  }
}

TEST(RunCrowdsTest, SmallOnesAreSolvedWhateverTheThreads) {
  const CrowdOptions one{.scenes = 2, .steps = 60, .most_bodies = 24, .threads = 1};
  CrowdOptions two = one;
  two.threads = 2;
  const std::vector<CrowdRow> rows = RunCrowds(one);
  const std::vector<CrowdRow> again = RunCrowds(two);
  ASSERT_EQ(rows.size(), CrowdKinds().size());
  for (size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].scenes, 2);
    EXPECT_EQ(rows[i].steps, 120);
    EXPECT_GT(rows[i].contacts_max, 5);
    EXPECT_EQ(rows[i].residual_max, again[i].residual_max);
  }
  EXPECT_EQ(FirstFailure(rows), "");
}

TEST(RunCrowdsTest, FailuresAreNamed) {
  std::vector<CrowdRow> rows(2);
  rows[0] = {.kind = "fall", .residual_max = 2e-10};
  EXPECT_NE(FirstFailure(rows).find("fall: expected residuals"), std::string::npos);
  rows[0].residual_max = 1e-10;
  EXPECT_EQ(FirstFailure(rows), "");
  rows[1].unsolved = {"stir 3: step 5"};
  EXPECT_EQ(FirstFailure(rows), "stir 3: step 5");
}

}  // namespace
}  // namespace tangible::corpus
