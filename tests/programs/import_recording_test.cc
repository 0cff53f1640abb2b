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
  EXPECT_EQ(
      csv.rfind("time,point,x,y\n0,joint,0,-0.1\n0,tip,0.060000000000000005,-0.1\n0.0025,joint,",
                0),
      0u)
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

TEST_F(ImportRecordingTest, TablesOfOthers) {
  const std::string dlc = Write("d.csv",
                                "scorer,n,n,n\nbodyparts,tip,tip,tip\ncoords,x,y,likelihood\n"
                                "0,10,20,1\n1,11,21,0.1\n2,12,22,1\n");
  const std::string out = " --out=" + Path("o.csv");
  ProgramRun run = Run("tangible-import-recording",
                       dlc + out + " --kind=deeplabcut --frame_rate=2 --likelihood=0.5 --y_down");
  EXPECT_EQ(run.exit_status, 0) << run.error;
  EXPECT_NE(run.out.find("2 rows, 2 coordinates missing"), std::string::npos) << run.out;
  EXPECT_EQ(Read(Path("o.csv")), "time,point,x,y\n0,tip,10,-20\n1,tip,12,-22\n");
  const std::string table = Write("t.csv", "t;a\n0;1\n2;3\n1;5\n");
  const std::string mapping = Write(
      "m.json", R"({"time": "t", "columns": [{"column": "a", "body": "b", "coordinate": "x"}]})");
  const std::string of_table = table + " --kind=table --mapping=" + mapping;
  ExpectOneLine(Run("tangible-import-recording", of_table + out), 1,
                "t.csv: line 4: time: expected one after 2 s, got 1");
  // Nothing has been written over.
  EXPECT_EQ(Read(Path("o.csv")), "time,point,x,y\n0,tip,10,-20\n1,tip,12,-22\n");
  ExpectOneLine(Run("tangible-import-recording", table + " --kind=table" + out), 2, "--mapping");
  ExpectOneLine(Run("tangible-import-recording", dlc + " --kind=deeplabcut" + out), 2,
                "--frame_rate");
  ExpectOneLine(Run("tangible-import-recording", of_table + out + " --scale=0"), 2, "--scale");
  ExpectOneLine(Run("tangible-import-recording", of_table + out + " --rate=100"), 2,
                "--rate: goes with --kind=ibm_double_pendulum, got it with table");
  ExpectOneLine(Run("tangible-import-recording", of_table + out + " --frame_rate=100"), 1,
                "expected a column of times or a frame rate, got both");
  ExpectOneLine(Run("tangible-import-recording", of_table + " --out=" + mapping), 2, "--out");
}

TEST_F(ImportRecordingTest, ShiftsTheTimesOfAClockAndSaysSo) {
  const std::string mapping = Write(
      "m.json", R"({"time": "t", "columns": [{"column": "a", "body": "b", "coordinate": "x"}]})");
  const std::string table = Write("t.csv", "t,a\n1600000000.25,1\n1600000000.26,2\n");
  const std::string run_of =
      table + " --kind=table --mapping=" + mapping + " --out=" + Path("o.csv");
  ProgramRun run = Run("tangible-import-recording", run_of);
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_EQ(run.error, table +
                           ": the first time is 1600000000.25 s, a clock's: times are shifted "
                           "to begin at 0 (--from=0 keeps them)\n");
  EXPECT_NE(run.out.find("times count from 1600000000.25 s of the recording\n"), std::string::npos);
  EXPECT_EQ(Read(Path("o.csv")), "time,body,x\n0,b,1\n0.01,b,2\n");
  run = Run("tangible-import-recording", run_of + " --from=0");
  EXPECT_EQ(run.exit_status, 0);
  EXPECT_EQ(run.error, "");
  EXPECT_EQ(Read(Path("o.csv")), "time,body,x\n1600000000.25,b,1\n1600000000.26,b,2\n");
}

TEST_F(ImportRecordingTest, RefusesNumbersOfFlagsThatAreNone) {
  const std::string table = Write("t.csv", "t,a\n0,1\n1,2\n");
  const std::string mapping = Write(
      "m.json", R"({"time": "t", "columns": [{"column": "a", "body": "b", "coordinate": "x"}]})");
  const std::string out = " --out=" + Path("o.csv");
  const std::string of_table = table + " --kind=table --mapping=" + mapping + out;
  for (const char* from : {"-inf", "inf", "nan"}) {
    ExpectOneLine(Run("tangible-import-recording", of_table + " --from=" + from), 2, "--from");
    ExpectOneLine(Run("tangible-import-recording", table + out + " --from=" + from), 2, "--from");
  }
  EXPECT_EQ(Run("tangible-import-recording", of_table + " --from=0.75").exit_status, 0);
  ExpectOneLine(Run("tangible-import-recording", of_table + " --from=3 --to=2"), 2, "--to");
  ExpectOneLine(Run("tangible-import-recording", of_table + " --scale=inf"), 2, "--scale");
  const std::string dlc =
      Write("d.csv", "scorer,n,n,n\nbodyparts,a,a,a\ncoords,x,y,likelihood\n0,1,2,1\n");
  for (const char* likelihood : {"1.5", "-0.1", "nan"}) {
    ExpectOneLine(
        Run("tangible-import-recording",
            dlc + out + " --kind=deeplabcut --frame_rate=2 " + "--likelihood=" + likelihood),
        2, "--likelihood: expected a number from 0 to 1");
  }
  ExpectOneLine(Run("tangible-import-recording", dlc + out + " --kind=deeplabcut --frame_rate=-2"),
                2, "--frame_rate");
}

}  // namespace
}  // namespace tangible
