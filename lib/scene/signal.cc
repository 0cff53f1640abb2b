// SPDX-License-Identifier: Apache-2.0
#include "tangible/scene/signal.h"

#include <cstddef>

#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"

namespace tangible {
namespace {

bool ReadColumn(const CsvTable& table, const std::string& name, std::vector<double>* values,
                std::string* error) {
  const int column = table.Column(name);
  values->assign(table.rows.size(), 0.0);
  if (column < 0) return true;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    if (!ReadCell(table, static_cast<int>(i), column, &(*values)[i], error)) return false;
  }
  return true;
}

bool CheckIncreasing(const CsvTable& table, const std::vector<double>& time, std::string* error) {
  for (std::size_t i = 1; i < time.size(); ++i) {
    if (time[i] > time[i - 1]) continue;
    *error = OneLine(table.file + ": line " + std::to_string(table.lines[i]) +
                     ": time: expected a number > " + Json(time[i - 1]).dump() +
                     " (the time before), got " + Json(time[i]).dump());
    return false;
  }
  return true;
}

}  // namespace

bool ReadSignal(const std::string& file, SignalColumns columns, Signal* signal,
                std::string* error) {
  const bool force = columns == SignalColumns::kForce;
  std::vector<std::string> required = {"time"};
  if (!force) required.emplace_back("value");
  CsvTable table;
  if (!ReadCsv(file, required, {"time", "x", "y", "value"}, &table, error)) return false;
  if (force && table.Column("x") < 0 && table.Column("y") < 0) {
    *error = OneLine(file + ": line 1: missing columns, expected x or y beside time");
    return false;
  }
  if (table.rows.empty()) {
    *error = OneLine(file + ": line 2: expected at least one row, got none");
    return false;
  }
  if (!ReadColumn(table, "time", &signal->time, error)) return false;
  if (!CheckIncreasing(table, signal->time, error)) return false;
  if (!force) return ReadColumn(table, "value", &signal->value, error);
  return ReadColumn(table, "x", &signal->x, error) && ReadColumn(table, "y", &signal->y, error);
}

}  // namespace tangible
