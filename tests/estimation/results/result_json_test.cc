// SPDX-License-Identifier: Apache-2.0
//
// Tests of ResultToJson (fit_json.h).
#include <gtest/gtest.h>

#include "../../support/fit_results.h"
#include "tangible/estimation/results/fit_json.h"

namespace tangible {
namespace {

TEST(ResultJsonTest, NumbersAreThoseOfTheResult) {
  const RecordingsProblem residuals = HandMadeProblem();
  const OrderedJson json = OrderedJson::parse(JsonText(ResultToJson(residuals, HandMadeResult())));
  EXPECT_EQ(json["status"], "converged");
  ASSERT_EQ(json["parameters"].size(), 2u);
  EXPECT_EQ(json["parameters"][0]["name"], "gravity/y");
  EXPECT_EQ(json["parameters"][0]["estimate"], -9.8125);
  EXPECT_EQ(json["parameters"][0]["standard_deviation"], 0.25);
  EXPECT_EQ(json["parameters"][0]["confidence_95"], OrderedJson::array({-10.3125, -9.3125}));
  EXPECT_EQ(json["parameters"][0]["standard_deviation_robust"], 0.5);
  EXPECT_EQ(json["parameters"][0]["confidence_95_robust"], OrderedJson::array({-11.0, -8.625}));
  EXPECT_EQ(json["parameters"][0]["degrees_of_freedom"], 6.5);
  EXPECT_TRUE(json["parameters"][1]["confidence_95_robust"].is_null());
  EXPECT_EQ(json["robust"]["method"], "time");
  EXPECT_EQ(json["robust"]["bandwidth"], 0.25);
  EXPECT_FALSE(json["parameters"][0].contains("message"));
  // To the last bit through the text.
  EXPECT_EQ(json["parameters"][1]["estimate"], 1.0 / 3.0);
  EXPECT_EQ(json["covariance"][0][0], 0.0625);
  EXPECT_EQ(json["initial_cost"], 40.0);
  EXPECT_EQ(json["final_cost"], 3.0);
  EXPECT_EQ(json["residuals"], 3);
  EXPECT_EQ(json["rollouts"], 7);
  ASSERT_EQ(json["iterations"].size(), 2u);
  EXPECT_EQ(json["iterations"][0]["cost"], 40.0);
  EXPECT_EQ(json["iterations"][1]["parameters"], OrderedJson::array({-9.8125, 1.0 / 3.0}));
  EXPECT_EQ(json["starts"][0]["status"], "converged");
  EXPECT_EQ(json["warnings"], OrderedJson::array({"a < b"}));
  EXPECT_EQ(json["message"], "done & <well>");
  EXPECT_FALSE(json.contains("discretisation"));
}

TEST(ResultJsonTest, RootMeanSquaresAreInUnits) {
  const OrderedJson json = ResultToJson(HandMadeProblem(), HandMadeResult());
  const OrderedJson& rms = json["residual_rms_by_coordinate"];
  ASSERT_EQ(rms.size(), 2u);
  // Residuals 3 and 4 with a sigma of 0.1 m, −2 with 0.2 m.
  EXPECT_NEAR(rms["x"].get<double>(), 0.1 * std::sqrt(0.5 * (9.0 + 16.0)), 1e-15);
  EXPECT_NEAR(rms["y"].get<double>(), 0.4, 1e-15);
}

TEST(ResultJsonTest, CombinationsHaveTheirTerms) {
  FitResult result = HandMadeResult();
  result.uncertainty.combinations = {
      {{0, 1}, {1.0, 2.0}, {1.0, -3.0}, "", "'g' - 3 'd'", 4.0, 0.5, 0.75}};
  const OrderedJson json = ResultToJson(HandMadeProblem(), result);
  ASSERT_EQ(json["determined_combinations"].size(), 1u);
  const OrderedJson& combination = json["determined_combinations"][0];
  EXPECT_EQ(combination["sum"], "'g' - 3 'd'");
  EXPECT_TRUE(combination["product"].is_null());
  EXPECT_EQ(combination["terms"][1]["name"], "bodies/ball/linear_damping");
  EXPECT_EQ(combination["terms"][1]["coefficient"], -3.0);
  EXPECT_EQ(combination["terms"][1]["exponent"], 2.0);
  EXPECT_EQ(combination["value"], 4.0);
  EXPECT_EQ(combination["standard_deviation"], 0.5);
  EXPECT_EQ(combination["standard_deviation_robust"], 0.75);
}

TEST(ResultJsonTest, WhatIsNotKnownIsNull) {
  const RecordingsProblem residuals = HandMadeProblem();
  OrderedJson json = ResultToJson(residuals, HandMadeResult());
  EXPECT_TRUE(json["parameters"][1]["standard_deviation"].is_null());
  EXPECT_TRUE(json["parameters"][1]["confidence_95"].is_null());
  EXPECT_EQ(json["parameters"][1]["message"], "at its lower bound");
  EXPECT_TRUE(json["covariance"][1][1].is_null());
  EXPECT_TRUE(json["reduced_chi_square"].is_null());
  json = ResultToJson(residuals, FitResult());
  EXPECT_EQ(json["status"], "failed");
  EXPECT_TRUE(json["parameters"].empty());
  for (const char* key : {"initial_cost", "final_cost", "residual_rms", "condition"}) {
    EXPECT_TRUE(json[key].is_null()) << key;
  }
}

TEST(ResultJsonTest, TheCheckOfTheStepIsListed) {
  const DiscretisationCheck check = HandMadeCheck();
  const OrderedJson json = ResultToJson(HandMadeProblem(), HandMadeResult(), {.check = &check});
  const OrderedJson& part = json["discretisation"];
  EXPECT_EQ(part["dt"], 0.01);
  EXPECT_EQ(part["status"], "converged");
  ASSERT_EQ(part["parameters"].size(), 2u);
  EXPECT_EQ(part["parameters"][1]["name"], "bodies/ball/linear_damping");
  EXPECT_EQ(part["parameters"][1]["estimate_half_step"], 0.5);
  EXPECT_EQ(part["parameters"][1]["difference"], 0.125);
  EXPECT_EQ(part["parameters"][1]["bias"], 0.25);
  EXPECT_EQ(part["parameters"][1]["extrapolated"], 0.0625);
}

}  // namespace
}  // namespace tangible
