// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "tangible/estimation/experiments/tolerances.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

constexpr double kFifthsOfPixel = 0.2;
const std::vector<std::string> kMarkerColumns = {"pivot down",  "pivot right", "joint down",
                                                 "joint right", "tip down",    "tip right"};

using MarkerRow = std::array<double, 6>;

bool ReadMarkers(const std::string& text, const std::string& file, const RecordingOptions& options,
                 std::vector<MarkerRow>* rows, Recording* recording, std::string* error) {
  std::string header;
  for (const std::string& column : kMarkerColumns) {
    header += (header.empty() ? "" : ",") + column;
  }
  CsvTable table;
  const std::string rows_of_file(WithoutByteOrderMark(text));
  if (!ParseCsv(header + "\n" + rows_of_file, file, kMarkerColumns, kMarkerColumns, &table,
                error)) {
    return false;
  }
  for (int& line : table.lines) {
    --line;  // the header is not in the file
  }
  for (int i = 0; i < static_cast<int>(table.rows.size()); ++i) {
    const double time = i / options.rate;
    if (time < options.from - kWindowRounding || time > options.to + kWindowRounding) {
      continue;
    }
    MarkerRow row;
    for (int c = 0; c < 6; ++c) {
      if (!ReadCell(table, i, c, &row[c], error)) {
        return false;
      }
    }
    rows->push_back(row);
    recording->times.push_back(time - options.from);
  }
  return true;
}

double MeanLength(const std::vector<MarkerRow>& rows, int from, int to) {
  double sum = 0.0;
  for (const MarkerRow& row : rows) {
    sum += std::hypot(row[to] - row[from], row[to + 1] - row[from + 1]);
  }
  return sum / static_cast<double>(rows.size());
}

bool ParseMarkers(const std::string& text, const std::string& file, const RecordingOptions& options,
                  Recording* recording, std::string* error) {
  std::vector<MarkerRow> rows;
  if (!ReadMarkers(text, file, options, &rows, recording, error)) {
    return false;
  }
  if (rows.empty()) {
    return true;
  }
  const double first = MeanLength(rows, 0, 2);
  const double second = MeanLength(rows, 2, 4);
  if (!(first > 0.0) || !(second > 0.0)) {
    *error = file + ": expected markers apart from each other, got a distance of 0";
    return false;
  }
  const double scale = options.first_length / first;
  recording->target_column = "point";
  recording->metres_per_pixel = scale / kFifthsOfPixel;
  recording->length_ratio = first / second;
  const auto add = [&](const char* point, const char* coordinate, int column, double sign) {
    RecordedSeries series{point, coordinate, {}, 0.0};
    for (const MarkerRow& row : rows) {
      series.values.push_back(sign * scale * (row[column] - row[column % 2]));
    }
    recording->series.push_back(series);
  };
  add("joint", "x", 3, 1.0);
  add("joint", "y", 2, -1.0);
  add("tip", "x", 5, 1.0);
  add("tip", "y", 4, -1.0);
  return true;
}

bool ParseAngles(const std::string& text, const std::string& file, const RecordingOptions& options,
                 Recording* recording, std::string* error) {
  CsvTable table;
  const std::vector<std::string> columns = {"t", "th1", "om1"};
  if (!ParseCsv(text, file, columns, columns, &table, error)) {
    return false;
  }
  recording->target_column = "body";
  RecordedSeries series{"pendulum", "angle", {}, 0.0};
  double last = 0.0;
  for (int i = 0; i < static_cast<int>(table.rows.size()); ++i) {
    double time = 0.0;
    double angle = 0.0;
    if (!ReadCell(table, i, table.Column("t"), &time, error) ||
        !ReadCell(table, i, table.Column("th1"), &angle, error)) {
      return false;
    }
    if (i > 0 && !(time > last)) {
      *error = file + ": line " + std::to_string(table.lines[i]) + ": t: expected one after " +
               CsvNumber(last) + " s, got " + CsvNumber(time) +
               ": the clock stands still or runs backwards";
      return false;
    }
    last = time;
    if (time >= options.from - kWindowRounding && time <= options.to + kWindowRounding) {
      recording->times.push_back(time - options.from);
      series.values.push_back(angle - std::numbers::pi);
    }
  }
  recording->series.push_back(series);
  return true;
}

}  // namespace

double NoiseFromFourthDifferences(const std::vector<double>& values) {
  if (values.size() < 5) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double sum = 0.0;
  for (size_t k = 4; k < values.size(); ++k) {
    const double d =
        values[k] - 4.0 * values[k - 1] + 6.0 * values[k - 2] - 4.0 * values[k - 3] + values[k - 4];
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(values.size() - 4) / 70.0);
}

bool ParseRecording(const std::string& text, const std::string& file,
                    const RecordingOptions& options, Recording* recording, std::string* error) {
  *recording = Recording();
  const bool read = options.kind == RecordingKind::kIbmDoublePendulum
                        ? ParseMarkers(text, file, options, recording, error)
                        : ParseAngles(text, file, options, recording, error);
  if (!read) {
    return false;
  }
  if (recording->times.size() < 5) {
    *error = file + ": expected at least 5 rows from " + CsvNumber(options.from) + " to " +
             CsvNumber(options.to) + " s, got " + std::to_string(recording->times.size());
    return false;
  }
  double sum = 0.0;
  for (RecordedSeries& series : recording->series) {
    if (!std::all_of(series.values.begin(), series.values.end(),
                     [](double x) { return std::isfinite(x); })) {
      *error = file + ": expected coordinates of " + series.target +
               " that a double can hold, got larger ones: markers or the length are too large";
      return false;
    }
    series.noise = NoiseFromFourthDifferences(series.values);
    sum += series.noise * series.noise;
  }
  recording->noise = std::sqrt(sum / static_cast<double>(recording->series.size()));
  return true;
}

bool ReadRecording(const std::string& file, const RecordingOptions& options, Recording* recording,
                   std::string* error) {
  std::string text;
  return ReadTextFile(file, &text, error) && ParseRecording(text, file, options, recording, error);
}

std::string ObservationCsv(const Recording& recording) {
  std::string csv = "time," + recording.target_column;
  // The series of one target follow each other, and all targets have the same coordinates.
  size_t coordinates = 0;
  while (coordinates < recording.series.size() &&
         recording.series[coordinates].target == recording.series.front().target) {
    csv += "," + recording.series[coordinates++].coordinate;
  }
  csv += "\n";
  for (size_t k = 0; k < recording.times.size(); ++k) {
    for (size_t s = 0; s < recording.series.size(); s += coordinates) {
      csv += CsvNumber(recording.times[k]) + "," + recording.series[s].target;
      for (size_t c = 0; c < coordinates; ++c) {
        csv += "," + CsvNumber(recording.series[s + c].values[k]);
      }
      csv += "\n";
    }
  }
  return csv;
}

}  // namespace tangible
