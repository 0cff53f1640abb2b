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
