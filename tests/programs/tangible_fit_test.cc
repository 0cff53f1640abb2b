// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "fit_fixture.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleFitTest : public FitProgramTest {
 protected:
  void SetUp() override { SetUpWith(Observations()); }

  static std::string Observations() {
    std::string text = "time,body,x,y\n";
    for (int k = 0; k <= 50; k += 10) {
      text += std::to_string(0.01 * k) + ",ball," + (k == 20 ? "" : std::to_string(0.02 * k)) +
              "," + json(Height(k)).dump() + "\n";
    }
    return text;
  }
};

// One ball thrown three times: gravity is shared, and each throw has its own speed; the last one is
// recorded from 0.1 s on and has a body of another mass, which changes nothing.
TEST_F(TangibleFitTest, FitsSeveralRecordingsAtOnce) {
  json fit = Problem();
  fit.erase("observations");
  fit["parameters"][1]["per"] = "recording";
  const double speeds[] = {2.0, 3.5, -1.0};
  for (int take = 0; take < 3; ++take) {
    const int first = take == 2 ? 10 : 0;
    std::string text = "time,body,x,y\n";
    for (int k = 0; k <= 40; k += 10) {
      text += std::to_string(0.01 * (k + first)) + ",ball," + json(0.01 * speeds[take] * k).dump() +
              "," + json(Height(k)).dump() + "\n";
    }
    const std::string file = "take" + std::to_string(take) + ".csv";
    Write(file, text);
    json recording = {{"name", "take " + std::to_string(take)},
                      {"observations", {{{"file", file}, {"sigma", 0.01}}}}};
    if (take == 2) {
      recording.update({{"start", 0.1},
                        {"values", {{"bodies/ball/mass", 7}}},
                        {"weight", 2},
                        {"initial", {{"speed", -0.5}}}});
    }
    fit["recordings"].push_back(recording);
  }
  const ProgramRun run =
      Fit(fit, "--out='" + Path("r.json") + "' --report='" + Path("r.html") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["status"], "converged");
  ASSERT_EQ(result["parameters"].size(), 4u);
  EXPECT_NEAR(result["parameters"][0]["estimate"].get<double>(), 9.5, 1e-8);
  for (int take = 0; take < 3; ++take) {
    const json& speed = result["parameters"][1 + take];
    EXPECT_NEAR(speed["estimate"].get<double>(), speeds[take], 1e-8);
    EXPECT_EQ(speed["recording"], "take " + std::to_string(take));
    EXPECT_EQ(result["recordings"][take]["residuals"], 10);
    EXPECT_LT(result["recordings"][take]["residual_rms"].get<double>(), 1e-6);
  }
  EXPECT_NE(Read(Path("r.html")).find("speed of take 1"), std::string::npos);
  // Up to 0.25 s of each recording's time; the rest is predicted, exactly as there is no noise.
  ASSERT_EQ(Fit(fit, "--out='" + Path("r.json") + "' --report='" + Path("r.html") +
                         "' --predictions='" + Path("p.csv") + "' --scene_out='" + Path("s.json") +
                         "' --predict_from=0.25 --initial=g=9")
                .exit_status,
            0);
  const json part = json::parse(Read(Path("r.json")));
  EXPECT_EQ(part["starts"][0]["initial"][0], 9.0);
  EXPECT_EQ(part["residuals"], 18);
  EXPECT_EQ(part["prediction"]["all"]["count"], 12);
  EXPECT_LT(part["prediction"]["all"]["rms_in_sigma"].get<double>(), 1e-6);
  EXPECT_LT(part["recordings"][1]["prediction_rms"].get<double>(), 1e-6);
  EXPECT_NE(Read(Path("r.html")).find("<h2>Prediction</h2>"), std::string::npos);
  const std::string table = Read(Path("p.csv"));
  EXPECT_EQ(table.find("recording,time,target,"), 0u);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 31);
  EXPECT_NE(table.find("take 2,0.3"), std::string::npos);
  for (int take = 0; take < 3; ++take) {
    const json scene = json::parse(Read(Path("s_" + std::to_string(take) + ".json")));
    EXPECT_NEAR(scene["bodies"][0]["velocity"][0].get<double>(), speeds[take], 1e-8);
    EXPECT_NEAR(scene["gravity"][1].get<double>(), -9.5, 1e-8);
  }
  EXPECT_EQ(json::parse(Read(Path("s_2.json")))["bodies"][0]["mass"], 7);
  ExpectOneLine(Fit(fit, "--predict_from=-1"), 2,
                "--predict_from: expected a time with observations up to it in each recording");
  ExpectOneLine(Fit(fit, "--predict_from=9"), 2,
                "--predict_from: expected a time with observations after it, got 9");
  ExpectOneLine(Fit(fit, "--initial=speeed=3"), 2, "expected the name of a parameter");
  // Speeds from the first observations, which are exact: only gravity is left to be found.
  fit["recordings"][2].erase("initial");
  fit["initial"] = "from_observations";
  ASSERT_EQ(Fit(fit, "--out='" + Path("r.json") + "'").exit_status, 0);
  const json initial = json::parse(Read(Path("r.json")))["starts"][0]["initial"];
  EXPECT_EQ(initial[0], 8.0);
  for (int take = 0; take < 3; ++take) {
    EXPECT_NEAR(initial[1 + take].get<double>(), speeds[take], 1e-9);
  }
  fit["initial"] = "from_nothing";
  ExpectOneLine(Fit(fit), 1, "/initial: expected one of from_observations");
}

TEST_F(TangibleFitTest, MistakesInRecordingsNameThem) {
  json fit = Problem();
  fit.erase("observations");
  fit["parameters"][1]["per"] = "recording";
  const json good = {{"name", "a"}, {"observations", {{{"file", "o.csv"}, {"sigma", 0.01}}}}};
  const auto expect = [&](json changes, const std::string& what) {
    json second = good;
    second["name"] = "b";
    second.merge_patch(changes);
    fit["recordings"] = {good, second};
    ExpectOneLine(Fit(fit), 1, what);
  };
  expect({{"name", "a"}}, "/recordings/1/name: expected a name that no other recording has");
  json second = good;
  second["name"] = "b";
  fit["recordings"] = {good, second};
  ExpectOneLine(
      Fit(fit, "--scene_out='" + Path("s.json") + "' --predictions='" + Path("s_1.json") + "'"), 2,
      "--scene_out: expected files of their own");
  std::filesystem::create_directory(Path("d_1.json"));
  ExpectOneLine(Fit(fit, "--scene_out='" + Path("d.json") + "'"), 2, "_1.json, a directory");
  EXPECT_FALSE(std::filesystem::exists(Path("d_0.json")));
  expect({{"start", 3}}, "recording 'b': /observations: expected some from start to end, got none");
  expect({{"start", 0.3}, {"end", 0.2}}, "/recordings/1/end: expected a time after start");
  expect({{"weight", 0}}, "/recordings/1/weight: expected a number > 0");
  expect({{"values", {{"bodies/ball/mass", -1}}}},
         "/recordings/1/values/bodies~1ball~1mass: expected a number > 0, got -1.0");
  expect({{"values", 5}}, "/recordings/1/values: expected an object");
  expect({{"initial", {{"sped", 1}}}}, "/recordings/1/initial/sped: expected the name");
  // A shared parameter starts where the file says.
  expect({{"initial", {{"g", 1}}}},
         "/recordings/1/initial/g: expected the name of a parameter per recording");
  expect({{"observations", {{{"file", "o.csv"}, {"sigma", 0}}}}},
         "recording 'b': /observations/0/sigma: expected a number > 0");
  expect({{"observation", 1}}, "/recordings/1/observation: unknown key of a recording");
  fit["parameters"][0]["name"] = 3;
  expect({{"initial", {{"speed", 1}}}}, "fit.json: /parameters/0/name: expected a string");
  fit["parameters"][0]["name"] = "g";
  fit["recordings"] = {good};
  fit["observations"] = good["observations"];
  ExpectOneLine(Fit(fit), 1, "/observations: expected in each recording");
}

// One recording without own parameters is the same fit as the run alone, with everything that can
// be asked for, to the last digit.
TEST_F(TangibleFitTest, ARunIsTheCaseOfOneRecording) {
  const json alone = Problem({{"segments", 2}, {"starts", 2}});
  json recorded = alone;
  recorded["recordings"] = {{{"name", "a"}, {"observations", alone["observations"]}}};
  recorded.erase("observations");
  json results[2];
  std::string reports[2];
  for (int i = 0; i < 2; ++i) {
    const ProgramRun run =
        Fit(i == 0 ? alone : recorded, "--discretisation_check --predict_from=0.4 --checkpoint='" +
                                           Path("c" + std::to_string(i)) + "' --out='" +
                                           Path("r.json") + "' --report='" + Path("r.html") +
                                           "' --predictions='" + Path("p.csv") + "'");
    ASSERT_EQ(run.exit_status, 0) << run.error;
    results[i] = json::parse(Read(Path("r.json")));
    reports[i] = Read(Path("r.html"));
  }
  for (const char* key : {"covariance", "final_cost", "initial_cost", "residual_rms_by_coordinate",
                          "rollouts", "starts", "prediction", "robust"}) {
    EXPECT_EQ(results[0][key], results[1][key]) << key;
  }
  EXPECT_EQ(results[0]["parameters"], results[1]["parameters"]);
  EXPECT_EQ(results[0]["discretisation"]["parameters"], results[1]["discretisation"]["parameters"]);
  EXPECT_EQ(results[1]["residuals_by_series"][0]["recording"], "a");
  EXPECT_EQ(results[1]["recordings"][0]["name"], "a");
  EXPECT_FALSE(results[0].contains("recordings"));
  EXPECT_FALSE(results[0]["residuals_by_series"][0].contains("recording"));
  for (const std::string& report : reports) {
    EXPECT_NE(report.find("Bias of the step"), std::string::npos);
    EXPECT_NE(report.find("Observed and fitted"), std::string::npos);
  }
}

// Five throws of one ball whose speeds vary: 2 ± 0.5 m/s by hand, seen to 1 mm.
TEST_F(TangibleFitTest, ASpreadIsEstimatedAndItsMistakesAreOneLine) {
  json fit = Problem();
  fit.erase("observations");
  fit["parameters"][1].update(
      {{"per", "recording"}, {"varies", {{"gaussian", {{"spread", "estimate"}}}}}});
  const double speeds[] = {1.5, 2.5, 2.0, 1.25, 2.75};
  double squares = 0.0;
  for (int take = 0; take < 5; ++take) {
    squares += std::pow(speeds[take] - 2.0, 2);
    std::string text = "time,body,x,y\n";
    for (int k = 0; k <= 40; k += 10) {
      text += std::to_string(0.01 * k) + ",ball," + json(0.01 * speeds[take] * k).dump() + "," +
              json(Height(k)).dump() + "\n";
    }
    const std::string file = "take" + std::to_string(take) + ".csv";
    Write(file, text);
    fit["recordings"].push_back({{"name", "take " + std::to_string(take)},
                                 {"observations", {{{"file", file}, {"sigma", 0.001}}}}});
  }
  const auto run_all = [&](const std::string& flags) {
    const ProgramRun run =
        Fit(fit, flags + " --out='" + Path("r.json") + "' --report='" + Path("r.html") + "'");
    EXPECT_EQ(run.exit_status, 0) << run.error;
    EXPECT_NE(run.out.find("spread of "), std::string::npos) << run.out;
    return json::parse(Read(Path("r.json")));
  };
  const std::string checkpoint = "--discretisation_check --checkpoint='" + Path("c") + "'";
  const json result = run_all(checkpoint);
  EXPECT_EQ(run_all(checkpoint)["parameters"], result["parameters"]);
  ASSERT_EQ(result["parameters"].size(), 7u);
  EXPECT_EQ(result["parameters"][1]["name"], "speed");
  EXPECT_NEAR(result["parameters"][1]["estimate"].get<double>(), 2.0, 1e-5);
  EXPECT_NEAR(result["parameters"][2]["estimate"].get<double>(), 1.5, 1e-4);
  const json& spread = result["spreads"][0];
  // What is left of the noise, 1 mm over 0.4 s, is nothing beside it.
  EXPECT_NEAR(spread["spread"].get<double>(), std::sqrt(squares / 4.0), 1e-4);
  // χ² with four degrees of freedom.
  EXPECT_NEAR(spread["confidence_95"][0].get<double>(), std::sqrt(squares / 11.143), 1e-3);
  EXPECT_NEAR(spread["confidence_95"][1].get<double>(), std::sqrt(squares / 0.48442), 2e-3);
  EXPECT_NE(Read(Path("r.html")).find("What varies from recording to recording"),
            std::string::npos);

  const auto expect = [&](const json& varies, const std::string& what) {
    json wrong = fit;
    wrong["parameters"][1]["varies"] = varies;
    std::filesystem::remove(Path("r.json"));
    ExpectOneLine(Fit(wrong, "--out='" + Path("r.json") + "'"), 1, what);
    EXPECT_FALSE(std::filesystem::exists(Path("r.json")));
  };
  expect({{"gaussian", {{"spread", 0}}}},
         "/varies/gaussian/spread: expected \"estimate\" or a number > 0, got 0");
  expect({{"gaussian", {{"spread", "guess"}}}}, "/spread: expected \"estimate\" or a number > 0");
  expect({{"gaussian", {{"sigma", 1}}}}, "/varies/gaussian/sigma: unknown key");
  expect({{"uniform", 1}}, "/parameters/1/varies/uniform: unknown key of varies");
  expect(json::object(), "/varies: expected one of gaussian and log_normal, got none");
  expect({{"log_normal", {{"spread", "estimate"}}}},
         "/varies: expected gaussian for a parameter that may be negative or starts at 0");
  json shared = fit;
  shared["parameters"][1].erase("per");
  ExpectOneLine(Fit(shared), 1, "/varies: expected \"per\": \"recording\" beside it, got none");
  json one = fit;
  one["recordings"].erase(one["recordings"].begin() + 1, one["recordings"].end());
  ExpectOneLine(Fit(one), 1, "/parameters/1/varies: expected at least two recordings");
  one = Problem();
  one["parameters"][1]["per"] = "recording";
  ExpectOneLine(Fit(one), 1, "/parameters/1/per: expected recordings in the file, got none");
}

// The parabola through the first observations, whose step adds half a step's fall to the speed.
TEST_F(TangibleFitTest, ASingleRunBeginsWhereTheObservationsSay) {
  json fit = Problem({{"initial", "from_observations"}});
  fit["parameters"].push_back("bodies/ball/velocity/y");
  fit["parameters"].push_back("bodies/ball/position/y");
  ASSERT_EQ(Fit(fit, "--out='" + Path("r.json") + "'").exit_status, 0);
  const json initial = json::parse(Read(Path("r.json")))["starts"][0]["initial"];
  EXPECT_EQ(initial[0], 8.0);
  EXPECT_NEAR(initial[1].get<double>(), 2.0, 1e-9);
  EXPECT_NEAR(initial[2].get<double>(), 3.0 - 0.5 * 9.5 * 0.01, 1e-9);
  EXPECT_NEAR(initial[3].get<double>(), 1.0, 1e-9);
  fit["initial"] = "from_nothing";
  ExpectOneLine(Fit(fit), 1, "/initial: expected one of from_observations");
  fit = Problem({{"initial", "from_observations"}});
  fit["parameters"].erase(1);
  ExpectOneLine(Fit(fit), 1,
                "fit.json: /initial: expected parameters that set nothing but initial poses, "
                "twists, joint angles, displacements or rates, got none");
}

TEST_F(TangibleFitTest, WithoutAnEstimateWhatNeedsOneIsNotWritten) {
  json fit = Problem();
  fit["parameters"].push_back({{"name", "m"}, {"path", "bodies/ball/mass"}});
  const ProgramRun run = Fit(fit, "--out='" + Path("r.json") + "' --report='" + Path("r.html") +
                                      "' --scene_out='" + Path("s.json") + "'");
  ExpectOneLine(run, 1, "; --report, --scene_out not written: there is no estimate");
  EXPECT_EQ(json::parse(Read(Path("r.json")))["status"], "no_effect");
  EXPECT_FALSE(std::filesystem::exists(Path("r.html")));
  EXPECT_EQ(Fit(fit).error.find("not written"), std::string::npos);
}

TEST_F(TangibleFitTest, FitsAndWritesResultAndReport) {
  const ProgramRun run = Fit(Problem(), "--discretisation_check --out='" + Path("r.json") +
                                            "' --report='" + Path("r.html") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.error, "");
  EXPECT_NE(run.out.find("g = 9.5 ± "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("iterations, "), std::string::npos) << run.out;
  const json result = json::parse(Read(Path("r.json")));
  for (const char* key :
       {"status", "parameters", "covariance", "initial_cost", "final_cost", "residual_rms",
        "reduced_chi_square", "iterations", "rollouts", "seconds", "message"}) {
    EXPECT_TRUE(result.contains(key)) << key;
  }
  EXPECT_EQ(result["status"], "converged");
  const json& g = result["parameters"][0];
  EXPECT_EQ(g["name"], "g");
  EXPECT_NEAR(g["estimate"], 9.5, 1e-8 * 9.5);
  // J = dt² k (k + 1) / 2 over sigma: the observations of y at k = 0, 10, .. 50 determine g alone.
  double information = 0.0;
  for (int k = 0; k <= 50; k += 10) {
    information += std::pow(0.5e-4 * k * (k + 1) / 0.01, 2);
  }
  EXPECT_NEAR(g["standard_deviation"], 1.0 / std::sqrt(information), 1e-9);
  EXPECT_NEAR(g["confidence_95"][1].get<double>() - 9.5, 1.959964 / std::sqrt(information), 1e-6);
  EXPECT_EQ(result["covariance"].size(), 2u);
  EXPECT_EQ(result["iterations"][0]["parameters"], json({8.0, 1.0}));
  EXPECT_EQ(result["iterations"][0]["cost"], result["initial_cost"]);
  // At dt / 2 the same drop takes g dt (t + dt / 2) = g' dt (t + dt / 4): the estimate grows.
  EXPECT_LT(result["discretisation"]["parameters"][0]["bias"].get<double>(), 0.0);
  const std::string report = Read(Path("r.html"));
  EXPECT_NE(report.find("<svg"), std::string::npos);
  EXPECT_NE(report.find("ball y"), std::string::npos);
  for (const char* other : {"src=", "<link", "href=\"http"}) {
    EXPECT_EQ(report.find(other), std::string::npos) << "self-contained: " << other;
  }
}

TEST_F(TangibleFitTest, WritesTheFittedSceneAndItsPredictions) {
  const ProgramRun run =
      Fit(Problem(), "--predict_from=0.3 --out='" + Path("r.json") + "' --report='" +
                         Path("r.html") + "' --scene_out='" + Path("s.json") + "' --predictions='" +
                         Path("p.csv") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.out.find("prediction of 4 observations after 0.3 s: rms "), std::string::npos)
      << run.out;
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["residuals"], 7);  // up to 0.3 s, one of x is missing
  ASSERT_EQ(result["residuals_by_series"].size(), 2u);
  EXPECT_EQ(result["residuals_by_series"][0]["body"], "ball");
  EXPECT_EQ(result["residuals_by_series"][0]["coordinate"], "x");
  EXPECT_EQ(result["residuals_by_series"][0]["file"], "o.csv");
  EXPECT_EQ(result["residuals_by_series"][0]["count"], 3);
  EXPECT_EQ(result["outliers"]["count"], 0);
  EXPECT_EQ(result["prediction"]["from"], 0.3);
  EXPECT_EQ(result["prediction"]["all"]["count"], 4);
  EXPECT_LT(result["prediction"]["all"]["max_length"].get<double>(), 1e-6);
  EXPECT_EQ(result["prediction"]["horizons"].size(), 2u);
  EXPECT_NE(Read(Path("r.html")).find("error of predictions"), std::string::npos);
  // The fitted scene is a scene: it runs, to the same end.
  const json scene = json::parse(Read(Path("s.json")));
  EXPECT_EQ(scene["gravity"][1].get<double>(), -result["parameters"][0]["estimate"].get<double>());
  EXPECT_EQ(scene["simulation"]["duration"], 0.5);
  const ProgramRun again =
      Run("tangible-simulate", "'" + Path("s.json") + "' --out='" + Path("t.csv") + "'");
  EXPECT_EQ(again.exit_status, 0) << again.error;
  const std::string csv = Read(Path("p.csv"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 11) << csv;
  EXPECT_NE(csv.find("0.5,ball,,y,o.csv,,prediction,0.01,"), std::string::npos) << csv;

  ExpectOneLine(Fit(Problem(), "--predict_from=0.5"), 2, "none after it");
  ExpectOneLine(Fit(Problem(), "--predict_from=-1"), 2, "none up to it");
  ExpectOneLine(Fit(Problem(), "--predict_from=-inf"), 2, "none up to it");
  ExpectOneLine(Fit(Problem(), "--predict_from=nan"), 2, "--predict_from");
  ExpectOneLine(Fit(Problem(), "--scene_out='" + Path("o.csv") + "'"), 2, "--scene_out");
  ExpectOneLine(Fit(Problem(), "--predictions='" + Path("none/p.csv") + "'"), 1, "none/p.csv");
}

// A sensor whose noise is half of what was said, with one reading far off.
TEST_F(TangibleFitTest, SensorsNoiseAndOutliersAreNamed) {
  std::string observations = "time,body,x,y\n";
  for (int k = 0; k <= 50; ++k) {
    const double noise = (k % 2 == 0 ? 0.005 : -0.005) + (k == 30 ? 1.0 : 0.0);
    observations += json(0.01 * k).dump() + ",ball," + json(0.02 * k + noise).dump() + "," +
                    json(Height(k) - 0.005 * (k % 3 - 1)).dump() + "\n";
  }
  Write("o.csv", observations);
  const json problem =
      Problem({{"loss", {{"huber", 2}}},
               {"sensors", {{"camera", {{"sigma", 0.01}, {"estimate_sigma", true}}}}},
               {"observations", json::array({{{"file", "o.csv"}, {"sensor", "camera"}}})}});
  const ProgramRun run =
      Fit(problem, "--out='" + Path("r.json") + "' --report='" + Path("r.html") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.out.find("sigma of sensor camera: 0."), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("1 outlier, the largest at 0.3 s in ball x by camera: -"),
            std::string::npos)
      << run.out;
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["sensor_noise"][0]["sensor"], "camera");
  EXPECT_NEAR(result["sensor_noise"][0]["sigma_factor"], 0.7, 0.1);  // 1.4826 · 0.005
  EXPECT_EQ(result["outliers"]["count"], 1);
  EXPECT_EQ(result["outliers"]["largest"][0]["sensor"], "camera");
  EXPECT_DOUBLE_EQ(result["outliers"]["largest"][0]["time"], 0.3);
  EXPECT_EQ(result["residuals_by_series"][0]["sensor"], "camera");
  EXPECT_NE(Read(Path("r.html")).find("<h2>Outliers"), std::string::npos);
  // The same as one recording, with a checkpoint, which the second time has all that was done.
  json several = problem;
  several["recordings"] = {{{"name", "a"}, {"observations", problem["observations"]}}};
  several.erase("observations");
  const std::string checkpoint = "--checkpoint='" + Path("c.json") + "' ";
  for (int time = 0; time < 2; ++time) {
    ASSERT_EQ(Fit(several, checkpoint + "--out='" + Path("s.json") + "'").exit_status, 0);
    const json again = json::parse(Read(Path("s.json")));
    for (const char* key : {"sensor_noise", "covariance", "final_cost", "residuals", "outliers"}) {
      const json& value = key == std::string("outliers") ? again[key]["count"] : again[key];
      EXPECT_EQ(value, key == std::string("outliers") ? result[key]["count"] : result[key]) << key;
    }
    EXPECT_EQ(again["parameters"][0]["estimate"], result["parameters"][0]["estimate"]);
  }
}

// Each of ten links' dampings, where six columns have room beside the cost.
TEST_F(TangibleFitTest, AllParametersAreVisibleWhileItRuns) {
  json scene = {{"bodies", json::array()}, {"simulation", {{"dt", 0.01}, {"duration", 0.1}}}};
  json fit = Problem({{"parameters", json::array()}});
  std::string observations = "time,body,x,y\n";
  for (int i = 0; i < 10; ++i) {
    const std::string name = "ball" + std::to_string(i);
    scene["bodies"].push_back(
        {{"name", name}, {"mass", 1}, {"inertia", 1}, {"position", {i, 0}}, {"velocity", {1, 0}}});
    fit["parameters"].push_back("bodies/" + name + "/velocity/x");
    observations += "0.1," + name + "," + json(i + 0.11).dump() + ",\n";
  }
  Write("scene.json", scene.dump());
  Write("o.csv", observations);
  const ProgramRun run = Fit(fit);
  ASSERT_EQ(run.exit_status, 0) << run.error;
  for (int i = 0; i < 10; ++i) {
    const std::string shown = "bodies/ball" + std::to_string(i) + "/velocity/x 1.1";
    EXPECT_NE(run.out.find(shown), std::string::npos) << shown << "\n" << run.out;
  }
}

// A ball is dropped from the height H = 1 m onto a floor and bounces elastically, at t = v / g with
// v = √(2 g H). After that dy/dH = 2 g s / v − 1 with s = t − v / g, and of the map 1, as before.
TEST_F(TangibleFitTest, WarnsOfDerivativesThroughAnImpactAndComparesThem) {
  const auto fit = [&](const std::string& stepping, const std::string& flags) {
    Write("scene.json", R"({"bodies": [
        {"name": "ball", "shape": {"circle": {"radius": 0.25}}, "mass": 2, "position": [0, 1.25],
         "restitution": 1},
        {"name": "floor", "static": true, "restitution": 1,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
        "simulation": {"dt": 0.01, "duration": 0.56, "stepping": ")" +
                            stepping + R"("}})");
    const ProgramRun observed =
        Run("tangible-simulate", "'" + Path("scene.json") + "' --noise=0 --seed=1 --rate=12.5" +
                                     " --observe='" + Path("o.csv") + "'");
    EXPECT_EQ(observed.exit_status, 0) << observed.error;
    return Fit(json::parse(R"({"scene": "scene.json",
        "observations": [{"file": "o.csv", "sigma": 0.01}],
        "parameters": [{"name": "height", "initial": 1.27, "lower": 1.1, "upper": 1.5,
                        "sets": [{"path": "bodies/ball/position/y"}]}]})"),
               "--out='" + Path("r.json") + "' --report='" + Path("r.html") + "' " + flags);
  };
  const ProgramRun fixed = fit("fixed", "--compare_motion");
  ExpectOneLine(fixed, 0, "warning: the derivative is that of the discrete map");
  EXPECT_NE(fixed.error.find("contact of ball and floor, an impact with restitution"),
            std::string::npos)
      << fixed.error;
  json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["certificate"]["verdict"], "of the discrete map: trustworthy");
  EXPECT_NE(result["warnings"].dump().find("those of the discrete map"), std::string::npos);
  EXPECT_NE(Read(Path("r.html")).find("differentiates the motion"), std::string::npos);
  const double g = 9.81, v = std::sqrt(2.0 * g);
  double apart = 0.0, of_motion = 0.0;
  for (int k = 0; k < 8; ++k) {
    const double s = 0.08 * k - v / g;
    const double motion = s < 0.0 ? 1.0 : 2.0 * g * s / v - 1.0;
    apart += (1.0 - motion) * (1.0 - motion);
    of_motion += motion * motion;
  }
  const double expected = std::sqrt(apart / std::max(8.0, of_motion));
  ASSERT_GT(expected, 0.8);
  // The estimate is 1.25 to the fit's tolerance, and there are the closed forms.
  EXPECT_NEAR(result["motion"]["difference_max"], expected, 1e-6);
  EXPECT_EQ(result["motion"]["differences"][0]["parameter"], "height");
  EXPECT_EQ(result["motion"]["verdict"], "trustworthy");
  // The impact moves to the next step, or the one before, within 4.4 m/s times a step.
  const json radius = result["certificate"]["radius"]["height"];
  EXPECT_GT(radius["down"], 0.0);
  EXPECT_LT(double(radius["down"]) + double(radius["up"]), 2.0 * 0.01 * v);

  const ProgramRun event = fit("event", "");
  EXPECT_EQ(event.exit_status, 0);
  EXPECT_EQ(event.error, "");
  result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["certificate"]["verdict"], "trustworthy");
  EXPECT_EQ(result["certificate"]["discrete_map"], false);
  // The impact leaves the run beyond the bounds.
  EXPECT_TRUE(result["certificate"]["radius"]["height"]["up"].is_null());
  EXPECT_FALSE(result.contains("motion"));
  ExpectOneLine(fit("event", "--compare_motion"), 1, "expected a scene with fixed steps");
}

// The ball lands in the last step, in which its twist has derivatives of order 1 / dt.
TEST_F(TangibleFitTest, WarnsWhereDerivativesAreNotTrustworthy) {
  const auto fit = [&](const std::string& duration) {
    Write("scene.json", R"({"bodies": [
        {"name": "ball", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0.15]},
        {"name": "floor", "static": true,
         "shape": {"half_plane": {"normal": [0, 1], "offset": 0}}}],
        "gravity": [0, -9.8], "simulation": {"dt": 0.01, "duration": )" +
                            duration + "}}");
    // 0.15 - g dt² k (k + 1) / 2 of the steps before the ball lands, in the tenth.
    std::string text = "time,body,y\n";
    for (const int k : {0, 3, 6, 9}) {
      text += std::to_string(0.01 * k) + ",ball," + json(0.15 - 9.5e-4 * 0.5 * k * (k + 1)).dump() +
              "\n";
    }
    Write("o.csv", text + duration + ",ball,0.1\n");
    return Fit(json::parse(R"({"scene": "scene.json",
        "observations": [{"file": "o.csv", "sigma": 0.01}],
        "parameters": [{"name": "g", "initial": 9.8, "lower": 9.2, "upper": 20,
                        "sets": [{"path": "gravity/y", "scale": -1}]}]})"),
               "--out='" + Path("r.json") + "' --report='" + Path("r.html") + "'");
  };
  const ProgramRun landing = fit("0.1");
  EXPECT_EQ(landing.exit_status, 0) << landing.error;
  ExpectOneLine(landing, 0,
                "warning: not trustworthy at the estimate: of the discrete map: discontinuous: "
                "landing");
  json result = json::parse(Read(Path("r.json")));
  EXPECT_NEAR(result["parameters"][0]["estimate"], 9.5, 1e-6);
  const std::string verdict = result["certificate"]["verdict"];
  EXPECT_EQ(verdict.find("of the discrete map: discontinuous: landing in the last step"), 0u)
      << verdict;
  EXPECT_NE(landing.error.find(R"("stepping": "event")"), std::string::npos) << landing.error;
  EXPECT_NE(result["message"].get<std::string>().find("discontinuous: landing"), std::string::npos);
  EXPECT_NE(Read(Path("r.html")).find("discontinuous: landing"), std::string::npos);

  const ProgramRun later = fit("0.11");
  EXPECT_EQ(later.exit_status, 0) << later.error;
  EXPECT_EQ(later.error, "");
  result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["certificate"]["verdict"], "of the discrete map: trustworthy");
  EXPECT_EQ(result["certificate"]["discrete_map"], true);
  EXPECT_NE(Read(Path("r.html")).find("of the discrete map: trustworthy"), std::string::npos);
  for (const char* key : {"margin_min", "margin_where", "degenerate_rows", "redundant_rows",
                          "condition", "linear_residual", "mode_switches", "events"}) {
    EXPECT_TRUE(result["certificate"].contains(key)) << key;
  }
}

TEST_F(TangibleFitTest, FlagsOverrideTheFile) {
  const ProgramRun run = Fit(Problem({{"derivatives", "adjoint"}}),
                             "--derivatives=finite_difference --initial='g=19,speed=-3'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.out.find("19"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("g = 9.5"), std::string::npos) << run.out;
  EXPECT_EQ(Fit(Problem(), "--derivatives=guess").exit_status, 2);
  EXPECT_EQ(Fit(Problem(), "--initial=mass=1").exit_status, 2);
  ExpectOneLine(Fit(Problem(), "--initial=g=1,speed=3,g=2"), 2,
                "expected one value of each parameter, got two of 'g'");
  EXPECT_EQ(Fit(Problem(), "--max_iterations=0").exit_status, 2);
  EXPECT_EQ(Run("tangible-fit", "").exit_status, 2);
  EXPECT_EQ(Run("tangible-fit", "--no_such_flag x.json").exit_status, 2);
  EXPECT_EQ(Run("tangible-fit", "--help").exit_status, 0);
}

// A run of no steps, or the last instant of a run, with a delay or a clock that moves the times of
// observations: nothing moves there, so that the parameter has no effect.
TEST_F(TangibleFitTest, ATimeThatMovesInARunOfNoStepsIsOneLine) {
  for (const std::string stepping : {"fixed", "event"}) {
    for (const std::string duration : {"0", "1"}) {
      Write("still.json", R"({"gravity": [0, 0], "bodies": [
          {"name": "b", "shape": {"circle": {"radius": 0.1}}, "mass": 1, "position": [0, 0]}],
        "simulation": {"dt": 0.01, "stepping": ")" +
                              stepping + R"(", "duration": )" + duration + "}}");
      for (const bool of_clock : {true, false}) {
        SCOPED_TRACE(stepping + duration + (of_clock ? " clock" : " delay"));
        json fit = {{"scene", "still.json"}, {"parameters", {"bodies/b/position/x"}}};
        json observation = {{"file", "one.csv"}, {"sigma", 0.001}};
        if (of_clock) {
          fit["clocks"] = {{"c", json::object()}};
          observation["clock"] = "c";
          fit["parameters"].push_back(
              {{"name", "rate"}, {"path", "clocks/c/rate"}, {"lower", 0.9}, {"upper", 1.1}});
        } else {
          fit["sensors"] = {{"c", json::object()}};
          observation["sensor"] = "c";
          fit["parameters"].push_back(
              {{"name", "delay"}, {"path", "sensors/c/delay"}, {"initial", 0}});
        }
        Write("one.csv", "time,body,x,y\n0,b,0.01,0\n");
        fit["observations"] = {observation};
        ExpectOneLine(Fit(fit), 1, "has no effect on any residual");
        if (duration == "0" || !of_clock) continue;
        fit.erase("observations");
        Write("one.csv", "time,body,x,y\n0.5,b,0.01,0\n1,b,0.01,0\n");
        fit["recordings"] = {{{"name", "r"}, {"start", 1}, {"observations", {observation}}}};
        ExpectOneLine(Fit(fit), 1, "has no effect on any residual");
      }
    }
  }
}

// Small swings of a rod whose inertia about its pivot is 0.9 m c², of which the scene's c alone
// makes m c²: the best inertia about the centre of mass is its bound, 0, which a logarithm does not
// reach, and c is what drives it there.
TEST_F(TangibleFitTest, AnInertiaThatRunsToZeroIsAtItsBound) {
  Write("rod.json", R"({"bodies": [{"name": "rod", "mass": 0.2, "inertia": 0.01,
                                   "position": [0, -0.5]}],
      "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0],
                  "angle": 0.1}],
      "simulation": {"dt": 0.01, "duration": 2, "stepping": "event"}})");
  const double omega = std::sqrt(9.81 / (0.9 * 0.5));
  std::string text = "time,body,x\n";
  for (int k = 0; k <= 40; ++k) {
    const double angle = 0.1 * std::cos(omega * 0.05 * k);
    text += json(0.05 * k).dump() + ",rod," + json(0.5 * std::sin(angle)).dump() + "\n";
  }
  Write("swings.csv", text);
  for (const double initial : {0.01, 0.5}) {
    const ProgramRun run =
        Fit({{"scene", "rod.json"},
             {"observations", {{{"file", "swings.csv"}, {"sigma", 0.001}}}},
             {"parameters",
              {{{"name", "inertia"}, {"path", "bodies/rod/inertia"}, {"initial", initial}}}}},
            "--out='" + Path("r.json") + "'");
    ASSERT_EQ(run.exit_status, 0) << run.error;
    EXPECT_NE(run.out.find("at its lower bound 0)"), std::string::npos) << run.out;
    EXPECT_EQ(run.error.find("coordinates are too large"), std::string::npos) << run.error;
    const json result = json::parse(Read(Path("r.json")));
    EXPECT_EQ(result["status"], "converged");
    EXPECT_NEAR(result["parameters"][0]["estimate"], 1e-10 * initial, 1e-16 * initial);
    EXPECT_TRUE(result["parameters"][0]["confidence_95"].is_null());
    bool blamed = false;
    for (const json& held : result["held_parameters"]) {
      blamed = blamed || held["path"] == "bodies/rod/position/y";
      // To first order: no more than some times what the scene has.
      EXPECT_LT(std::abs(held["change"].get<double>()), 1e4) << held;
    }
    EXPECT_TRUE(blamed) << result["held_parameters"];
  }
}

// A force that begins at 0.43 s, found from where it begins on the end of a step.
TEST_F(TangibleFitTest, TheStartOfAForceIsFoundFromAStepsEnd) {
  Write("push.json", R"({"gravity": [0, 0], "bodies": [{"name": "b", "mass": 1, "inertia": 1,
      "position": [0, 0]}], "forces": [{"name": "f", "body": "b", "force": [4, 0], "start": 0.5}],
      "simulation": {"dt": 0.01, "duration": 1, "stepping": "event"}})");
  std::string text = "time,body,x\n";
  for (int k = 0; k <= 20; ++k) {
    const double since = std::max(0.0, 0.05 * k - 0.43);
    text += json(0.05 * k).dump() + ",b," + json(2.0 * since * since).dump() + "\n";
  }
  Write("o.csv", text);
  for (const double initial : {0.5, 0.25, 0.503}) {
    json fit = {{"scene", "push.json"}, {"observations", {{{"file", "o.csv"}, {"sigma", 0.001}}}}};
    fit["parameters"] = {{{"path", "forces/f/start"}, {"initial", initial}}};
    ASSERT_EQ(Fit(fit, "--out='" + Path("r.json") + "'").exit_status, 0) << initial;
    EXPECT_NEAR(json::parse(Read(Path("r.json")))["parameters"][0]["estimate"], 0.43, 1e-6);
  }
}

// Huber's loss of a value is finite where its square is not, which all that is said of a fit needs.
TEST_F(TangibleFitTest, AValueWhoseSquareOverflowsIsAnError) {
  json fit = Problem({{"loss", {{"huber", 2}}}});
  for (const std::string value : {"1e300", "-1e160"}) {
    Write("o.csv", Observations() + "0.25,ball,0.5," + value + "\n");
    ExpectOneLine(Fit(fit), 1, "are not finite");
  }
  Write("o.csv", Observations() + "0.25,ball,0.5,1e100\n");
  const ProgramRun run = Fit(fit, "--out='" + Path("r.json") + "'");
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_TRUE(json::parse(Read(Path("r.json")))["reduced_chi_square"].is_number());
}

// The chain's fit by event stepping (data/README.md): no bias of the step, the interval holds the
// mass that the observations were made with.
TEST_F(TangibleFitTest, ChainByEventsCoversTheTrueMass) {
  const ProgramRun run =
      Run("tangible-fit",
          TANGIBLE_SOURCE_DIR "/data/fits/chain_event.json --out='" + Path("r.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  const json result = json::parse(Read(Path("r.json")));
  const json& interval = result.at("parameters").at(0).at("confidence_95");
  EXPECT_LE(interval.at(0).get<double>(), 7.0);
  EXPECT_GE(interval.at(1).get<double>(), 7.0);
  EXPECT_LT(interval.at(1).get<double>() - interval.at(0).get<double>(), 0.003);
}

TEST_F(TangibleFitTest, MistakesAreOneLineWithTheirPlace) {
  const json parameters = Problem()["parameters"];
  const auto with = [&parameters](const json& more) {
    json list = parameters;
    list.push_back(more);
    return json{{"parameters", list}};
  };
  const std::pair<json, std::string> cases[] = {
      {{{"sene", 1}}, "fit.json: /sene: unknown key"},
      {{{"scene", "no.json"}}, "no.json: cannot be read"},
      {{{"observations", json::array()}}, "fit.json: /observations: expected at least one"},
      {{{"observations", {{{"file", "o.csv"}, {"sigma", 0}}}}},
       "fit.json: /observations/0/sigma: expected a number > 0, got 0"},
      {{{"observations", {{{"file", "o.csv"}, {"sigma", {{"x", 1}}}}}}},
       "fit.json: /observations/0/sigma: expected a sigma of y"},
      {{{"points", {{"tip", {{"body", "bal"}, {"at", {0, 0}}}}}}},
       "fit.json: /points/tip/body: expected the name of a body (ball), got \"bal\""},
      {{{"derivatives", "guess"}}, "fit.json: /derivatives: expected one of tangent"},
      {{{"loss", {{"huber", -1}}}}, "fit.json: /loss/huber: expected a number > 0, got -1"},
      {{{"segments", 0}}, "fit.json: /segments: expected an integer"},
      {{{"parameters", json::array()}}, "fit.json: /parameters: expected at least one parameter"},
      {with({{"name", "g"}, {"path", "gravity/x"}}),
       "fit.json: /parameters/2/name: expected names"},
      {with({{"name", "m"}, {"path", "bodies/bal/mass"}}), "/parameters/2/sets/0/path: "},
      {with({{"name", "v"}, {"path", "bodies/*/velocity/x"}}), "is set twice"},
      {with({{"name", "m"}, {"path", "bodies/ball/mass"}, {"initial", 3}, {"upper", 2}}),
       "fit.json: /parameters/2/initial: expected a number within the bounds"},
      {with({{"name", "m"}, {"path", "bodies/ball/mass"}}),
       "fit.json: /parameters/2: parameter \"m\" has no effect on any residual"},
      {with({{"name", "m"}, {"paths", "bodies/ball/mass"}}), "/parameters/2/paths: unknown key"},
      {with(3), "fit.json: /parameters/2: expected an object"}};
  for (const auto& [changes, message] : cases) {
    SCOPED_TRACE(message);
    const ProgramRun run = Fit(Problem(changes));
    ExpectOneLine(run, 1, message);
  }
}

TEST_F(TangibleFitTest, ASensorThatIsPredictedHasNoSigmaToEstimate) {
  Write("late.csv", "time,body,x\n0.4,ball,0.8\n0.5,ball,1\n");
  const json late = {{"file", "late.csv"}, {"sigma", 0.01}, {"sensor", "s"}};
  json fit = Problem({{"sensors", {{"s", {{"estimate_sigma", true}}}}}});
  fit["observations"].push_back(late);
  ExpectOneLine(Fit(fit, "--predict_from=0.3"), 2,
                "--predict_from: expected a time with observations of sensor \"s\", whose sigma is "
                "estimated, up to it, got 0.3 with none");
}

// One parameter in the place of four hand-written sets: a pendulum whose bob hangs at a point.
TEST_F(TangibleFitTest, ALengthIsOneParameter) {
  Write("arm.json",
        R"({"bodies": [{"name": "rod", "mass": 1, "inertia": 0.1, "position": [0, -0.5]},
    {"name": "bob", "mass": 2, "inertia": 0.01, "position": [0, -1]}],
    "joints": [{"name": "pin", "type": "revolute", "bodies": ["rod", "world"], "anchor": [0, 0],
                "angle": 0.5},
               {"name": "end", "type": "weld", "bodies": ["bob", "rod"], "anchor": [0, -1]}],
    "simulation": {"dt": 0.005, "duration": 1}})");
  // Without a motion: where the bob is at time 0 tells its distance.
  Write("bob.csv", "time,body,x,y\n0,bob," + json(1.2 * std::sin(0.5)).dump() + "," +
                       json(-1.2 * std::cos(0.5)).dump() + "\n0.005,bob,,\n");
  json fit = json::parse(R"({"scene": "arm.json",
    "observations": [{"file": "bob.csv", "sigma": 0.01}],
    "links": {"arm": {"from": "pin", "to": "end"}}, "parameters": ["links/arm/length"]})");
  const ProgramRun run = Fit(fit, "--out='" + Path("r.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.out << run.error;
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_NEAR(result["parameters"][0]["estimate"].get<double>(), 1.2, 1e-9);
  EXPECT_EQ(result["parameters"][0]["name"], "links/arm/length");
  fit["links"]["arm"]["to"] = "elbow";
  const ProgramRun wrong = Fit(fit);
  EXPECT_EQ(wrong.exit_status, 1);
  EXPECT_NE(wrong.error.find("/links/arm/to: expected the name of a joint or point"),
            std::string::npos)
      << wrong.error;
  fit["links"] = json::object();
  const ProgramRun none = Fit(fit);
  EXPECT_NE(none.error.find("/parameters/0: parameter links/arm/length: matches no number"),
            std::string::npos)
      << none.error;
}

// What the intervals are, and what a wrong name is.
TEST_F(TangibleFitTest, ProfilesAreAskedForByName) {
  const ProgramRun run = Fit(Problem(), "--profile=g --out='" + Path("r.json") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.out << run.error;
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["parameters"][0]["interval_method"], "profile");
  EXPECT_EQ(result["profiles"][0]["name"], "g");
  EXPECT_EQ(result["profiles"][0]["branches"].size(), 1U);
  EXPECT_NE(run.out.find(", by its profile)"), std::string::npos) << run.out;
  const ProgramRun wrong = Fit(Problem(), "--profile=g,x");
  EXPECT_EQ(wrong.exit_status, 2);
  EXPECT_EQ(
      wrong.error,
      "tangible-fit: --profile: expected names of parameters, separated by commas, got 'x'\n");
}

TEST_F(TangibleFitTest, NoFileIsWrittenTwice) {
  ExpectOneLine(Fit(Problem(), "--out='" + Path("r") + "' --report='" + Path("r") + "'"), 2,
                "--report: expected a file of its own, got that of --out");
  ExpectOneLine(Fit(Problem(), "--fromenv=out"), 2, "unknown flag --fromenv");
}

TEST_F(TangibleFitTest, BadObservationsAndFiles) {
  Write("o.csv", "time,body,x\n0,ball,1\n0.1,box,1\n");
  ExpectOneLine(Fit(Problem()), 1, "o.csv: line 3: body: expected the name of a body (ball)");
  Write("o.csv", "time,body,x\n");
  ExpectOneLine(Fit(Problem()), 1, "o.csv: expected at least one measured coordinate");
  Write("o.csv", "time,body,x\n0.6,ball,1\n");
  ExpectOneLine(Fit(Problem()), 1, "o.csv: line 2: time: expected a time within the run");
  Write("o.csv", Observations());
  ExpectOneLine(Fit(Problem(), "--out=/no/such/folder/r.json"), 1, "/no/such/folder/r.json");
  ExpectOneLine(Run("tangible-fit", "'" + Write("half.json", R"({"scene": "scene.js)") + "'"), 1,
                "half.json: line 1");
  ExpectOneLine(Run("tangible-fit", "'" + Path("none.json") + "'"), 1, "none.json: cannot be read");
}

}  // namespace
}  // namespace tangible
