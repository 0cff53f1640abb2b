// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/cost_report.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tangible::cost {
namespace {

CostCell Cell(CostMethod method, int parameters, double ratio) {
  CostCell cell;
  cell.method = method;
  cell.parameters = parameters;
  cell.steps = 100;
  cell.seconds = {0.001 * ratio, 0.003 * ratio};
  cell.rollout_seconds = {0.001, 0.001};
  cell.peak_bytes = 7u << 20;
  return cell;
}

std::vector<CostCell> Cells() {
  std::vector<CostCell> cells = {
      Cell(CostMethod::kRollout, 0, 1.0), Cell(CostMethod::kAdjoint, 1, 1.25),
      Cell(CostMethod::kAdjoint, 64, 1.5), Cell(CostMethod::kUnrolledJets, 1, 12.0),
      Cell(CostMethod::kUnrolledJets, 64, 170.0)};
  cells[4].instead = "over 5 s";
  return cells;
}

TEST(CostTextTest, ShowsTimesMemoryAndWhatIsOver) {
  const std::string text = TableText(Cells());
  EXPECT_NE(text.find("100 steps: one rollout 1 ms, 7 MiB"), std::string::npos) << text;
  EXPECT_NE(text.find("adjoint                   1.25 / 7     1.50 / 7\n"), std::string::npos)
      << text;
  EXPECT_NE(text.find("unrolled Jets            12.00 / 7     over 5 s\n"), std::string::npos)
      << text;
  EXPECT_EQ(text.find("170"), std::string::npos);
}

TEST(CostTextTest, ListsCrossoversAndBounds) {
  const std::string crossovers =
      CrossoverText({{100, CostMethod::kAdjoint, CostMethod::kDifferences, 1.0, true},
                     {100, CostMethod::kTape, CostMethod::kDifferences, std::nan(""), false},
                     {100, CostMethod::kAdjoint, CostMethod::kTangent, 3.14, false},
                     {1000, CostMethod::kTangent, CostMethod::kDifferences, 16.0, false}});
  EXPECT_EQ(crossovers.substr(crossovers.find('\n') + 1),
            "100 steps, than central differences: adjoint 1, unrolled ADOL-C -; than tangent: "
            "adjoint 3.1\n1000 steps, than central differences: tangent 16\n");
  const std::string bounds = BoundsText(
      {{"adjoint", 2.0, 1.5, ""}, {"tangent", 3.0, 3.5, ""}, {"Jets", 4.0, std::nan(""), "none"}});
  EXPECT_EQ(bounds,
            "adjoint: 1.5, at most 2: holds\ntangent: 3.5, at most 3: does not hold\n"
            "Jets: at most 4: not checked, none\n");
}

TEST(CostJsonTest, HasNoNumbersWhereNoneWereMeasured) {
  CostCell run = Cell(CostMethod::kAdjointWithCheckpoints, 8, 2.0);
  run.tape_bytes = 1000;
  const OrderedJson json =
      ToJson(Cells(), run, {{100, CostMethod::kAdjoint, CostMethod::kTangent, std::nan(""), false}},
             {{"Jets", 4.0, std::nan(""), "none"}});
  EXPECT_EQ(json["cells"].size(), 5U);
  EXPECT_EQ(json["cells"][1]["ratio"], 1.25);
  EXPECT_EQ(json["cells"][1]["median_ratio"], 2.5);
  EXPECT_EQ(json["cells"][4]["instead"], "over 5 s");
  EXPECT_FALSE(json["cells"][4].contains("ratio"));
  EXPECT_EQ(json["long_run"]["tape_bytes"], 1000);
  EXPECT_TRUE(json["crossovers"][0]["parameters"].is_null());
  EXPECT_TRUE(json["bounds"][0]["holds"].is_null());
}

TEST(CostPictureTest, HasTimeAndMemory) {
  const std::string svg = Picture(Cells());
  EXPECT_EQ(svg.rfind("<svg", 0), 0U);
  EXPECT_NE(svg.find("time / one rollout"), std::string::npos);
  EXPECT_NE(svg.find("memory (MiB)"), std::string::npos);
  EXPECT_NE(svg.find("unrolled Jets"), std::string::npos);
  EXPECT_NE(Picture({}).find("</svg>"), std::string::npos);
}

}  // namespace
}  // namespace tangible::cost
