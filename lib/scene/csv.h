// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Tables in text files: a header line with the names of the columns, then one row on each line,
// with cells separated by commas. A cell in double quotes may hold commas, and quotes as "" (RFC
// 4180, but for line breaks); spaces around cells, blank lines, carriage returns and a byte-order
// mark (UTF-8) before the header are ignored. A cell that does not begin with a quote has the
// quotes in it as characters. What follows a closing quote, a quote that is not closed and NUL
// bytes are mistakes.

#include <string>
#include <string_view>
#include <vector>

namespace tangible {

struct CsvTable {
  std::string file;  ///< for messages
  std::vector<std::string> columns;
  int header_line = 0;                         ///< in the file, from 1
  std::vector<std::vector<std::string>> rows;  ///< each has as many cells as there are columns
  std::vector<int> lines;                      ///< line of each row in the file, from 1

  /// Index of a column, −1 if there is none.
  int Column(const std::string& name) const;
};

/// Reads a table whose columns are all among `allowed` (empty: any name) and contain all of
/// `required`, each at most once. On failure sets one line "file: line 3: what, expected, got".
bool ReadCsv(const std::string& file, const std::vector<std::string>& required,
             const std::vector<std::string>& allowed, CsvTable* table, std::string* error);

/// The same from text.
bool ParseCsv(const std::string& text, const std::string& file,
              const std::vector<std::string>& required, const std::vector<std::string>& allowed,
              CsvTable* table, std::string* error);

/// The cells of one line.
std::vector<std::string> SplitCsvLine(std::string_view line);

/// A number with the digits, from 15 to 17, that it takes to read the same double.
std::string CsvNumber(double value);

/// A cell as SplitCsvLine reads it: in quotes where it has commas, quotes or line breaks.
std::string CsvCell(const std::string& cell);

/// A finite number that fills the whole text; decimal point whatever the locale.
bool ParseNumber(const std::string& text, double* value);

/// The number in a cell; false and "file: line 3: x: expected a number, got ..." otherwise.
bool ReadCell(const CsvTable& table, int row, int column, double* value, std::string* error);

}  // namespace tangible
