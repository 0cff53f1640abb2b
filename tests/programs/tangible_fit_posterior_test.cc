// SPDX-License-Identifier: Apache-2.0
//
// tangible-fit --posterior, end to end.
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "fit_fixture.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleFitPosteriorTest : public FitProgramTest {
 protected:
  void SetUp() override { SetUpWith(Observations()); }

  /// x = 2 t and the height, with errors of 0.01 in turn.
  static std::string Observations() {
    std::string text = "time,body,x,y\n";
    for (int k = 0; k <= 50; k += 5) {
      const double error = (k % 10 == 0 ? 0.01 : -0.01);
      text += json(0.01 * k).dump() + ",ball," + json(0.02 * k + error).dump() + "," +
              json(Height(k) - error).dump() + "\n";
    }
    return text;
  }
  std::string Flag(const std::string& flag, const std::string& name) const {
    return " --" + flag + "='" + Path(name) + "'";
  }
};

TEST_F(TangibleFitPosteriorTest, WritesIntervalsDrawsScenesAndBands) {
  const ProgramRun run =
      Fit(Problem(), "--posterior=12 --predict_from=0.41" + Flag("out", "r.json") +
                         Flag("report", "r.html") + Flag("posterior_samples", "p.csv") +
                         Flag("posterior_scenes", "scenes") + Flag("posterior_bands", "b.csv"));
  ASSERT_EQ(run.exit_status, 0) << run.out << run.error;
  const json result = json::parse(Read(Path("r.json")));
  const json& posterior = result["posterior"];
  EXPECT_EQ(posterior["draws"], 12);
  EXPECT_EQ(posterior["transitions"], 1000);
  EXPECT_EQ(posterior["divergences"], 0);
  for (int k = 0; k < 2; ++k) {
    const json& parameter = result["parameters"][k];
    EXPECT_EQ(parameter["interval_method"], "posterior");
    EXPECT_EQ(parameter["interval_95"], posterior["parameters"][k]["interval_95"]);
    // Positions are linear in both parameters: the density is normal. 1000 draws.
    const double deviation = parameter["standard_deviation"].get<double>();
    const json& of = posterior["parameters"][k];
    EXPECT_NEAR(of["standard_deviation"].get<double>() / deviation, 1.0, 0.15);
    EXPECT_NEAR(of["mean"].get<double>(), parameter["estimate"].get<double>(), 0.2 * deviation);
    EXPECT_LT(of["r_hat"].get<double>(), 1.03);
    EXPECT_GT(of["ess_bulk"].get<double>(), 300.0);
    EXPECT_GT(of["ess_tail"].get<double>(), 200.0);
  }
  EXPECT_NE(run.out.find("posterior of g: mean"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find(", of the posterior"), std::string::npos) << run.out;
  EXPECT_NE(Read(Path("r.html")).find("<h2>Posterior</h2>"), std::string::npos);

  // A row and a scene for each draw, of the same values.
  std::istringstream table(Read(Path("p.csv")));
  std::string line;
  std::getline(table, line);
  EXPECT_EQ(line, "draw,chain,cost,g,speed");
  for (int i = 0; i < 12; ++i) {
    ASSERT_TRUE(std::getline(table, line)) << i;
    const std::string name =
        std::string("scenes/scene_0") + (i < 10 ? "0" : "") + std::to_string(i) + ".json";
    const json scene = json::parse(Read(Path(name)));
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    ASSERT_EQ(cells.size(), 5U);
    EXPECT_DOUBLE_EQ(-scene["gravity"][1].get<double>(), std::stod(cells[3]));
    EXPECT_DOUBLE_EQ(scene["bodies"][0]["velocity"][0].get<double>(), std::stod(cells[4]));
  }
  EXPECT_FALSE(std::filesystem::exists(Path("scenes/scene_012.json")));
  EXPECT_EQ(Run("tangible-simulate", "'" + Path("scenes/scene_003.json") + "'").exit_status, 0);

  // Later predictions are wider, and all contain the truth.
  std::istringstream bands(Read(Path("b.csv")));
  std::getline(bands, line);
  EXPECT_EQ(line, "time,series,used,sigma,observed,low,median,high");
  int rows = 0, later = 0;
  while (std::getline(bands, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    ASSERT_EQ(cells.size(), 8U) << line;
    ++rows;
    later += cells[2] == "prediction" ? 1 : 0;
    EXPECT_LE(std::stod(cells[5]), std::stod(cells[6]));
    EXPECT_LE(std::stod(cells[6]), std::stod(cells[7]));
    EXPECT_NEAR(std::stod(cells[6]), std::stod(cells[4]), 0.03) << line;
    if (std::stod(cells[0]) > 0.3) {
      EXPECT_LT(std::stod(cells[5]), std::stod(cells[7])) << line;
    }
  }
  EXPECT_EQ(rows, 22);
  EXPECT_EQ(later, 4);
}

// The same draws from the same seed, others from another one.
TEST_F(TangibleFitPosteriorTest, TheSeedDecides) {
  const auto draw = [&](const std::string& flags) {
    EXPECT_EQ(
        Fit(Problem(), "--posterior=8 " + flags + Flag("posterior_samples", "p.csv")).exit_status,
        0);
    return Read(Path("p.csv"));
  };
  const std::string first = draw("");
  EXPECT_EQ(draw("--posterior_seed=0"), first);
  EXPECT_NE(draw("--posterior_seed=1"), first);
}

TEST_F(TangibleFitPosteriorTest, RecordingsHaveAsManyScenes) {
  json fit = Problem();
  fit.erase("observations");
  fit["parameters"][1]["per"] = "recording";
  fit["recordings"] = json::parse(R"([
    {"name": "a", "observations": [{"file": "o.csv", "sigma": 0.01}]},
    {"name": "b", "observations": [{"file": "o.csv", "sigma": 0.02}]}])");
  const ProgramRun run = Fit(
      fit, "--posterior=3" + Flag("posterior_scenes", "s") + Flag("posterior_samples", "p.csv"));
  ASSERT_EQ(run.exit_status, 0) << run.out << run.error;
  EXPECT_EQ(Read(Path("p.csv")).substr(0, 44), "draw,chain,cost,g,speed of a,speed of b\n0,0,");
  EXPECT_TRUE(std::filesystem::exists(Path("s/scene_002_1.json")));
  EXPECT_FALSE(std::filesystem::exists(Path("s/scene_002_2.json")));
}

// Distances from a post do not tell on which side of it the ball flies: chains stay on one side,
// and with temperatures they pass to the other.
TEST_F(TangibleFitPosteriorTest, TemperaturesFindTheOtherMode) {
  json scene = json::parse(Read(Path("scene.json")));
  scene["bodies"].push_back({{"name", "post"}, {"static", true}, {"position", {0.0, 0.0}}});
  Write("scene.json", scene.dump());
  std::string text = "time,body,relative_to,distance\n";
  for (int k = 5; k <= 50; k += 5) {
    text += json(0.01 * k).dump() + ",ball,post," +
            json(std::hypot(0.02 * k, Height(k)) + (k % 10 == 0 ? 0.02 : -0.02)).dump() + "\n";
  }
  Write("o.csv", text);
  json fit = Problem();
  fit["observations"][0]["sigma"] = 0.1;
  fit["parameters"] = {{{"name", "speed"},
                        {"initial", 1.5},
                        {"lower", -5},
                        {"upper", 5},
                        {"path", "bodies/ball/velocity/x"}}};
  // The share of each chain's draws on the right.
  const auto shares = [&](const std::string& flags) {
    const ProgramRun run = Fit(fit, "--posterior=400 --posterior_warm_up=300 " + flags +
                                        Flag("out", "r.json") + Flag("posterior_samples", "p.csv"));
    EXPECT_EQ(run.exit_status, 0) << run.error;
    std::istringstream lines(Read(Path("p.csv")));
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line, "draw,chain,cost,speed");
    std::vector<double> of_chain(4, 0.0);
    while (std::getline(lines, line)) {
      const size_t chain = static_cast<size_t>(line[line.find(',') + 1] - '0');
      of_chain.at(chain) += line[line.rfind(',') + 1] == '-' ? 0.0 : 0.01;
    }
    return of_chain;
  };
  for (const double share : shares("")) {
    EXPECT_NEAR(share * (1.0 - share), 0.0, 1e-12) << share << ": a chain stays where it began";
  }
  EXPECT_EQ(json::parse(Read(Path("r.json")))["posterior"]["exchanged"], 1.0);
  double all = 0.0;
  for (const double share : shares("--posterior_temperatures=6")) {
    EXPECT_NEAR(share, 0.5, 0.4);
    all += 0.25 * share;
  }
  EXPECT_NEAR(all, 0.5, 0.2);
  const json posterior = json::parse(Read(Path("r.json")))["posterior"];
  EXPECT_EQ(posterior["temperatures"], 6);
  EXPECT_GT(posterior["exchanged"].get<double>(), 0.1);
  EXPECT_LT(posterior["parameters"][0]["interval_95"][0].get<double>(), -1.0);
  ExpectOneLine(Fit(fit, "--posterior=9 --posterior_temperatures=0"), 2,
                "--posterior_temperatures: expected");
}

TEST_F(TangibleFitPosteriorTest, ThreadsChangeNoBit) {
  const auto result = [&](const std::string& flags) {
    const ProgramRun run = Fit(Problem(), flags + " --posterior=20" + Flag("out", "r.json"));
    EXPECT_EQ(run.exit_status, 0) << run.error;
    return json::parse(Read(Path("r.json")), [](int, json::parse_event_t event, json& parsed) {
      return event != json::parse_event_t::key || parsed != "seconds";
    });
  };
  const json one = result("--threads=1");
  EXPECT_EQ(result("--threads=3"), one);
  EXPECT_EQ(result(""), one);
  ExpectOneLine(Fit(Problem(), "--threads=-1"), 2, "--threads: expected");
}

TEST_F(TangibleFitPosteriorTest, BadFlags) {
  for (const std::string text : {"0", "-3", "2.5", "x", "1,2"}) {
    ExpectOneLine(
        Fit(Problem(), "--posterior=" + text), 2,
        "tangible-fit: --posterior: expected a whole number from 1 to 1000000, got '" + text + "'");
  }
  ExpectOneLine(Fit(Problem(), Flag("posterior_samples", "p.csv")), 2,
                "--posterior: expected a number of draws beside --posterior_samples");
  ExpectOneLine(Fit(Problem(), "--posterior=5 --posterior_chains=0"), 2,
                "--posterior_chains: expected a number from 1 to 64, got 0");
  ExpectOneLine(Fit(Problem(), "--posterior=5 --posterior_target=1"), 2, "--posterior_target");
  ExpectOneLine(Fit(Problem(), "--posterior=5" + Flag("posterior_scenes", "o.csv")), 2,
                "--posterior_scenes: expected a folder, got");
  ExpectOneLine(Fit(Problem(), "--posterior=5" + Flag("posterior_scenes", "none/s")), 2,
                "--posterior_scenes: expected a folder in one that exists, got");
  ExpectOneLine(Fit(Problem(), "--posterior=5" + Flag("posterior_samples", "o.csv")), 2,
                "--posterior_samples: expected a file of its own");
}

// Only the sum of two speeds is observed: there is no density to draw from, and the fit is written.
TEST_F(TangibleFitPosteriorTest, WhatIsNotDeterminedIsSaid) {
  json fit = Problem();
  fit["parameters"].push_back(json::parse(
      R"({"name": "more", "initial": 0, "sets": [{"path": "bodies/ball/velocity/x", "add": true}]})"));
  const ProgramRun run = Fit(fit, "--posterior=5" + Flag("out", "r.json"));
  ExpectOneLine(run, 1, "--posterior: the observations do not determine 'speed': expected a prior");
  EXPECT_EQ(json::parse(Read(Path("r.json"))).count("posterior"), 0U);
}

}  // namespace
}  // namespace tangible
