// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>

#include <filesystem>
#include <utility>

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
  // Its kind and its seed are part of what is checked.
  for (const auto& [from, to] : {std::pair("\"seed\":4", "\"seed\":5"),
                                 std::pair("\"kind\":\"simb\"", "\"kind\":\"billiards\"")}) {
    std::string other = Read(Path("a.bin"));
    other.replace(other.find(from), std::string(from).size(), to);
    ExpectOneLine(Run("tangible-vision", "--check=" + Write("d.bin", other)), 1, "damaged");
  }
  ASSERT_EQ(::mkfifo(Path("pipe").c_str(), 0600), 0);
  ExpectOneLine(Run("tangible-vision", "--check=" + Path("pipe")), 1, "got a pipe");
  ExpectOneLine(Run("tangible-vision", "--check=/dev/zero"), 1, "got a device");
  ExpectOneLine(Run("tangible-vision", "--check=" + Path("")), 1, "directory");
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
  const std::string cell = "--cells=parameters_0 --folder=" + Path("");
  ExpectOneLine(Run("tangible-vision", cell), 1, "remove it");
  std::filesystem::remove(Path("parameters_0.json"));
  ASSERT_EQ(::mkfifo(Path("parameters_0.json").c_str(), 0600), 0);
  ExpectOneLine(Run("tangible-vision", cell), 1, "parameters_0.json");
  std::filesystem::remove(Path("parameters_0.json"));
  // What is no checkpoint is no reason to begin again.
  for (const char* bytes : {"", "{}", "tangible training 2\nbilliards\n5 7\nx"}) {
    Write("parameters_0.checkpoint", bytes);
    ExpectOneLine(Run("tangible-vision", cell), 1, "parameters_0.checkpoint");
  }
  std::filesystem::remove(Path("parameters_0.checkpoint"));
  ASSERT_EQ(::mkfifo(Path("parameters_0.checkpoint").c_str(), 0600), 0);
  ExpectOneLine(Run("tangible-vision", cell), 1, "got a pipe");
}

}  // namespace
}  // namespace tangible
