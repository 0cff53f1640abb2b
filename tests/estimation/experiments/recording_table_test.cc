// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/recording_table.h"

#include <gtest/gtest.h>

#include <cmath>

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
            "m.json: /columns/0: expected a body or a point, got both or neither");
  EXPECT_EQ(mapping(R"({"column": "th1", "body": "a", "coordinate": "z"})"),
            "m.json: /columns/0/coordinate: expected x, y, angle, vx, vy, omega or distance, got "
            "\"z\"");
  EXPECT_EQ(mapping(R"({"column": "th1", "body": "a", "coordinate": "angle"},
                       {"column": "th2", "point": "b", "coordinate": "angle"})"),
            "m.json: /columns/1/point: expected all columns to be of bodies, or all of points: an "
            "observation file has one kind");
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
