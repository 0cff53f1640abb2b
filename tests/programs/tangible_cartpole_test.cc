// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "run_program.h"

namespace tangible {
namespace {

using TangibleCartpoleTest = ProgramTest;

TEST_F(TangibleCartpoleTest, TheQuickRunHoldsAndWritesAll) {
  const ProgramRun run =
      Run("tangible-cartpole", "--quick --out=" + Path("r.json") + " --view=" + Path("v.html") +
                                   " --reward_plot=" + Path("r.svg") +
                                   " --prediction_plot=" + Path("p.svg"));
  EXPECT_EQ(run.exit_status, 0) << run.out << run.error;
  EXPECT_NE(run.out.find("holds"), std::string::npos) << run.out;
  const auto json = nlohmann::json::parse(Read(Path("r.json")));
  const auto& last = json["curves"][1];
  EXPECT_EQ(last["samples"], 200);
  EXPECT_GT(last["models"][0]["reward"]["median"].get<double>(), 0.7);
  EXPECT_LT(last["models"][1]["reward"]["median"].get<double>(), 0.7);
  EXPECT_EQ(last["runs"].size(), 6U);
  EXPECT_NE(Read(Path("v.html")).find("cart and pole"), std::string::npos);
  EXPECT_NE(Read(Path("r.svg")).find("<svg"), std::string::npos);
  EXPECT_NE(Read(Path("p.svg")).find("engine, 200 samples"), std::string::npos);
  // Results do not depend on the number of threads.
  EXPECT_EQ(Run("tangible-cartpole", "--quick --threads=1 --out=" + Path("one.json")).exit_status,
            0);
  EXPECT_EQ(Read(Path("one.json")), Read(Path("r.json")));
}

TEST_F(TangibleCartpoleTest, WrongFlagsAreOneLine) {
  ExpectOneLine(Run("tangible-cartpole", "--plant=horse"), 2, "--plant");
  ExpectOneLine(Run("tangible-cartpole", "--seeds=0"), 2, "--seeds");
  ExpectOneLine(Run("tangible-cartpole", "--swing_ups=-1"), 2, "--swing_ups");
  for (const char* samples : {"", "10", "50,40", "50,x", "1e9"}) {
    ExpectOneLine(Run("tangible-cartpole", std::string("--samples=") + samples), 2, "--samples");
  }
  ExpectOneLine(Run("tangible-cartpole", "scene.json"), 2, "expected 0 argument");
}

}  // namespace
}  // namespace tangible
