// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/motion_cost.h"

#include <gtest/gtest.h>

#include "tangible/verification/cost/benchmark_scenes.h"

namespace tangible::cost {
namespace {

TEST(TimesOfTest, MeanAndNearestRank) {
  EXPECT_EQ(TimesOf({}).mean, 0.0);
  EXPECT_EQ(TimesOf({3.0}).high, 3.0);
  std::vector<double> times;
  for (int i = 200; i >= 1; --i) times.push_back(i);
  EXPECT_DOUBLE_EQ(TimesOf(times).mean, 100.5);
  EXPECT_EQ(TimesOf(times).high, 198.0);  // two of two hundred are longer
}

TEST(MotionCostTest, RowsOfSmallScenes) {
  MotionOptions options;
  options.discs = {3};
  options.bouncing = {2};
  options.pyramids = {2};
  options.moving_steps = 100;
  options.settling_steps = 150;
  long done = 0;
  const std::vector<MotionRow> rows =
      MeasureAllMotion(options, [&](long rows_done) { done = rows_done; });
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(done, NumMotionRows(options));
  for (const MotionRow& row : rows) {
    EXPECT_EQ(row.message, "");
    EXPECT_GT(row.moving.mean, 0.0);
    EXPECT_GT(row.settled.high, 0.0);
    EXPECT_LE(row.residual_max, 1e-10);
    EXPECT_NE(MotionText(rows).find(row.scene), std::string::npos);
  }
  EXPECT_EQ(rows[0].bodies, 3);
  EXPECT_EQ(rows[0].events, 0);
  EXPECT_EQ(rows[1].scene, "pyramid of 3 boxes");
  EXPECT_GT(rows[2].events, 0);
  const OrderedJson json = ToJson(rows);
  EXPECT_EQ(json[2]["events"], rows[2].events);
  EXPECT_FALSE(json[0].contains("event_us"));
}

// A step that is not solved ends the row with its message: a disc is pinned to the ground and to a
// body that moves.
TEST(MotionCostTest, AnUnsolvedStepIsNamed) {
  Scene scene = DiscsScene(1);
  const int disc = static_cast<int>(scene.bodies.size()) - 1;
  BasicBody<double> driver;
  driver.name = "driver";
  driver.motion = Motion::kKinematic;
  driver.position = scene.bodies[disc].position;
  driver.velocity = {1.0, 0.0};
  scene.bodies.push_back(driver);
  for (const int other : {-1, disc + 1}) {
    BasicJoint<double> pin;
    pin.name = "pin" + std::to_string(other);
    pin.bodies[0] = disc;
    pin.bodies[1] = other;
    pin.anchors[0] = driver.position;
    scene.joints.push_back(pin);
  }
  const MotionRow row = MeasureMotion("disc", scene, {});
  EXPECT_NE(row.message.find("step 0"), std::string::npos) << row.message;
  EXPECT_NE(MotionText({row}).find(row.message), std::string::npos);
}

}  // namespace
}  // namespace tangible::cost
