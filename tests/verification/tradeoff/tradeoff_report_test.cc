// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/tradeoff/tradeoff_report.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../../support/scenes.h"
#include "tangible/scene/scene_json.h"

namespace tangible::tradeoff {
namespace {

Tradeoff Example() {
  Tradeoff tradeoff;
  tradeoff.scene = "a <b>";
  tradeoff.parameters = {"gravity/y"};
  tradeoff.reference.trajectory_error = 1e-9;
  tradeoff.reference.gradient_error = 2e-9;
  tradeoff.reference.note = "did not come within its bound";
  tradeoff.left_out = {"fixed stepping with trapezoidal: why"};
  Cell cell;
  cell.settings.dt = 0.02;
  cell.trajectory_error = 0.01;
  cell.gradient_error = 0.03;
  cell.run_seconds = 1e-3;
  cell.both_seconds = 2e-3;
  tradeoff.cells.push_back(cell);
  cell.settings.stepping = Stepping::kEvent;
  cell.settings.integrator = Integrator::kRungeKutta4;
  cell.trajectory_error = 5e-10;
  cell.gradient_error = 1e-6;
  cell.run_seconds = 3e-3;
  cell.both_seconds = 8e-3;
  tradeoff.cells.push_back(cell);
  cell.settings.lcp_tolerance = 1e-6;
  cell.instead = "step 3: unsolved";
  cell.failed = true;
  tradeoff.cells.push_back(cell);
  cell.failed = false;
  cell.instead = "over 2 s";
  tradeoff.cells.push_back(cell);
  MarkFronts(&tradeoff);
  return tradeoff;
}

TEST(TradeoffTableTest, ShowsTheFrontsAndWhatIsMissing) {
  const std::string text = TableText(Example());
  for (const char* expected :
       {"2 cells measured, 1 over their budget, 1 failed", "its own errors: trajectory 1.0e-09",
        "reference: did not come within its bound",
        "failed 1: event runge_kutta_4, projection, tolerance 1e-06",
        "left out: fixed stepping with trapezoidal: why", "TG fixed semi_implicit_euler, none ",
        "0.02   1.0e-02   3.0e-02          1    1.00",
        "0.02  5.0e-10*   1.0e-06          3    3.00          8    4.00"}) {
    EXPECT_NE(text.find(expected), std::string::npos) << expected << "\n" << text;
  }
}

TEST(TradeoffJsonTest, HasAllCells) {
  Tradeoff tradeoff = Example();
  tradeoff.cells[0].gradient_error = NAN;
  const OrderedJson json = ToJson(tradeoff);
  ASSERT_EQ(json["cells"].size(), 4u);
  EXPECT_EQ(json["cells"][1]["trajectory_error"], 5e-10);
  EXPECT_EQ(json["cells"][1]["trajectory_below_reference"], true);
  EXPECT_EQ(json["cells"][1]["gradient_below_reference"], false);
  EXPECT_EQ(json["cells"][1]["gradient_ratio"], 4.0);
  EXPECT_TRUE(json["cells"][0]["gradient_error"].is_null());
  EXPECT_EQ(json["cells"][2]["instead"], "step 3: unsolved");
  EXPECT_FALSE(json["cells"][2].contains("rollout_seconds"));
  EXPECT_EQ(json["reference"]["gradient_error"], 2e-9);
}

TEST(TradeoffPictureTest, OfOneSceneAndOfSeveral) {
  const std::string one = Picture({Example()});
  EXPECT_EQ(one.rfind("<svg", 0), 0u);
  EXPECT_NE(one.find("event runge_kutta_4"), std::string::npos);
  EXPECT_EQ(one.find("<b>"), std::string::npos);
  Tradeoff other = Example();
  other.scene = "other";
  const std::string two = Picture({Example(), other});
  EXPECT_NE(two.find("other"), std::string::npos);
  EXPECT_EQ(two.find("event runge_kutta_4"), std::string::npos);
  const std::string page = Page({Example(), other}, "commit <x>");
  EXPECT_EQ(page.find("<x>"), std::string::npos);
  EXPECT_NE(page.find("step 3: unsolved"), std::string::npos);
}

TEST(SimulationBlockTest, ReadsBackAsTheSettings) {
  Scene scene = test_scenes::SceneOf(test_scenes::Mixture());
  SimulationSettings settings = scene.simulation;
  settings.dt = 1.0 / 3.0;
  settings.stepping = Stepping::kEvent;
  settings.integrator = Integrator::kTrapezoidal;
  settings.lcp_tolerance = 1e-6;
  const std::string block = SimulationBlock(scene, settings);
  EXPECT_EQ(block.rfind("\"simulation\": {", 0), 0u);
  OrderedJson whole = OrderedJson::parse(SceneToJson(scene));
  whole["simulation"] = OrderedJson::parse("{" + block + "}")["simulation"];
  const SimulationSettings read = test_scenes::SceneOf(whole.dump()).simulation;
  EXPECT_EQ(read.dt, settings.dt);
  EXPECT_EQ(read.stepping, settings.stepping);
  EXPECT_EQ(read.integrator, settings.integrator);
  EXPECT_EQ(read.joint_correction, settings.joint_correction);
  EXPECT_EQ(read.lcp_tolerance, settings.lcp_tolerance);
}

TEST(WhyNoneTest, NamesTheLeastErrors) {
  Tradeoff tradeoff = Example();
  EXPECT_EQ(WhyNone(tradeoff, 1e-12),
            "expected settings with errors <= 1e-12, got none: the least of trajectories is 5e-10, "
            "of gradients 1e-06, to which the reference's own are added, 1e-09 and 2e-09");
  tradeoff.reference.gradient_error = NAN;
  EXPECT_EQ(WhyNone(tradeoff, 1e-12),
            "expected settings with errors <= 1e-12, got none: the least of trajectories is 5e-10, "
            "to which the reference's own are added, 1e-09");
}

}  // namespace
}  // namespace tangible::tradeoff
