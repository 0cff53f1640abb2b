// SPDX-License-Identifier: Apache-2.0
//
// What tangible-fit says would explain the residuals.
#include <algorithm>
#include <random>
#include <sstream>

#include "fit_fixture.h"

namespace tangible {
namespace {

class TangibleFitMissingTest : public FitProgramTest {
 protected:
  // The ball is pushed along x by what the scene does not know.
  void SetUp() override {
    std::mt19937 random(3);
    std::normal_distribution<double> normal(0.0, 0.01);
    std::ostringstream table;
    table << "time,body,x,y\n";
    for (int k = 0; k <= 50; ++k) {
      const double push = 0.5 * kPush * 1e-4 * k * (k + 1);
      table << 0.01 * k << ",ball," << 0.02 * k + push + normal(random) << ","
            << Height(k) + normal(random) << "\n";
    }
    SetUpWith(table.str());
  }
  static constexpr double kPush = 0.8;  // m/s²
};

TEST_F(TangibleFitMissingTest, TheBestCandidateIsFittedBeforeItIsNamed) {
  const ProgramRun run =
      Fit(Problem(), "--missing --out='" + Path("r.json") + "' --report='" + Path("r.html") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.out << run.error;
  const json result = json::parse(Read(Path("r.json")));
  const json& first = result["missing"][0];
  EXPECT_EQ(first["candidate"], "gravity/x") << result["missing"].dump(1);
  EXPECT_TRUE(first["refitted"]);
  EXPECT_TRUE(first["confirmed"]);
  EXPECT_GT(first["cost_share"], 0.1);
  EXPECT_LE(first["cost_share"], 1.0);
  EXPECT_NEAR(first["cost_share"], first["refitted_cost_share"], 1e-3);  // the model is linear
  EXPECT_GT(first["held_out_gain"], 0.1);
  EXPECT_NEAR(first["parameters"][0]["estimate"], kPush, 0.15);
  EXPECT_EQ(first["parameters"][0]["held_at"], 0.0);
  // A constant force is the same as a gravity.
  const std::vector<std::string> equivalent = first["equivalent"];
  EXPECT_NE(std::find(equivalent.begin(), equivalent.end(), "forces/on_ball/force"),
            equivalent.end())
      << first.dump(1);
  EXPECT_NE(run.out.find("'gravity/x' (or "), std::string::npos) << run.out;
  EXPECT_NE(Read(Path("r.html")).find("What would explain the residuals"), std::string::npos);
}

TEST_F(TangibleFitMissingTest, ItIsAskedOnlyWhereThatIsWanted) {
  const std::string out = "--out='" + Path("r.json") + "'";
  ASSERT_EQ(Fit(Problem(), out).exit_status, 0);
  EXPECT_FALSE(json::parse(Read(Path("r.json"))).contains("missing"));
  ASSERT_EQ(Fit(Problem({{"missing", true}}), out).exit_status, 0);
  EXPECT_TRUE(json::parse(Read(Path("r.json"))).contains("missing"));
  ExpectOneLine(Fit(Problem({{"missing", 1}})), 1, "/missing: expected true or false");
  const json noise = {{{"body", "ball"}, {"coordinate", "x"}, {"intensity", 0.1}}};
  ExpectOneLine(Fit(Problem({{"process_noise", noise}, {"missing", true}})), 1,
                "/missing: expected false beside process_noise");
  ExpectOneLine(Fit(Problem({{"process_noise", noise}}), "--missing"), 2, "--missing");
}

}  // namespace
}  // namespace tangible
