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

// A step that is not solved ends the row with its message: one of a thousand bounces, where two are
// allowed.
TEST(MotionCostTest, AnUnsolvedStepIsNamed) {
  Scene scene = DiscsScene(1);
  scene.simulation.stepping = Stepping::kEvent;
  scene.simulation.max_events_per_step = 1;
  for (BasicBody<double>& body : scene.bodies) body.restitution = 1.0;
  scene.simulation.dt = 1e3;
  const MotionRow row = MeasureMotion("ball", scene, {});
  EXPECT_NE(row.message.find("unsolved"), std::string::npos) << row.message;
  EXPECT_NE(MotionText({row}).find(row.message), std::string::npos);
}

}  // namespace
}  // namespace tangible::cost
