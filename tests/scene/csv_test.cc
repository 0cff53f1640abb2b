// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/csv.h"

#include <gtest/gtest.h>

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
  // A quote that is not closed ends with its line.
  EXPECT_FALSE(ParseCsv("a,b\n1,2\n\"3,4\n5,6\n", "t.csv", {}, {}, &table, &error));
  EXPECT_EQ(error, "t.csv: line 3: expected 2 cells, got 1");
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
