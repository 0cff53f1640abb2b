// SPDX-License-Identifier: Apache-2.0
#include "run_program.h"

namespace tangible {
namespace {

using TangibleVisionTest = ProgramTest;

TEST_F(TangibleVisionTest, TheQuickTrainingHolds) {
  const ProgramRun run = Run("tangible-vision", "--quick");
  EXPECT_EQ(run.exit_status, 0) << run.out << run.error;
  EXPECT_NE(run.out.find("holds   gradient"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("holds   loss"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("holds   a resumed training"), std::string::npos) << run.out;
  EXPECT_EQ(run.out.find("FAILS"), std::string::npos) << run.out;
}

TEST_F(TangibleVisionTest, DataAreMadeFromASeedAndChecked) {
  const std::string make = "--make=simb --sequences=3 --frames=8 --seed=4 --out=";
  EXPECT_EQ(Run("tangible-vision", make + Path("a.bin")).exit_status, 0);
  EXPECT_EQ(Run("tangible-vision", make + Path("b.bin")).exit_status, 0);
  EXPECT_EQ(Read(Path("a.bin")), Read(Path("b.bin")));
  const ProgramRun good = Run("tangible-vision", "--check=" + Path("a.bin"));
  EXPECT_EQ(good.exit_status, 0) << good.error;
  EXPECT_NE(good.out.find("simb, seed 4, 3 sequences of 8 frames, 3 discs"), std::string::npos);
  std::string bytes = Read(Path("a.bin"));
  bytes[bytes.size() - 30] ^= 4;
  ExpectOneLine(Run("tangible-vision", "--check=" + Write("c.bin", bytes)), 1, "damaged");
  ExpectOneLine(Run("tangible-vision", "--check=" + Path("none.bin")), 1, "none.bin");
}

TEST_F(TangibleVisionTest, WrongFlagsAreOneLine) {
  ExpectOneLine(Run("tangible-vision", ""), 2, "expected one of");
  ExpectOneLine(Run("tangible-vision", "--quick --all"), 2, "expected one of");
  ExpectOneLine(Run("tangible-vision", "--cells=nothing"), 2, "--cells");
  ExpectOneLine(Run("tangible-vision", "--make=cats --out=" + Path("d")), 2, "--make");
  ExpectOneLine(Run("tangible-vision", "--make=simb"), 2, "--out");
  ExpectOneLine(Run("tangible-vision", "--make=simb --frames=0 --out=" + Path("d")), 2, "--frames");
  ExpectOneLine(Run("tangible-vision", "--list --jobs=0"), 2, "--jobs");
  // A folder that is a file, and a result of something else.
  ExpectOneLine(Run("tangible-vision", "--cells=parameters_0 --folder=" + Write("file", "")), 1,
                "expected a folder");
  Write("parameters_0.json", "{}");
  ExpectOneLine(Run("tangible-vision", "--cells=parameters_0 --folder=" + Path("")), 1,
                "remove it");
}

}  // namespace
}  // namespace tangible
