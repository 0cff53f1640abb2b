// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/csv.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <string>

namespace tangible {
namespace {

std::string CsvError(const std::string& text) {
  CsvTable table;
  std::string error;
  EXPECT_FALSE(ParseCsv(text, "t.csv", {"time", "x"}, {"time", "x", "y"}, &table, &error));
  return error;
}

TEST(CsvTest, ReadsCellsAndTheirLines) {
  CsvTable table;
  std::string error;
  ASSERT_TRUE(ParseCsv("time, x ,y\r\n\r\n0,1,\r\n 0.5 ,-2e3,z", "t.csv", {"time", "x"},
                       {"y", "x", "time"}, &table, &error))
      << error;
  EXPECT_EQ(table.columns, (std::vector<std::string>{"time", "x", "y"}));
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"0", "1", ""}));
  EXPECT_EQ(table.rows[1], (std::vector<std::string>{"0.5", "-2e3", "z"}));
  EXPECT_EQ(table.lines, (std::vector<int>{3, 4}));
  EXPECT_EQ(table.Column("y"), 2);
  EXPECT_EQ(table.Column("angle"), -1);
  double value = 0.0;
  EXPECT_TRUE(ReadCell(table, 1, 1, &value, &error));
  EXPECT_EQ(value, -2000.0);
  EXPECT_FALSE(ReadCell(table, 1, 2, &value, &error));
  EXPECT_EQ(error, "t.csv: line 4: y: expected a number, got \"z\"");
}

TEST(CsvTest, QuotedCellsHoldCommasAndQuotes) {
  CsvTable table;
  std::string error;
  ASSERT_TRUE(ParseCsv("\"time, s\", \"the \"\"tip\"\"\" ,\"\",5\" disc\n\"0\",\"1,5\",,\"\"\"\"\n",
                       "t.csv", {}, {}, &table, &error))
      << error;
  EXPECT_EQ(table.columns, (std::vector<std::string>{"time, s", "the \"tip\"", "", "5\" disc"}));
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"0", "1,5", "", "\""}));
  for (const std::string& cell : table.columns) {
    EXPECT_EQ(SplitCsvLine("a," + CsvCell(cell) + ",b"),
              (std::vector<std::string>{"a", cell, "b"}));
  }
  EXPECT_EQ(CsvCell("a\nb"), "\"a\nb\"");
}

// Cells would be read as other numbers.
TEST(CsvTest, RefusesQuotesThatAreNotClosedOrEndWithinACell) {
  const std::string open = "expected a closing quote of the cell, got the line's end";
  EXPECT_EQ(CsvError("time,x\n1,2\n\"3,4\n5,6\n"), "t.csv: line 3: " + open);
  EXPECT_EQ(CsvError("time,x\n1,\"2\n"), "t.csv: line 2: " + open);
  EXPECT_EQ(CsvError("time,\"x\n"), "t.csv: line 1: " + open);
  const std::string behind = "expected a comma or the line's end behind a cell's closing quote";
  EXPECT_EQ(CsvError("time,x\n0,\"1\"2\n"), "t.csv: line 2: " + behind + ", got \"2\"");
  EXPECT_EQ(CsvError("time,x\n\"7\" \"8\",1\n"),
            "t.csv: line 2: " + behind + ", got \"\\\"8\\\"\"");
  // Behind a cell's first character a quote is a character, which no number has.
  CsvTable table;
  std::string error;
  double value = 0.0;
  ASSERT_TRUE(ParseCsv("x,y\n1\"2,3\n", "t.csv", {}, {}, &table, &error)) << error;
  EXPECT_FALSE(ReadCell(table, 0, 0, &value, &error));
  EXPECT_EQ(error, "t.csv: line 2: x: expected a number, got \"1\\\"2\"");
}

TEST(CsvTest, RefusesWhatIsNoText) {
  EXPECT_EQ(CsvError(std::string("time,x\n0,\0001\n", 12)),
            "t.csv: line 2, column 3: expected text, got a NUL byte");
  EXPECT_NE(CsvError(std::string("t\0i\0", 4)).find("UTF-16"), std::string::npos);
}

TEST(CsvNumberTest, ReadsBackToTheSameDouble) {
  EXPECT_EQ(CsvNumber(0.1), "0.1");
  EXPECT_EQ(CsvNumber(0.1 + 0.2), "0.30000000000000004");
  EXPECT_EQ(CsvNumber(-3.0), "-3");
  EXPECT_EQ(CsvNumber(1714476519.681239), "1714476519.681239");
  EXPECT_EQ(CsvNumber(5e-324), "4.94065645841247e-324");
  std::mt19937_64 random(3);
  for (int k = 0; k < 20000; ++k) {
    const auto bits = random();
    double number = 0.0, read = 0.0;
    std::memcpy(&number, &bits, sizeof number);
    if (!std::isfinite(number)) continue;
    ASSERT_TRUE(ParseNumber(CsvNumber(number), &read)) << CsvNumber(number);
    ASSERT_EQ(read, number) << CsvNumber(number);
  }
}

TEST(CsvTest, TakesAnyColumnsWhereNoneAreNamed) {
  CsvTable table;
  std::string error;
  ASSERT_TRUE(ParseCsv("\n a/b ,c\n1,2\n", "t.csv", {}, {}, &table, &error)) << error;
  EXPECT_EQ(table.columns, (std::vector<std::string>{"a/b", "c"}));
  EXPECT_EQ(table.header_line, 2);
  EXPECT_FALSE(ParseCsv("c,c\n", "t.csv", {}, {}, &table, &error));
  EXPECT_EQ(error, "t.csv: line 1: column c given twice, expected once");
  EXPECT_FALSE(ParseCsv("\n", "t.csv", {}, {}, &table, &error));
  EXPECT_EQ(error, "t.csv: line 1: missing header, expected names of columns");
}

TEST(CsvTest, TakesAByteOrderMarkAsJsonDoes) {
  CsvTable table;
  std::string error;
  ASSERT_TRUE(
      ParseCsv("\xef\xbb\xbftime,x\n1,2\n", "t.csv", {"time", "x"}, {"time", "x"}, &table, &error))
      << error;
  EXPECT_EQ(table.columns[0], "time");
  EXPECT_EQ(table.lines, (std::vector<int>{2}));
  // It stands at the beginning and nowhere else.
  EXPECT_EQ(CsvError("time,\xef\xbb\xbfx\n"),
            "t.csv: line 1: unknown column, expected one of time, x, y, got \"\\ufeffx\"");
}

TEST(CsvTest, MessagesShowNothingThatATerminalWouldObey) {
  for (const std::string& text : {std::string("time,y\x1b[31m\n"),
                                  std::string("time,y\x9b"
                                              "2J\n"),
                                  std::string("time,y,y\xc2\x9b"
                                              "2J,\x07\n"),
                                  std::string("time,x\n0,\x1b]0;owned\x07\n")}) {
    CsvTable table;
    std::string error;
    const std::vector<std::string> any;
    if (ParseCsv(text, "t.csv", {"time", "x"}, any, &table, &error)) {
      double value = 0.0;
      ASSERT_FALSE(ReadCell(table, 0, 1, &value, &error)) << text;
    }
    for (const char c : error) EXPECT_TRUE(c >= ' ' && c < 127) << error;
  }
  // Nor a header without end.
  EXPECT_LT(CsvError(std::string(1000000, 'x')).size(), 300u);
  std::string many = "y";
  for (int i = 0; i < 100000; ++i) many += ",c" + std::to_string(i);
  CsvTable table;
  std::string error;
  EXPECT_FALSE(ParseCsv(many, "t.csv", {"time"}, {}, &table, &error));
  EXPECT_LT(error.size(), 300u);
}

TEST(CsvTest, MessagesNameTheLine) {
  EXPECT_EQ(CsvError(""), "t.csv: line 1: missing header, expected columns time, x");
  EXPECT_EQ(CsvError("time,x,z\n"),
            "t.csv: line 1: unknown column, expected one of time, x, y, got \"z\"");
  EXPECT_EQ(CsvError("time,y\n"), "t.csv: line 1: missing column x, expected time, x, got time, y");
  EXPECT_EQ(CsvError("time,x,x\n"), "t.csv: line 1: column x given twice, expected once");
  EXPECT_EQ(CsvError("time,x\n0,1\n\n1\n"), "t.csv: line 4: expected 2 cells, got 1");
}

TEST(ParseNumberTest, WholeFiniteNumbersOnly) {
  double value = 0.0;
  EXPECT_TRUE(ParseNumber("+1.5e-3", &value));
  EXPECT_EQ(value, 1.5e-3);
  for (const char* text :
       {"", "+", "+-1", "1,5", "1 ", "x", "nan", "inf", "1e999", "0x10", "1.2.3"}) {
    EXPECT_FALSE(ParseNumber(text, &value)) << text;
  }
}

}  // namespace
}  // namespace tangible
