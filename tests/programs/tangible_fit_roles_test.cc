// SPDX-License-Identifier: Apache-2.0
//
// Recordings that tangible-fit keeps back: it fits their starts and predicts what follows.
#include <cmath>
#include <nlohmann/json.hpp>

#include "fit_fixture.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleFitRolesTest : public FitProgramTest {
 protected:
  void SetUp() override { SetUpWith("time,body,x,y\n0,ball,0,1\n"); }

  /// A recording of a throw with this speed, seen every 0.05 s, where gravity is g.
  json Throw(const std::string& name, double speed, double g = 9.5, const json& more = {}) const {
    std::string text = "time,body,x,y\n";
    for (int k = 5; k <= 40; k += 5) {
      text += json(0.01 * k).dump() + ",ball," + json(0.01 * speed * k).dump() + "," +
              json(Height(k, g)).dump() + "\n";
    }
    Write(name + ".csv", text);
    json recording = {{"name", name},
                      {"observations", {{{"file", name + ".csv"}, {"sigma", 0.01}}}}};
    if (!more.is_null()) recording.update(more);
    return recording;
  }

  static json Predict(double from) { return {{"role", "predict"}, {"state_from", from}}; }

  static json Recordings(const json& recordings) {
    json fit = Problem();
    fit.erase("observations");
    fit["parameters"][1]["per"] = "recording";
    fit["recordings"] = recordings;
    return fit;
  }

  json ResultOf(const json& fit, const std::string& flags = "") const {
    const ProgramRun run = Fit(fit, "--out='" + Path("r.json") + "' " + flags);
    EXPECT_EQ(run.exit_status, 0) << run.error;
    out_ = run.out;
    return json::parse(Read(Path("r.json")));
  }

  mutable std::string out_;
};

TEST_F(TangibleFitRolesTest, AHeldOutRecordingIdentifiesNothing) {
  const json a = Throw("a", 2.0);
  const json b = Throw("b", -1.5, 9.5, {{"role", "identify"}});
  const json alone = ResultOf(Recordings({a, b}));
  // Where it was recorded, gravity is 9: what is predicted is too low by half a metre per s² of it.
  const json c = Throw("c", 3.0, 9.0, Predict(0.1));
  const json result = ResultOf(Recordings({a, c, b}), "--predictions='" + Path("p.csv") +
                                                          "' --report='" + Path("r.html") + "'");
  ASSERT_EQ(result["parameters"].size(), 3u);
  for (size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(result["parameters"][k]["estimate"], alone["parameters"][k]["estimate"]);
    EXPECT_EQ(result["parameters"][k]["interval_95"], alone["parameters"][k]["interval_95"]);
  }
  EXPECT_EQ(result["residuals"], alone["residuals"]);
  ASSERT_EQ(result["recordings"].size(), 3u);
  EXPECT_EQ(result["recordings"][0]["role"], "identify");
  EXPECT_EQ(result["recordings"][2]["name"], "b");
  EXPECT_FALSE(alone["recordings"][0].contains("role"));
  EXPECT_FALSE(alone.contains("held_out"));
  const json& held_out = result["recordings"][1];
  EXPECT_EQ(held_out["role"], "predict");
  EXPECT_EQ(held_out["state_from"], 0.1);
  EXPECT_EQ(held_out["status"], "converged");
  ASSERT_EQ(held_out["state"].size(), 1u);
  EXPECT_EQ(held_out["state"][0]["name"], "speed");
  EXPECT_NEAR(held_out["state"][0]["estimate"].get<double>(), 3.0, 1e-8);
  EXPECT_EQ(held_out["residuals"], 4);
  // Heights alone differ, by (9.5 - 9) dt² k (k + 1) / 2.
  const auto error = [](int k) { return 0.5 * 1e-4 * 0.5 * k * (k + 1); };
  double squares = 0.0;
  for (int k = 15; k <= 40; k += 5) squares += error(k) * error(k);
  const json& all = held_out["prediction"]["all"];
  EXPECT_EQ(all["count"], 12);
  EXPECT_NEAR(all["rms_length"].get<double>(), std::sqrt(squares / 12), 1e-8);
  EXPECT_NEAR(all["max_length"].get<double>(), error(40), 1e-8);
  EXPECT_NEAR(held_out["residual_rms"].get<double>(),
              std::sqrt((error(5) * error(5) + error(10) * error(10)) / 4) / 0.01, 1e-6);
  EXPECT_EQ(result["held_out"]["all"], all);
  EXPECT_EQ(result["held_out"]["from"], 0.1);
  const std::string table = Read(Path("p.csv"));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 1 + 3 * 16);
  EXPECT_NE(table.find("c,0.1,ball,,y,c.csv,,state,"), std::string::npos) << table;
  EXPECT_NE(table.find("c,0.15,ball,,y,c.csv,,prediction,"), std::string::npos) << table;
  EXPECT_NE(Read(Path("r.html")).find("<h2>Held-out recordings</h2>"), std::string::npos);
  EXPECT_NE(out_.find("recording 'c', held out: 4 observations up to 0.1 s"), std::string::npos)
      << out_;
}

// Two that are kept back from different times on are scored by their horizons.
TEST_F(TangibleFitRolesTest, HorizonsOfSeveralBeginAtTheirOwnTimes) {
  const json result = ResultOf(Recordings(
      {Throw("a", 2.0), Throw("b", 1.0, 9.0, Predict(0.1)), Throw("c", 3.0, 9.0, Predict(0.2))}));
  EXPECT_TRUE(result["held_out"]["from"].is_null());
  EXPECT_NEAR(result["held_out"]["all"]["to"].get<double>(), 0.3, 1e-12);
  EXPECT_EQ(result["held_out"]["all"]["count"], 12 + 8);
  long count = 0;
  for (const json& horizon : result["held_out"]["horizons"]) count += horizon["count"].get<long>();
  EXPECT_EQ(count, 20);
}

// Its start is found from poses that are observed, and one that is known needs none.
TEST_F(TangibleFitRolesTest, StartsFromObservationsOrKnown) {
  json fit = Recordings({Throw("a", 2.0), Throw("c", 40.0, 9.5, Predict(0.1))});
  fit["initial"] = "from_observations";
  EXPECT_LT(ResultOf(fit)["held_out"]["all"]["rms_in_sigma"].get<double>(), 1e-6);
  fit = Recordings({Throw("a", 2.0), Throw("c", 2.0, 9.5, {{"role", "predict"}})});
  fit["parameters"].erase(1);
  const json result = ResultOf(fit);
  EXPECT_EQ(result["recordings"][1]["state"].size(), 0u);
  EXPECT_EQ(result["recordings"][1]["residuals"], 0);
  EXPECT_TRUE(result["recordings"][1]["residual_rms"].is_null());
  EXPECT_EQ(result["held_out"]["all"]["count"], 16);
  EXPECT_LT(result["held_out"]["all"]["rms_in_sigma"].get<double>(), 1e-6);
}

// What varies from recording to recording has the value around which it is spread; what else is
// a recording's own keeps its initial value.
TEST_F(TangibleFitRolesTest, WhatIsNoStartIsNotFitted) {
  json fit = Recordings({Throw("a", 2.0, 9.4), Throw("b", 2.0, 9.6), Throw("d", 2.0, 9.5),
                         Throw("c", 2.0, 9.5, Predict(0.1))});
  fit["parameters"][0]["per"] = "recording";
  fit["parameters"][0]["varies"] = {{"gaussian", {{"spread", 0.1}}}};
  const json result = ResultOf(fit);
  EXPECT_LT(result["held_out"]["all"]["rms_in_sigma"].get<double>(), 1e-6);
  fit["parameters"][0].erase("varies");
  fit["recordings"][3]["initial"] = {{"g", 9.5}};
  EXPECT_LT(ResultOf(fit)["held_out"]["all"]["rms_in_sigma"].get<double>(), 1e-6);
  fit["recordings"][3]["initial"] = {{"g", 9.0}};
  EXPECT_GT(ResultOf(fit)["held_out"]["all"]["rms_in_sigma"].get<double>(), 0.1);
}

TEST_F(TangibleFitRolesTest, BadRolesAreOneLine) {
  const json a = Throw("a", 2.0);
  const auto expect = [&](const json& other, const std::string& what) {
    ExpectOneLine(Fit(Recordings({a, other})), 1, what);
  };
  expect(Throw("b", 1, 9.5, {{"role", "judge"}}),
         "/recordings/1/role: expected one of identify, predict, got \"judge\"");
  expect(Throw("b", 1, 9.5, {{"state_from", 0.1}}),
         "/recordings/1/state_from: expected beside the role predict alone");
  expect(Throw("b", 1, 9.5, Predict(-1)), "/recordings/1/state_from: expected a number >= 0");
  expect(Throw("b", 1, 9.5, Predict(0.4)),
         "/recordings/1/state_from: expected a time with observations after it, got 0.4");
  expect(Throw("b", 1, 9.5, Predict(0.01)),
         "/recordings/1/state_from: expected a time with observations up to it");
  expect(Throw("b", 1, 9.5, {{"role", "predict"}}),
         "/recordings/1/state_from: missing, expected a time with observations up to it");
  ExpectOneLine(Fit(Recordings(json::array({Throw("b", 1, 9.5, Predict(0.1))}))), 1,
                "/recordings: expected at least one recording of the role identify, got none");
  json fit = Recordings({a, Throw("b", 1, 9.5, Predict(0.1))});
  fit["recordings"][1]["values"] = {{"bodies/ball/massive", 1}};
  ExpectOneLine(Fit(fit), 1, "/recordings/1/values/bodies~1ball~1massive: ");
}

}  // namespace
}  // namespace tangible
