// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "run_program.h"

namespace tangible {
namespace {

using TangibleBreakoutTest = ProgramTest;

TEST_F(TangibleBreakoutTest, TheQuickRunWritesAll) {
  const ProgramRun run =
      Run("tangible-breakout", "--quick --out=" + Path("r.json") + " --view=" + Path("v.html") +
                                   " --plot=" + Path("p.svg"));
  EXPECT_EQ(run.exit_status, 0) << run.out << run.error;
  EXPECT_NE(run.out.find("DIAMOND"), std::string::npos) << run.out;
  const auto json = nlohmann::json::parse(Read(Path("r.json")));
  ASSERT_EQ(json["players"].size(), 9U);
  EXPECT_EQ(json["players"][0]["player"], "random");
  EXPECT_LT(json["players"][0]["mean"].get<double>(), 10.0);
  const auto& learned = json["players"][4];
  EXPECT_EQ(learned["random_frames"], 1000);
  EXPECT_GT(learned["mean"].get<double>(), 50.0);
  const auto& curve = learned["games"][0]["curve"];
  EXPECT_LT(curve.back()["errors"]["paddle_way"], curve.front()["errors"]["paddle_way"]);
  EXPECT_GT(curve.back()["paddle"]["gain"], 1.5);
  EXPECT_NE(Read(Path("p.svg")).find("returns expected wrong"), std::string::npos);
  EXPECT_NE(Read(Path("v.html")).find("const frames = ["), std::string::npos);
  // Of games that never came to 400 points nothing is said there.
  const size_t at =
      run.out.find("learned after 200: medians at the game's start, at 400 points (0 of");
  ASSERT_NE(at, std::string::npos) << run.out;
  const std::string frames = run.out.substr(run.out.find("  frames seen", at));
  EXPECT_NE(frames.substr(0, frames.find('\n')).find(" - "), std::string::npos) << run.out;
}

TEST_F(TangibleBreakoutTest, AQuickRunHasAsManyGamesAsAreAskedFor) {
  const std::string small = "--quick --games=1 --random_frames=1000 --sticky=0 --out=";
  const ProgramRun run = Run("tangible-breakout", small + Path("r.json"));
  EXPECT_EQ(run.exit_status, 0) << run.out << run.error;
  EXPECT_EQ(nlohmann::json::parse(Read(Path("r.json")))["games"], 1);
  // Results do not depend on the number of threads.
  for (const std::string threads : {"1", "3"}) {
    EXPECT_EQ(
        Run("tangible-breakout", small + Path("t.json") + " --threads=" + threads).exit_status, 0);
    EXPECT_EQ(Read(Path("t.json")), Read(Path("r.json"))) << threads;
  }
}

TEST_F(TangibleBreakoutTest, WrongFlagsAreOneLine) {
  ExpectOneLine(Run("tangible-breakout", "--games=0"), 2, "--games");
  ExpectOneLine(Run("tangible-breakout", "--seed=-1"), 2, "--seed");
  ExpectOneLine(Run("tangible-breakout", "--threads=-1"), 2, "--threads");
  for (const char* sticky : {"1", "-0.1", "nan"}) {
    ExpectOneLine(Run("tangible-breakout", std::string("--sticky=") + sticky), 2, "--sticky");
  }
  for (const char* frames : {"", "7", "-4", "x", "1e9", "1000,"}) {
    ExpectOneLine(Run("tangible-breakout", std::string("--random_frames=") + frames), 2,
                  "--random_frames");
  }
  ExpectOneLine(Run("tangible-breakout", "scene.json"), 2, "expected 0 argument");
}

}  // namespace
}  // namespace tangible
