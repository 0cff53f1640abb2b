// SPDX-License-Identifier: Apache-2.0
#include "run_program.h"

namespace tangible {
namespace {

using ImportRecordingTest = ProgramTest;

std::string Markers() {
  std::string text;
  for (int k = 0; k < 10; ++k) {
    text += "1000,2000,1500,2000,1500,2300\n";
  }
  return text;
}

TEST_F(ImportRecordingTest, WritesObservationsAndTheNoise) {
  const std::string file = Write("m.csv", Markers());
  const ProgramRun run =
      Run("tangible-import-recording", file + " --length=0.1 --to=0.01 --out=" + Path("o.csv"));
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.out.find("5 frames over 0.01 s"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("1 mm a pixel, length ratio 1.6667"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("noise of tip y: 0.0000 mm"), std::string::npos) << run.out;
  const std::string csv = Read(Path("o.csv"));
  EXPECT_EQ(csv.rfind("time,point,x,y\n0,joint,0,-0.1\n0,tip,0.06,-0.1\n0.0025,joint,", 0), 0u)
      << csv;
}

TEST_F(ImportRecordingTest, RefusesWhatItCannotDo) {
  const std::string file = Write("m.csv", Markers());
  const std::string out = " --out=" + Path("o.csv");
  ExpectOneLine(Run("tangible-import-recording", file), 2, "--out");
  ExpectOneLine(Run("tangible-import-recording", file + " --kind=other" + out), 2, "--kind");
  ExpectOneLine(Run("tangible-import-recording", file + " --from=1 --to=0" + out), 2, "--from");
  ExpectOneLine(Run("tangible-import-recording", file + " --from=1 --to=2" + out), 1,
                "at least 5 rows");
  ExpectOneLine(Run("tangible-import-recording", Path("none.csv") + out), 1, "none.csv");
  ExpectOneLine(Run("tangible-import-recording", file + " --out=" + Path("none/o.csv")), 1,
                "none/o.csv");
}

}  // namespace
}  // namespace tangible
