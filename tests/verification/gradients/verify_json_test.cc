// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/gradients/verify_json.h"

#include <gtest/gtest.h>

#include "../support/sliding_box.h"

namespace tangible {
namespace {

TEST(VerifyJsonTest, EveryFigureIsThereAndFinite) {
  VerifyJob job;
  job.scene = SlidingBox("0.3");
  job.scene.path = "box.json";
  job.parameters = {PathTo(job.scene, "bodies/box/mass"), PathTo(job.scene, "gravity/x")};
  const OrderedJson json =
      OrderedJson::parse(JsonText(ToJson(RunVerification({job}, 1, KeepJacobians::kYes, {}))));
  EXPECT_EQ(json["bounds"].size(), static_cast<size_t>(kNumPairs));
  EXPECT_EQ(json["bounds"][0]["tolerance"], 1e-9);
  const OrderedJson& scene = json["scenes"][0];
  EXPECT_EQ(scene["name"], "box.json");
  EXPECT_EQ(scene["replay"], "tangible-verify box.json");
  EXPECT_EQ(scene["certificate"]["verdict"], "trustworthy");
  ASSERT_EQ(scene["rows"].size(), 2u);
  EXPECT_EQ(scene["rows"][1]["kind"], "gravity/x");
  EXPECT_TRUE(scene["rows"][1]["errors"]["adjoint"].is_number());
  EXPECT_EQ(scene["jacobians"]["methods"]["tangent"].size(), 6u);
  EXPECT_EQ(scene["jacobians"]["methods"]["Ridders"][3].size(), 2u);
  ASSERT_FALSE(json["worst"].empty());
  EXPECT_EQ(json["worst"][0]["scene_json"]["bodies"][0]["name"], "box");
  EXPECT_EQ(json["exceptions_unexplained"], 0);
}

}  // namespace
}  // namespace tangible
