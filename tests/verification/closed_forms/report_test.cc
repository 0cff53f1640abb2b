// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/closed_forms/report.h"

#include "bounds.h"

namespace tangible::closed_forms {
namespace {

std::vector<Study> TwoCases() {
  std::vector<Study> studies;
  for (const char* name : {"drop, one bounce", "double pendulum"}) {
    for (const Scheme& scheme : AllSchemes()) {
      studies.push_back(RunStudy(FormNamed(name), scheme, {50, 100, 200, 400}));
    }
  }
  return studies;
}

TEST(Report, NamesBrokenBounds) {
  std::vector<Study> studies = TwoCases();
  EXPECT_TRUE(BrokenBounds(studies).empty());
  studies[1].errors[1].over_bound = 3.0;  // drop, trapezoidal
  studies[5].derivative_order = 3.5;      // double pendulum, runge_kutta_4
  studies[0].message = "diverged";
  const std::vector<std::string> broken = BrokenBounds(studies);
  ASSERT_EQ(broken.size(), 3U);
  EXPECT_EQ(broken[0], "drop, one bounce, fixed: diverged");
  EXPECT_NE(broken[1].find("3.0e+00 of its bound in 100 steps"), std::string::npos) << broken[1];
  EXPECT_NE(broken[2].find("expected 3.8"), std::string::npos) << broken[2];
}

TEST(Report, HasATableAndAllErrors) {
  const std::vector<Study> studies = TwoCases();
  const std::string table = TableText(studies);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 4);  // two of heads, one a case
  EXPECT_NE(table.find("double pendulum"), std::string::npos);
  const OrderedJson json = ToJson(studies);
  ASSERT_EQ(json["studies"].size(), 6U);
  EXPECT_EQ(json["studies"][2]["errors"].size(), 4U);
  EXPECT_TRUE(json["studies"][1]["value_order"].is_null());
  EXPECT_EQ(json["studies"][3]["errors"][0]["derivative"], studies[3].errors[0].derivative);
  EXPECT_NE(Picture(studies).find("<svg"), std::string::npos);
}

}  // namespace
}  // namespace tangible::closed_forms
