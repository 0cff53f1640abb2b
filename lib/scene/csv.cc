// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/csv.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <system_error>
#include <unordered_set>

#include "tangible/scene/json_reader.h"

namespace tangible {
namespace {

std::string_view Trim(std::string_view text) {
  const char* const blanks = " \t\r";
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return "";
  return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

// The text of a cell that begins with a quote; `line` is left with what follows the closing one.
// False where none closes it.
bool TakeQuoted(std::string_view* line, std::string* text) {
  std::size_t i = 1;
  for (; i < line->size(); ++i) {
    if ((*line)[i] == '"') {
      if (i + 1 == line->size() || (*line)[i + 1] != '"') break;
      ++i;
    }
    *text += (*line)[i];
  }
  const bool closed = i < line->size();
  line->remove_prefix(std::min(i + 1, line->size()));
  return closed;
}

// What is wrong with the quotes of a line, or empty; appends its cells.
std::string SplitLine(std::string_view line, std::vector<std::string>* cells) {
  std::string wrong;
  while (true) {
    std::string quoted;
    const std::size_t first = line.find_first_not_of(" \t");
    const bool quotes = first != std::string_view::npos && line[first] == '"';
    bool closed = true;
    if (quotes) {
      line.remove_prefix(first);
      closed = TakeQuoted(&line, &quoted);
    }
    const std::size_t comma = line.find(',');
    const std::string_view rest = Trim(line.substr(0, comma));
    if (wrong.empty() && !closed) {
      wrong = "expected a closing quote of the cell, got the line's end";
    } else if (wrong.empty() && quotes && !rest.empty()) {
      wrong = "expected a comma or the line's end behind a cell's closing quote, got " +
              Describe(std::string(rest));
    }
    cells->emplace_back(quoted.empty() ? rest : Trim(quoted.append(rest)));
    if (comma == std::string_view::npos) return wrong;
    line.remove_prefix(comma + 1);
  }
}

bool Contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// A name for a message: unchanged if it is plain and not too long, else quoted and cut.
std::string Shown(const std::string& name) {
  constexpr std::size_t kLongest = 200;
  const bool plain =
      std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c < 127; });
  return plain && name.size() <= kLongest ? name : Describe(name);
}

std::string List(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 20;
  std::string list;
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i) {
    if (!list.empty()) list += ", ";
    list += Shown(names[i]);
  }
  return names.size() > kMost ? list + ", ... (" + std::to_string(names.size()) + ")" : list;
}

std::string Place(const std::string& file, int line) {
  return file + ": line " + std::to_string(line) + ": ";
}

// Empty if the header is as expected.
std::string CheckHeader(const std::vector<std::string>& columns,
                        const std::vector<std::string>& required,
                        const std::vector<std::string>& allowed) {
  std::unordered_set<std::string> given;
  for (const std::string& column : columns) {
    if (!allowed.empty() && !Contains(allowed, column)) {
      return "unknown column, expected one of " + List(allowed) + ", got " + Describe(column);
    }
    if (!given.insert(column).second) {
      return "column " + Shown(column) + " given twice, expected once";
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

std::vector<std::string> SplitCsvLine(std::string_view line) {
  std::vector<std::string> cells;
  static_cast<void>(SplitLine(line, &cells));
  return cells;
}

std::string CsvNumber(double value) {
  std::array<char, 32> digits{};
  for (int count = 15;; ++count) {
    const std::to_chars_result end = std::to_chars(digits.data(), digits.data() + digits.size(),
                                                   value, std::chars_format::general, count);
    double read = 0.0;
    std::from_chars(digits.data(), end.ptr, read);
    // 17 digits are enough for any double.
    if (read == value || count == 17) return {digits.data(), end.ptr};
  }
}

std::string CsvCell(const std::string& cell) {
  if (cell.find_first_of(",\"\n") == std::string::npos) return cell;
  std::string quoted = "\"";
  for (const char c : cell) {
    quoted += c;
    if (c == '"') quoted += c;
  }
  return quoted + "\"";
}

bool ParseCsv(const std::string& text_of_file, const std::string& file,
              const std::vector<std::string>& required, const std::vector<std::string>& allowed,
              CsvTable* table, std::string* error) {
  const std::string_view text = WithoutByteOrderMark(text_of_file);
  *table = CsvTable();
  table->file = file;
  const std::string no_text = WhyNotText(text);
  if (!no_text.empty()) {
    *error = OneLine(file + ": " + no_text);
    return false;
  }
  int line_number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = Trim(text.substr(begin, end - begin));
    begin = end + 1;
    ++line_number;
    if (line.empty()) continue;
    std::vector<std::string> cells;
    std::string what = SplitLine(line, &cells);
    if (!what.empty()) {
      // Its cells are not what they seem.
    } else if (table->columns.empty()) {
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
  // from_chars does not accept a leading plus, which some programs write.
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
  *error = OneLine(Place(table.file, table.lines[row]) + Shown(table.columns[column]) +
                   ": expected a number, got " + Describe(cell));
  return false;
}

}  // namespace tangible
