// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/recording_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tangible/scene/csv.h"

namespace tangible {
namespace {

struct Imported {
  bool ok = false;
  std::string error;
  TableRecording recording;
  std::string csv;
};

Imported Import(const std::string& text, const TableOptions& options) {
  Imported imported;
  imported.ok = ParseTableRecording(text, "r.csv", options, &imported.recording, &imported.error);
  if (imported.ok) {
    imported.csv = ObservationCsv(imported.recording);
  }
  return imported;
}

TableOptions Mapped(const std::string& mapping) {
  TableOptions options;
  options.mapping = mapping;
  options.mapping_file = "m.json";
  return options;
}

constexpr char kWide[] = R"({"time": "t [s]", "columns": [
    {"column": "th1", "body": "upper", "coordinate": "angle", "scale": 0.5, "offset": 1},
    {"column": "th2", "body": "lower", "coordinate": "angle", "relative_to": "upper"},
    {"column": "om1", "body": "upper", "coordinate": "omega"}]})";

TEST(RecordingTableTest, WideTablesByAMapping) {
  const std::string text = "t [s],th1,om1,th2,spare\n0,2,3,4,9\n0.5,,6,nan,9\n1,8,9,10,9\n";
  Imported imported = Import(text, Mapped(kWide));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv,
            "time,body,relative_to,angle,omega\n0,upper,,2,3\n0,lower,upper,4,\n0.5,upper,,,6\n"
            "1,upper,,5,9\n1,lower,upper,10,\n");
  EXPECT_EQ(imported.recording.missing, 2);
  TableOptions window = Mapped(kWide);
  window.from = 0.5;
  window.to = 1.0;
  imported = Import(text, window);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(
      imported.csv.rfind("time,body,relative_to,angle,omega\n0,upper,,,6\n0.5,upper,,5,9\n", 0), 0u)
      << imported.csv;
  // Semicolons with decimal commas, quotes and carriage returns.
  imported = Import("\"t [s]\";\"th1\";\"om1\";\"th2\"\r\n0,5;2;3;4,25\r\n", Mapped(kWide));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv,
            "time,body,relative_to,angle,omega\n0.5,upper,,2,3\n0.5,lower,upper,4.25,\n");
}

// Nanoseconds times 1e-9 are a rounding, 2.4e-7 s, later than the same time in seconds.
TEST(RecordingTableTest, TheEndOfAWindowOfAClockBelongsToIt) {
  TableOptions options = Mapped(R"({"time": {"column": "t", "scale": 1e-9}, "columns": [
      {"column": "x", "point": "tip", "coordinate": "x"}]})");
  options.from = 1714476519.5;
  options.to = 1714476519.8;
  const Imported imported = Import("t,x\n1714476519500000000,1\n1714476519800000000,2\n", options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.recording.rows.size(), 2u);
}

TEST(RecordingTableTest, QuotedNamesMayHoldSeparatorsQuotesAndLineBreaks) {
  const TableOptions options = Mapped(R"({"time": "t, s", "columns": [
      {"column": "the \"tip\", x", "point": "tip", "coordinate": "x"},
      {"column": "y of it", "point": "tip", "coordinate": "y"}]})");
  const std::string wanted = "time,point,x,y\n0.5,tip,2.5,-3\n1,tip,4,5\n";
  Imported imported = Import(
      "\"t, s\",\"the \"\"tip\"\", x\",\"y\nof it\"\r\n0.5,\"2.5\",-3\r\n1,4,5\r\n", options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, wanted);
  // Between semicolons commas need no quotes, and are those of decimals in numbers alone.
  imported = Import("t, s;\"the \"\"tip\"\", x\";y of it\n\"0,5\";2,5;-3\n1; 4,0 ;5\n", options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, wanted);
  // Within a cell that does not begin with it a quote is a character.
  imported = Import("t;5\" disc\n0,5;2,5\n", Mapped(R"({"time": "t", "columns": [
      {"column": "5\" disc", "point": "tip", "coordinate": "x"}]})"));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, "time,point,x\n0.5,tip,2.5\n");
  // Also where that cell is the first one, before any separator.
  imported = Import("5\" disc;t\n2,5;0,5\n", Mapped(R"({"time": "t", "columns": [
      {"column": "5\" disc", "point": "tip", "coordinate": "x"}]})"));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, "time,point,x\n0.5,tip,2.5\n");
  // Other lines keep their numbers.
  EXPECT_EQ(Import("\"t, s\",\"the \"\"tip\"\", x\",\"y\nof it\"\n0.5,2.5,z\n", options).error,
            "r.csv: line 3: \"y of it\": expected a number, got \"z\"");
  // What separates cells is what stands outside of quotes.
  imported = Import("t,\"x;\tm\"\n1,2\n", Mapped(R"m({"time": "t", "columns": [
      {"column": "x;\tm", "point": "tip", "coordinate": "x"}]})m"));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, "time,point,x\n1,tip,2\n");
  // A mapping may name a column, or a body in it, with its line breaks.
  imported = Import("t,\"LED\r\nno\",\"x\n(m)\"\n1,\"a\nb\",2\n",
                    Mapped(R"m({"time": "t", "target": "point", "name": "LED\r\nno",
                               "names": {"a\nb": "tip"},
                               "columns": [{"column": "x\n(m)", "coordinate": "x"}]})m"));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, "time,point,x\n1,tip,2\n");
}

TEST(RecordingTableTest, LongTablesByAMapping) {
  TableOptions options = Mapped(R"({"time": {"column": "ms", "scale": 0.001}, "target": "point",
      "name": "marker", "names": {"LED 1": "tip", "LED 2": "joint"},
      "columns": [{"column": "X", "coordinate": "x"}, {"column": "Y", "coordinate": "y"}]})");
  options.scale = 0.01;
  options.y_down = true;
  const Imported imported =
      Import("ms,marker,X,Y\n0,LED 1,1,2\n0,LED 2,3,4\n0,LED 3,5,6\n10,LED 1,7,\n", options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, "time,point,x,y\n0,tip,0.01,-0.02\n0,joint,0.03,-0.04\n0.01,tip,0.07,\n");
}

TEST(RecordingTableTest, DeepLabCutOfOneAnimal) {
  TableOptions options;
  options.format = TableFormat::kDeepLabCut;
  options.frame_rate = 50.0;
  options.likelihood = 0.9;
  options.y_down = true;
  const std::string text =
      "scorer,net,net,net,net,net,net\nbodyparts,tip,tip,tip,left eye,left eye,left eye\n"
      "coords,x,y,likelihood,x,y,likelihood\n0,10,20,0.99,30,40,0.95\n1,11,21,0.5,31,41,0.9\n"
      "3,,,,32,42,1\n";
  const Imported imported = Import(text, options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv,
            "time,point,x,y\n0,tip,10,-20\n0,left_eye,30,-40\n0.02,left_eye,31,-41\n"
            "0.06,left_eye,32,-42\n");
  EXPECT_EQ(imported.recording.missing, 4);
  options.frame_rate = 0.0;
  EXPECT_EQ(Import(text, options).error,
            "r.csv: expected a column of times or a frame rate, got neither");
  TableOptions both = Mapped(kWide);
  both.frame_rate = 50.0;
  EXPECT_EQ(Import("t [s],th1,om1,th2\n0,2,3,4\n", both).error,
            "r.csv: expected a column of times or a frame rate, got both");
}

TEST(RecordingTableTest, DeepLabCutOfSeveralAnimals) {
  TableOptions options;
  options.format = TableFormat::kDeepLabCut;
  options.frame_rate = 10.0;
  const Imported imported = Import(
      "scorer,net,net,net,net\nindividuals,a,a,b,b\nbodyparts,tip,tip,tip,tip\ncoords,x,y,x,y\n"
      "0,1,2,3,4\n1,5,6,7,8\n",
      options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv,
            "time,point,x,y\n0,a.tip,1,2\n0,b.tip,3,4\n0.1,a.tip,5,6\n0.1,b.tip,7,8\n");
}

TEST(RecordingTableTest, TrackerOfOneAndOfSeveralTracks) {
  TableOptions options;
  options.format = TableFormat::kTracker;
  Imported imported =
      Import("mass_A\nt\tx\ty\tr\n0.000E0\t1.5E-1\t-2\t9\n3.2E-2\t\t-2.5\t9\n6.4E-2\t0,25\t-3\t9\n",
             options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv,
            "time,point,x,y\n0,mass_A,0.15,-2\n0.032,mass_A,,-2.5\n0.064,mass_A,0.25,-3\n");
  imported = Import(
      "#multi:\n\tcm A\t\tcm B\t\t\nt\tx\tv_{y}\tx\tvy\t\n0.032\t30.5\t23\t-26.5\t22\t\n"
      "0.064\t31\t24\t-27\t\t\n",
      options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv,
            "time,point,x,vy\n0.032,cm_A,30.5,23\n0.032,cm_B,-26.5,22\n0.064,cm_A,31,24\n"
            "0.064,cm_B,-27,\n");
}

TEST(RecordingTableTest, NoiseIsThatOfFourthDifferences) {
  std::string text = "t [s],th1,om1,th2\n";
  for (int k = 0; k < 400; ++k) {
    text += std::to_string(0.01 * k) + "," + std::to_string(std::sin(0.01 * k)) + "," +
            (k % 2 == 0 ? "1" : "-1") + ",0\n";
  }
  const Imported imported = Import(text, Mapped(kWide));
  ASSERT_TRUE(imported.ok) << imported.error;
  ASSERT_EQ(imported.recording.noise.size(), 3u);
  EXPECT_EQ(imported.recording.noise[2].coordinate, Coordinate::kOmega);
  // ±1: each fourth difference is 16.
  EXPECT_NEAR(imported.recording.noise[2].value, 16.0 / std::sqrt(70.0), 1e-12);
}

constexpr char kOne[] = R"({"time": "t", "columns": [
    {"column": "x", "body": "b", "coordinate": "x"}]})";

// A double has 2.4e-7 s at these times, and the cells say more.
TEST(RecordingTableTest, TimesOfAClockCountFromTheFirst) {
  const std::string cells = "t,x\n1714476519.6812390123,1\n1714476519.6861827,2\n1714476520,3\n";
  Imported imported = Import(cells, Mapped(kOne));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.recording.start, 1714476519.6812390123);
  ASSERT_EQ(imported.recording.rows.size(), 3u);
  // One rounding to a double at the end, and two to a long double of less than 1.
  const double rounding = 1e-17;
  EXPECT_EQ(imported.recording.rows[0].time, 0.0);
  EXPECT_NEAR(imported.recording.rows[1].time, 0.0049436877, rounding);
  EXPECT_NEAR(imported.recording.rows[2].time, 0.3187609877, 1e-16);
  // From a given time on, which a double does not have either.
  TableOptions from = Mapped(kOne);
  from.from = 1714476519.6;
  imported = Import(cells, from);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.recording.start, 0.0);
  EXPECT_NEAR(imported.recording.rows[1].time, 0.0861827, 1e-16);
  // Kept where they are asked for, with all digits of a double.
  from.from = 0.0;
  imported = Import(cells, from);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv,
            "time,body,x\n1714476519.6812391,b,1\n1714476519.6861827,b,2\n1714476520,b,3\n");
  // An offset does the same, and times of a run stay as they are.
  imported = Import("t,x\n1e9,0\n", Mapped(kOne));
  EXPECT_EQ(imported.recording.start, 1e9);
  imported = Import(cells, Mapped(R"({"time": {"column": "t", "offset": -1714476519.5},
      "columns": [{"column": "x", "body": "b", "coordinate": "x"}]})"));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.recording.start, 0.0);
  EXPECT_NEAR(imported.recording.rows[1].time, 0.1861827, 1e-16);
  imported = Import("t,x\n5.25,0\n", Mapped(kOne));
  EXPECT_EQ(imported.csv, "time,body,x\n5.25,b,0\n");
}

// Whole numbers of nanoseconds, of which a double has every 256th; and several bodies in turn, the
// earliest last.
TEST(RecordingTableTest, ClocksInNanosecondsAndOfSeveralBodies) {
  const Imported imported = Import(
      "ns,who,x\n1714476519681239100,a,1\n1714476519681239101,a,2\n1714476519681239000,b,3\n",
      Mapped(R"({"time": {"column": "ns", "scale": 1e-9}, "target": "body", "name": "who",
                 "columns": [{"column": "x", "coordinate": "x"}]})"));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, "time,body,x\n1e-07,a,1\n1.01e-07,a,2\n0,b,3\n");
  TableOptions kept = Mapped(R"({"time": {"column": "ns", "scale": 1e-9}, "columns": [
      {"column": "x", "body": "b", "coordinate": "x"}]})");
  kept.from = 0.0;
  const std::string error =
      Import("ns,x\n1714476519681239000,1\n1714476519681239001,2\n", kept).error;
  EXPECT_EQ(
      error.rfind("r.csv: line 3: time: expected one that differs from the last as a double", 0),
      0u)
      << error;
}

// A clock in ms, us or ns begins at 0 where it is told to.
TEST(RecordingTableTest, AGivenStartOfAClockInPartsOfASecondIsZero) {
  struct Clock {
    const char* scale;
    const char* cells;
    double from;
  };
  for (const Clock& clock :
       {Clock{"0.001", "1600000000100,1\n1600000000200,2\n1600000000300,3\n", 1600000000.2},
        Clock{"0.001", "1714476519591,0\n1714476519691,1\n1714476519791,2\n", 1714476519.691},
        Clock{"1e-9", "1714476519581000000,0\n1714476519681000000,1\n1714476519781000000,2\n",
              1714476519.681},
        Clock{"1e-6", "400000,0\n500000,1\n600000,2\n", 0.5}}) {
    const std::string time = std::string(R"("time": {"column": "t", "scale": )") + clock.scale;
    const std::string columns = R"("columns": [{"column": "x", "body": "b", "coordinate": "x"}]})";
    TableOptions options = Mapped("{" + time + "}, " + columns);
    options.from = clock.from;
    const Imported from = Import(std::string("t,x\n") + clock.cells, options);
    ASSERT_TRUE(from.ok) << from.error;
    ASSERT_EQ(from.recording.rows.size(), 2u) << clock.scale;
    EXPECT_EQ(from.recording.rows[0].time, 0.0) << clock.scale;
    EXPECT_EQ(from.recording.rows[1].time, 0.1) << clock.scale;
    // So does an offset.
    const Imported shifted =
        Import(std::string("t,x\n") + clock.cells,
               Mapped("{" + time + R"(, "offset": -)" + CsvNumber(clock.from) + "}, " + columns));
    ASSERT_TRUE(shifted.ok) << shifted.error;
    ASSERT_EQ(shifted.recording.rows.size(), 2u) << clock.scale;
    EXPECT_EQ(shifted.recording.rows[0].time, 0.0) << clock.scale;
  }
}

TEST(RecordingTableTest, RowsBeforeZeroAreCounted) {
  const std::string cells = "t,x\n-0.2,1\n-0.1,2\n0,3\n0.1,4\n";
  EXPECT_EQ(Import(cells, Mapped(kOne)).recording.before_zero, 2);
  TableOptions all = Mapped(kOne);
  all.from = -0.2;
  const Imported imported = Import(cells, all);
  EXPECT_EQ(imported.recording.before_zero, 0);
  EXPECT_EQ(imported.recording.rows.size(), 4u);
}

// All that is written reads back to the doubles that were read.
TEST(RecordingTableTest, WritesAllDigits) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::string text = "t,x\n";
  std::vector<double> times, values;
  for (int k = 0; k < 200; ++k) {
    times.push_back(10.0 * k + uniform(random));
    values.push_back(std::ldexp(uniform(random), k - 100));
    text += CsvNumber(times.back() + 1.0) + "," + CsvNumber(values.back()) + "\n";
    times.back() += 1.0;
  }
  const Imported imported = Import(text, Mapped(kOne));
  ASSERT_TRUE(imported.ok) << imported.error;
  CsvTable table;
  std::string error;
  ASSERT_TRUE(ParseCsv(imported.csv, "o.csv", {}, {}, &table, &error)) << error;
  ASSERT_EQ(table.rows.size(), times.size());
  for (int k = 0; k < 200; ++k) {
    double time = 0.0, value = 0.0;
    ASSERT_TRUE(ReadCell(table, k, 0, &time, &error) && ReadCell(table, k, 2, &value, &error));
    EXPECT_EQ(time, times[k]);
    EXPECT_EQ(value, values[k]);
  }
}

TEST(RecordingTableTest, RefusesNumbersThatOverflowAndUnlikelyLikelihoods) {
  const auto scaled = [](const std::string& rest, double scale = 1.0) {
    TableOptions options = Mapped(R"({"time": "t", "columns": [
        {"column": "x", "body": "b", "coordinate": "x")" +
                                  rest + "}]}");
    options.scale = scale;
    return Import("t,x\n0,2\n1,-1e300\n", options);
  };
  const std::string error =
      "r.csv: line 3: x: expected a finite number after its scale and offset, got -1e+300 with a "
      "scale that is too large";
  EXPECT_EQ(scaled(R"(, "scale": 1e10)").error, error);
  EXPECT_EQ(scaled("", 1e9).error, error);
  EXPECT_TRUE(scaled(R"(, "scale": 1e7)").ok);
  EXPECT_EQ(Import("t,x\n0,2\n1e20,1\n", Mapped(R"({"time": {"column": "t", "scale": 1e300},
      "columns": [{"column": "x", "body": "b", "coordinate": "x"}]})"))
                .error,
            "r.csv: line 3: time: expected a finite number of seconds, got 1e+20 with a scale that "
            "is too large");
  TableOptions dlc;
  dlc.format = TableFormat::kDeepLabCut;
  dlc.frame_rate = 10.0;
  const std::string header = "scorer,n,n,n\nbodyparts,a,a,a\ncoords,x,y,likelihood\n";
  for (const char* likelihood : {"1.0000001", "-0.25", "37"}) {
    EXPECT_EQ(
        Import(header + "0,1,2,1\n1,1,2," + likelihood + "\n", dlc).error,
        "r.csv: line 5: likelihood: expected a number from 0 to 1, got " + std::string(likelihood));
  }
  EXPECT_TRUE(Import(header + "0,1,2,1\n1,1,2,0\n2,1,2,\n", dlc).ok);
  // Rows below headers without names have their own lines.
  EXPECT_EQ(Import(header + "0,1,2,1\n1,2,3\n", dlc).error,
            "r.csv: line 5: expected 4 cells, got 3");
}

TEST(RecordingTableTest, RefusesQuotesInsideCellsAndWhatIsNoText) {
  const auto error = [](const std::string& text) { return Import(text, Mapped(kOne)).error; };
  EXPECT_EQ(error("t,x\n0,1\"2\n"), "r.csv: line 2: x: expected a number, got \"1\\\"2\"");
  EXPECT_EQ(error("t;x\n0;3\"4,5\n"), "r.csv: line 2: x: expected a number, got \"3\\\"4,5\"");
  const std::string behind = ": expected the cell's end behind its closing quote, got more";
  for (const char* const cell : {"\"1\"2", "\"1\" \"2\"", "\"1\"2\"", " \"1\" 2"}) {
    EXPECT_EQ(error(std::string("t,x\n0,1\n1,") + cell + "\n2,3\n"), "r.csv: line 3" + behind)
        << cell;
    EXPECT_EQ(error(std::string("t;x\n0;1\n1;") + cell + ",5\n2;3\n"), "r.csv: line 3" + behind)
        << cell;
  }
  TableOptions tracker;
  tracker.format = TableFormat::kTracker;
  EXPECT_EQ(Import("a\nt,x\n0,\"1\"2\n", tracker).error, "r.csv: line 3" + behind);
  EXPECT_EQ(error(std::string("t,x\n0,1\0\n", 9)),
            "r.csv: line 2, column 4: expected text, got a NUL byte");
  EXPECT_NE(error(std::string("\xff\xfet\0,\0x\0\n\0", 10)).find("UTF-16"), std::string::npos);
  EXPECT_TRUE(Import("\xef\xbb\xbft,x\n0,1\n", Mapped(kOne)).ok);
}

// A load cell under a pivot, in kg, and one under a table.
TEST(RecordingTableTest, ForcesOfJointsAndContacts) {
  TableOptions options = Mapped(R"({"time": "t", "columns": [
      {"column": "h", "joint": "pivot", "coordinate": "fx", "scale": 10},
      {"column": "v", "joint": "pivot", "coordinate": "fy", "scale": 10},
      {"column": "m", "joint": "pivot", "coordinate": "torque"}]})");
  options.scale = 1000.0;  // of lengths
  options.y_down = true;
  Imported imported = Import("t,h,v,m\n0,1,2,3\n1,4,,6\n", options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, "time,joint,fx,fy,torque\n0,pivot,10,-20,-3\n1,pivot,40,,-6\n");
  const char long_rows[] = R"({"time": "t", "target": "contact", "name": "cell",
      "names": {"A 1": "box:floor"}, "columns": [{"column": "n", "coordinate": "normal"},
                                                 {"column": "s", "coordinate": "tangent"}]})";
  imported = Import("t,cell,n,s\n0,A 1,5,-1\n0,B,6,-2\n", Mapped(long_rows));
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, "time,contact,normal,tangent\n0,box:floor,5,-1\n");
  const auto error = [](const std::string& column) {
    return Import("t,n\n0,1\n",
                  Mapped(R"({"time": "t", "columns": [{"column": "n", )" + column + "}]}"))
        .error;
  };
  EXPECT_EQ(error(R"("joint": "pivot", "coordinate": "normal")"),
            "m.json: /columns/0/coordinate: expected fx, fy or torque, got \"normal\"");
  EXPECT_EQ(error(R"("contact": "box", "coordinate": "normal")"),
            "m.json: /columns/0/contact: expected the names of two bodies as \"a:b\", got \"box\"");
  EXPECT_EQ(error(R"("contact": "a:b", "coordinate": "normal", "relative_to": "c")"),
            "m.json: /columns/0/relative_to: goes not with forces");
  EXPECT_EQ(error(R"("body": "a", "coordinate": "fx")"),
            "m.json: /columns/0/coordinate: expected x, y, angle, vx, vy, omega, distance, ax, ay "
            "or alpha, got \"fx\"");
}

TEST(RecordingTableTest, TimesOfEvents) {
  // Sounds of bounces, in ms.
  TableOptions options = Mapped(R"({"time": {"column": "ms", "scale": 0.001}, "event": "bounce"})");
  Imported imported = Import("ms,loudness\n250,9\n750,8\n1125,7\n", options);
  ASSERT_TRUE(imported.ok) << imported.error;
  EXPECT_EQ(imported.csv, "time,event,number\n0.25,bounce,1\n0.75,bounce,2\n1.125,bounce,3\n");
  // The run begins where the part does.
  options.from = 0.5;
  EXPECT_EQ(Import("ms,loudness\n250,9\n750,8\n1125,7\n", options).csv,
            "time,event,number\n0.25,bounce,1\n0.625,bounce,2\n");
  const TableOptions several = Mapped(
      R"({"time": "t", "target": "event", "name": "what",
          "names": {"up": "lift", "down": "land"}})");
  EXPECT_EQ(Import("t,what\n0.5,up\n0.5,down\n1,other\n1.5,up\n", several).csv,
            "time,event,number\n0.5,lift,1\n0.5,land,1\n1.5,lift,2\n");
  const TableOptions numbered = Mapped(R"({"time": "t", "event": "touch", "number": "n"})");
  EXPECT_EQ(Import("t,n\n0.5,2\n1,5\n", numbered).csv,
            "time,event,number\n0.5,touch,2\n1,touch,5\n");
  EXPECT_EQ(Import("t,n\n0.5,2\n1,2\n", numbered).error,
            "r.csv: line 3: number: expected an integer of at least 3, got 2");
  EXPECT_EQ(Import("t,n\n0.5,1.5\n", numbered).error,
            "r.csv: line 2: number: expected an integer of at least 1, got 1.5");
  EXPECT_EQ(Import("t,n\n1,1\n0.5,2\n", numbered).error,
            "r.csv: line 3: time: expected one after 1 s, got 0.5: the clock stands still or runs "
            "backwards");
  const auto error = [](const std::string& rest) {
    return Import("t,n\n0,1\n", Mapped(R"({"time": "t", )" + rest + "}")).error;
  };
  EXPECT_EQ(error(R"("event": "touch", "columns": [])"),
            "m.json: /columns: goes not with events, whose times are those of the rows");
  EXPECT_EQ(error(R"("event": "touch", "target": "event", "name": "n")"),
            "m.json: /event: goes not with name, which says what a row is");
  EXPECT_EQ(error(R"("number": "n", "columns": [])"), "m.json: /number: goes with events");
  EXPECT_EQ(Import("t,n\n0,1\n", Mapped(R"({"event": "touch"})")).error,
            "m.json: expected time, the column of the events' times, got none");
}

TEST(RecordingTableTest, MistakesAreOneLine) {
  const std::string good = "t [s],th1,om1,th2\n0,2,3,4\n0.5,5,6,7\n";
  EXPECT_EQ(Import("t [s],th1,om1,th2\n0,2,3,4\n0.5,2,3,4\n0.25,2,3,4\n", Mapped(kWide)).error,
            "r.csv: line 4: time: expected one after 0.5 s, got 0.25: the clock stands still or "
            "runs backwards");
  EXPECT_EQ(Import("t [s],th1,om1,th2\n0,2,3,4\n0,2,3,4\n", Mapped(kWide)).error,
            "r.csv: line 3: time: expected one after 0 s, got 0: the clock stands still or runs "
            "backwards");
  EXPECT_EQ(Import("t [s],th1,om1,th2\n0,2,3,4\n0.5,\"5,3,4\n1,2,3,4\n", Mapped(kWide)).error,
            "r.csv: line 3: expected a closing quote of the cell, got the end of the file");
  EXPECT_EQ(Import("t,th1,om1,th2\n0,2,3,4\n", Mapped(kWide)).error,
            "m.json: /time: expected the name of a column of r.csv (t, th1, om1, th2), got \"t "
            "[s]\"");
  const auto mapping = [&](const std::string& columns, const std::string& rest = "") {
    return Import(good, Mapped(R"({"time": "t [s]", "columns": [)" + columns + "]" + rest + "}"))
        .error;
  };
  EXPECT_EQ(mapping(R"({"column": "th1", "body": "a", "coordinate": "angle", "scale": 0})"),
            "m.json: /columns/0/scale: expected a number other than 0, got 0");
  EXPECT_EQ(mapping(R"({"column": "th1", "coordinate": "angle"})"),
            "m.json: /columns/0: expected one of body, point, joint and contact, got none");
  EXPECT_EQ(mapping(R"({"column": "th1", "body": "a", "coordinate": "z"})"),
            "m.json: /columns/0/coordinate: expected x, y, angle, vx, vy, omega, distance, ax, ay "
            "or alpha, got "
            "\"z\"");
  EXPECT_EQ(
      mapping(R"({"column": "th1", "body": "a", "coordinate": "angle"},
                       {"column": "th2", "point": "b", "coordinate": "angle"})"),
      "m.json: /columns/1/point: expected all columns to be of bodies, or all of points, joints "
      "or contacts: an observation file has one kind");
  EXPECT_EQ(mapping(R"({"column": "th1", "body": "a", "coordinate": "angle"},
                       {"column": "th2", "body": "a", "coordinate": "angle"})"),
            "r.csv: line 2: expected angle of a once, got it twice");
  EXPECT_EQ(mapping(""), "m.json: /columns: expected at least one column, got none");
  EXPECT_EQ(mapping("", R"(, "name": "th1", "target": "body", "names": ["a"])"),
            "m.json: /names: expected an object of names, got an array of 1");
  EXPECT_NE(mapping(R"({"column": "th1", "body": "a", "coordinate": "angle"})", R"(, "step": 1)")
                .find("m.json: /step: unknown key of a mapping"),
            std::string::npos);
  TableOptions window = Mapped(kWide);
  window.from = 7.0;
  EXPECT_EQ(Import(good, window).error,
            "r.csv: expected at least one measured coordinate from 7 to inf s, got none");
  TableOptions other;
  other.format = TableFormat::kDeepLabCut;
  other.frame_rate = 1.0;
  EXPECT_NE(Import(good, other).error.find("r.csv: header: expected rows that begin with scorer"),
            std::string::npos);
  EXPECT_NE(Import("scorer,n\nbodyparts,\ncoords,x\n0,1\n", other)
                .error.find("line 2, column 2: expected the name of a point"),
            std::string::npos);
  EXPECT_NE(Import("scorer,n\nbodyparts,a\ncoords,z\n0,1\n", other).error.find("got \"z\""),
            std::string::npos);
  other.format = TableFormat::kTracker;
  EXPECT_NE(Import(good, other).error.find("as Tracker exports them"), std::string::npos);
  for (const TableFormat format :
       {TableFormat::kTable, TableFormat::kDeepLabCut, TableFormat::kTracker}) {
    for (const char* text : {"", "\n", ",\n,\n,\n", "scorer\nbodyparts\ncoords\n", "#multi:\n"}) {
      TableOptions options = Mapped(kWide);
      options.format = format;
      options.frame_rate = format == TableFormat::kDeepLabCut ? 1.0 : 0.0;
      const Imported imported = Import(text, options);
      EXPECT_FALSE(imported.ok) << text;
      EXPECT_NE(imported.error, "");
      EXPECT_EQ(imported.error.find('\n'), std::string::npos) << imported.error;
    }
  }
}

}  // namespace
}  // namespace tangible
