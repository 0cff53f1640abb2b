// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "run_program.h"

namespace tangible {
namespace {

using nlohmann::json;

class TangibleExtremesTest : public ProgramTest {
 protected:
  ProgramRun Extremes(const std::string& arguments) const {
    return Run("tangible-extremes", arguments);
  }
};

TEST_F(TangibleExtremesTest, PrintsATableAndWritesJsonAndAPage) {
  const ProgramRun run = Extremes("--group=paradox --threads=2 --out='" + Path("r.json") +
                                  "' --report='" + Path("r.html") + "'");
  ASSERT_EQ(run.exit_status, 0) << run.error;
  EXPECT_EQ(run.out.rfind("commit ", 0), 0u) << run.out;
  EXPECT_NE(run.out.find("Painleve, inconsistent, h 1e-6"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find(" 0 fail"), std::string::npos) << run.out;
  const json result = json::parse(Read(Path("r.json")));
  EXPECT_EQ(result["summary"]["fail"], 0);
  EXPECT_GE(result["summary"]["cases"], 20);
  EXPECT_NE(result["provenance"]["cpu"], "");
  for (const json& one : result["cases"]) {
    EXPECT_EQ(one["group"], "paradox");
    EXPECT_FALSE(one["figures"].empty());
    EXPECT_EQ(one["gradient"]["finite"], true) << one["name"];
  }
  EXPECT_NE(Read(Path("r.html")).find("indeterminate: "), std::string::npos);
}

TEST_F(TangibleExtremesTest, CheapGroupsHold) {
  for (const char* group : {"friction", "speed", "geometry"}) {
    const ProgramRun run = Extremes(std::string("--group=") + group);
    EXPECT_EQ(run.exit_status, 0) << run.error << run.out;
  }
}

TEST_F(TangibleExtremesTest, ListsItsCases) {
  const ProgramRun run = Extremes("--list --case='dt 1 s'");
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_EQ(run.out, "scale: dt 1 s, fixed\nscale: dt 1 s, event\n");
}

TEST_F(TangibleExtremesTest, WrongFlagsAreUsage) {
  ExpectOneLine(Extremes("--group=nothing"), 2, "--group");
  ExpectOneLine(Extremes("--case=nothing"), 2, "--case");
  ExpectOneLine(Extremes("--stepping=other"), 2, "--stepping");
  ExpectOneLine(Extremes("--threads=-1"), 2, "--threads");
  ExpectOneLine(Extremes("--threads=257"), 2, "--threads");
  ExpectOneLine(Extremes("scene.json"), 2, "argument");
}

TEST_F(TangibleExtremesTest, WhatCannotBeWrittenIsOneLine) {
  ExpectOneLine(Extremes("--case='dt 1 s' --out=/nonexistent/r.json"), 1, "/nonexistent/r.json");
}

}  // namespace
}  // namespace tangible
