// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <system_error>

#include "tangible/scene/json_reader.h"

namespace tangible {
namespace {

std::string Trim(const std::string& text) {
  const char* const blanks = " \t\r";
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

std::vector<std::string> Split(const std::string& line) {
  std::vector<std::string> cells;
  std::size_t begin = 0;
  while (true) {
    const std::size_t comma = line.find(',', begin);
    cells.push_back(Trim(line.substr(begin, comma - begin)));
    if (comma == std::string::npos) return cells;
    begin = comma + 1;
  }
}

bool Contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string List(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) {
    if (!list.empty()) list += ", ";
    list += name;
  }
  return list;
}

std::string Place(const std::string& file, int line) {
  return file + ": line " + std::to_string(line) + ": ";
}

// Empty if the header is as expected.
std::string CheckHeader(const std::vector<std::string>& columns,
                        const std::vector<std::string>& required,
                        const std::vector<std::string>& allowed) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (!allowed.empty() && !Contains(allowed, columns[i])) {
      return "unknown column, expected one of " + List(allowed) + ", got " + Describe(columns[i]);
    }
    if (std::find(columns.begin() + i + 1, columns.end(), columns[i]) != columns.end()) {
      return "column " + columns[i] + " given twice, expected once";
    }
  }
  for (const std::string& name : required) {
    if (!Contains(columns, name)) {
      return "missing column " + name + ", expected " + List(required) + ", got " + List(columns);
    }
  }
  return "";
}

}  // namespace

int CsvTable::Column(const std::string& name) const {
  const auto place = std::find(columns.begin(), columns.end(), name);
  return place == columns.end() ? -1 : static_cast<int>(place - columns.begin());
}

bool ParseCsv(const std::string& text, const std::string& file,
              const std::vector<std::string>& required, const std::vector<std::string>& allowed,
              CsvTable* table, std::string* error) {
  *table = CsvTable();
  table->file = file;
  int line_number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = Trim(text.substr(begin, end - begin));
    begin = end + 1;
    ++line_number;
    if (line.empty()) continue;
    std::vector<std::string> cells = Split(line);
    std::string what;
    if (table->columns.empty()) {
      what = CheckHeader(cells, required, allowed);
      table->columns = std::move(cells);
      table->header_line = line_number;
    } else if (cells.size() != table->columns.size()) {
      what = "expected " + std::to_string(table->columns.size()) + " cells, got " +
             std::to_string(cells.size());
    } else {
      table->rows.push_back(std::move(cells));
      table->lines.push_back(line_number);
    }
    if (!what.empty()) {
      *error = OneLine(Place(file, line_number) + what);
      return false;
    }
  }
  if (!table->columns.empty()) return true;
  *error = OneLine(Place(file, 1) + "missing header, expected " +
                   (required.empty() ? "names of columns" : "columns " + List(required)));
  return false;
}

bool ReadCsv(const std::string& file, const std::vector<std::string>& required,
             const std::vector<std::string>& allowed, CsvTable* table, std::string* error) {
  std::string text;
  return ReadTextFile(file, &text, error) && ParseCsv(text, file, required, allowed, table, error);
}

bool ParseNumber(const std::string& text, double* value) {
  // from_chars takes no leading plus, which some programs write.
  const std::size_t skip = text.size() > 1 && text[0] == '+' && text[1] != '-' ? 1 : 0;
  const char* const end = text.data() + text.size();
  double parsed = 0.0;
  const auto result = std::from_chars(text.data() + skip, end, parsed);
  if (result.ec != std::errc() || result.ptr != end || !std::isfinite(parsed)) return false;
  *value = parsed;
  return true;
}

bool ReadCell(const CsvTable& table, int row, int column, double* value, std::string* error) {
  const std::string& cell = table.rows[row][column];
  if (ParseNumber(cell, value)) return true;
  *error = OneLine(Place(table.file, table.lines[row]) + table.columns[column] +
                   ": expected a number, got " + Describe(cell));
  return false;
}

}  // namespace tangible
