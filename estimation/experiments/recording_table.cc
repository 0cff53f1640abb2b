// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/recording_table.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>

#include "tangible/estimation/experiments/recording.h"
#include "tangible/estimation/experiments/tolerances.h"
#include "tangible/math/scalar.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/scene_names.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

/// One column of a file.
struct ValueColumn {
  int column = -1;
  std::string name;  ///< of the body or point; empty: the row says it
  std::string relative_to;
  Coordinate coordinate = Coordinate::kX;
  double scale = 1.0;
  double offset = 0.0;
  int likelihood = -1;  ///< its column, −1: none
};

/// The layout of a file: the meaning of its columns.
struct Layout {
  std::string target_column = "point";
  int time = -1;  ///< −1: rows are frames
  double time_scale = 1.0;
  double time_offset = 0.0;
  int frame = -1;  ///< column of the frame's number; −1: the row's
  int name = -1;
  std::map<std::string, std::string> names;  ///< empty: all as they are
  std::vector<ValueColumn> values;
};

/// The name with the characters that observation files and paths allow.
std::string Cleaned(const std::string& name) {
  std::string clean = name;
  for (char& c : clean) {
    if (!IsName(std::string(1, c))) {
      c = '_';
    }
  }
  return clean;
}

/// The name with each line break as a space, which is how WithCommas leaves it in a cell.
std::string InOneLine(std::string name) {
  name.erase(std::remove(name.begin(), name.end(), '\r'), name.end());
  std::replace(name.begin(), name.end(), '\n', ' ');
  return name;
}

/// What separates the cells of a text: what its first lines have outside of quotes.
char SeparatorOf(std::string_view text) {
  bool quoted = false;
  bool semicolon = false;
  int lines = 0;
  // Tracker's first line may be a name alone.
  for (size_t i = 0; i < text.size() && lines < 2; ++i) {
    quoted = quoted != (text[i] == '"');
    if (quoted) continue;
    if (text[i] == '\t') return '\t';
    semicolon = semicolon || text[i] == ';';
    lines += text[i] == '\n' ? 1 : 0;
  }
  return semicolon ? ';' : ',';
}

/// The last cell of a text, from `first` on, whose commas are none that separate cells: a decimal
/// comma becomes a point, others are put in quotes.
void FinishCell(size_t first, std::string* text) {
  if (text->find(',', first) == std::string::npos) return;
  const std::string raw = text->substr(first);
  const bool quoted = raw[raw.find_first_not_of(" \t")] == '"';
  const std::string cell = SplitCsvLine(quoted ? raw : CsvCell(raw))[0];
  std::string number = cell;
  std::replace(number.begin(), number.end(), ',', '.');
  double value = 0.0;
  text->replace(first, std::string::npos, ParseNumber(number, &value) ? number : CsvCell(cell));
}

/// The text with its cells separated by commas and numbers with points. A line break in a quoted
/// cell becomes a space, and a blank line follows, so that lines keep their numbers. `open_line`:
/// the line of a quote that is not closed, 0 where there is none.
std::string WithCommas(std::string_view text, int* open_line) {
  const char separator = SeparatorOf(text);
  std::string commas;
  commas.reserve(text.size());
  size_t first = 0;  // of the cell
  int breaks = 0;
  int line = 1;
  bool quoted = false;
  *open_line = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    line += c == '\n' ? 1 : 0;
    if (c == '"') {
      // It opens at a cell's beginning, or is the second one of two; elsewhere it is no quote.
      const bool begins = commas.find_first_not_of(" \t", first) == std::string::npos;
      if (!quoted && !begins && text[i - 1] != '"') continue;
      quoted = !quoted;
      *open_line = quoted ? line : 0;
      commas += c;
    } else if (!quoted && (c == separator || c == '\n')) {
      if (separator != ',') FinishCell(first, &commas);
      commas += c == separator ? ',' : c;
      if (c == '\n') commas.append(static_cast<size_t>(std::exchange(breaks, 0)), c);
      first = commas.size();
    } else if (c == '\n') {
      commas += ' ';
      ++breaks;
    } else if (c != '\r') {
      commas += c;
    }
  }
  if (separator != ',') FinishCell(first, &commas);
  return commas;
}

/// The first lines of a text, and what follows them.
std::vector<std::string> TakeLines(size_t count, std::string* text) {
  std::vector<std::string> lines;
  while (lines.size() < count && !text->empty()) {
    const size_t end = text->find('\n');
    lines.push_back(text->substr(0, end));
    text->erase(0, end == std::string::npos ? text->size() : end + 1);
  }
  lines.resize(count);
  return lines;
}

/// Parses rows below a header of `width` columns that have no names of their own.
bool ParseRows(const std::string& rows, const std::string& file, size_t width, int header_lines,
               CsvTable* table, std::string* error) {
  std::string header;
  for (size_t i = 0; i < width; ++i) {
    header += (i == 0 ? "" : ",") + std::to_string(i);
  }
  if (!ParseCsv(header + "\n" + rows, file, {}, {}, table, error)) {
    return false;
  }
  for (int& line : table->lines) {
    line += header_lines - 1;
  }
  return true;
}

bool ReadDeepLabCut(std::string text, const std::string& file, CsvTable* table, Layout* layout,
                    std::string* error) {
  std::vector<std::string> headers = TakeLines(3, &text);
  std::vector<std::string> individuals;
  if (headers[1].rfind("individuals", 0) == 0) {
    individuals = SplitCsvLine(headers[1]);
    headers.push_back(TakeLines(1, &text)[0]);
    headers.erase(headers.begin() + 1);
  }
  const std::vector<std::string> parts = SplitCsvLine(headers[1]);
  const std::vector<std::string> coords = SplitCsvLine(headers[2]);
  if (headers[0].rfind("scorer", 0) != 0 || parts.empty() || parts[0] != "bodyparts" ||
      coords.empty() || coords[0] != "coords" || parts.size() != coords.size() ||
      (!individuals.empty() && individuals.size() != parts.size())) {
    *error = file +
             ": header: expected rows that begin with scorer, bodyparts and coords, with "
             "individuals after the first for several animals, of the same length";
    return false;
  }
  const int num_headers = individuals.empty() ? 3 : 4;
  layout->frame = 0;
  std::map<std::string, int> likelihood;
  const auto name_of = [&](size_t i) {
    return Cleaned(individuals.empty() ? parts[i] : individuals[i] + "." + parts[i]);
  };
  for (size_t i = 1; i < parts.size(); ++i) {
    if (coords[i] == "likelihood") {
      likelihood[name_of(i)] = static_cast<int>(i);
    } else if (coords[i] == "x" || coords[i] == "y") {
      ValueColumn value;
      value.column = static_cast<int>(i);
      value.name = name_of(i);
      value.coordinate = coords[i] == "x" ? Coordinate::kX : Coordinate::kY;
      layout->values.push_back(value);
    } else {
      *error = OneLine(file + ": line " + std::to_string(num_headers) +
                       ": expected x, y or likelihood, got \"" + coords[i] + "\"");
      return false;
    }
  }
  for (ValueColumn& value : layout->values) {
    const auto place = likelihood.find(value.name);
    value.likelihood = place == likelihood.end() ? -1 : place->second;
  }
  return ParseRows(text, file, parts.size(), num_headers, table, error);
}

/// The coordinate of a column of Tracker; returns false for columns that are not read.
bool TrackerCoordinate(const std::string& name, Coordinate* coordinate) {
  static const std::map<std::string, Coordinate> known = {
      {"x", Coordinate::kX},   {"y", Coordinate::kY},      {"vx", Coordinate::kVx},
      {"vy", Coordinate::kVy}, {"v_{x}", Coordinate::kVx}, {"v_{y}", Coordinate::kVy}};
  const auto place = known.find(name);
  if (place != known.end()) {
    *coordinate = place->second;
  }
  return place != known.end();
}

bool ReadTracker(std::string text, const std::string& file, CsvTable* table, Layout* layout,
                 std::string* error) {
  const bool multi = text.rfind("#multi:", 0) == 0;
  const std::vector<std::string> headers = TakeLines(multi ? 3 : 2, &text);
  std::vector<std::string> columns = SplitCsvLine(headers.back());
  while (!columns.empty() && columns.back().empty()) {
    columns.pop_back();  // lines end with a separator
  }
  std::vector<std::string> tracks = SplitCsvLine(headers[headers.size() - 2]);
  tracks.resize(std::max(tracks.size(), columns.size()));
  std::string track = multi || tracks.empty() ? "" : tracks[0];
  track.erase(0, track.find_first_not_of('#'));
  for (size_t i = 0; i < columns.size(); ++i) {
    track = multi && !tracks[i].empty() ? tracks[i] : track;
    ValueColumn value;
    value.column = static_cast<int>(i);
    value.name = Cleaned(track);
    if (columns[i] == "t") {
      layout->time = static_cast<int>(i);
    } else if (TrackerCoordinate(columns[i], &value.coordinate)) {
      layout->values.push_back(value);
    }
  }
  if (layout->time < 0 || layout->values.empty() || layout->values[0].name.empty()) {
    *error = file +
             ": header: expected the name of a track, then columns t and any of x, y, vx, vy, as "
             "Tracker exports them";
    return false;
  }
  // Rows may end with a separator too.
  std::string rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells = SplitCsvLine(line);
    while (cells.size() > columns.size() && cells.back().empty()) {
      cells.pop_back();
    }
    cells.resize(std::max(cells.size(), line.empty() ? 0 : columns.size()));
    for (size_t i = 0; i < cells.size(); ++i) {
      rows += (i == 0 ? "" : ",") + CsvCell(cells[i]);
    }
    rows += "\n";
  }
  return ParseRows(rows, file, columns.size(), multi ? 3 : 2, table, error);
}

/// Reads a mapping for the columns of a table.
class MappingReader {
 public:
  MappingReader(const JsonReader& root, const CsvTable& table, Layout* layout)
      : root_(root), table_(table), layout_(layout) {}

  void Read() {
    root_.ExpectKeys({"time", "target", "name", "names", "columns"}, " of a mapping");
    if (root_.Has("time")) {
      ReadTime(root_.At("time"));
    }
    const bool is_long = root_.Has("name");
    if (is_long) {
      layout_->name = ColumnOf(root_.At("name"));
      layout_->target_column = root_.At("target").Choice(kTargets);
      if (root_.Has("names")) {
        const JsonReader names = root_.At("names");
        if (!names.IsObject()) {
          names.FailExpected("an object of names");
        }
        for (const std::string& name : names.Keys()) {
          layout_->names[InOneLine(name)] = NameAt(names.At(name));
        }
      }
    } else if (root_.Has("target") || root_.Has("names")) {
      root_.At(root_.Has("target") ? "target" : "names")
          .Fail("goes with name, the column that says whose a row is");
    }
    const JsonReader columns = root_.At("columns");
    const int count = columns.ExpectArray("an array of {column, coordinate}");
    for (int i = 0; i < count && root_.ok(); ++i) {
      layout_->values.push_back(ReadColumn(columns.At(i), is_long));
    }
    if (count == 0) {
      columns.Fail("expected at least one column, got none");
    }
  }

 private:
  static constexpr std::pair<const char*, const char*> kTargets[] = {{"body", "body"},
                                                                     {"point", "point"}};

  int ColumnOf(const JsonReader& json) const {
    const std::string name = json.String();
    const int column = table_.Column(InOneLine(name));
    if (column < 0 && json.IsString()) {
      std::string names;
      for (const std::string& other : table_.columns) {
        names += (names.empty() ? "" : ", ") + other;
      }
      json.FailExpected("the name of a column of " + table_.file + " (" + names + ")");
    }
    return column;
  }

  static std::string NameAt(const JsonReader& json) {
    std::string name = json.String();
    if (json.IsString() && !IsName(name)) {
      json.FailExpected("a name of letters, digits and _.-");
    }
    return name;
  }

  static double ScaleAt(const JsonReader& json) {
    if (!json.Has("scale")) {
      return 1.0;
    }
    const double scale = json.At("scale").Number();
    if (scale == 0.0) {
      json.At("scale").FailExpected("a number other than 0");
    }
    return scale;
  }

  void ReadTime(const JsonReader& json) {
    if (json.IsString()) {
      layout_->time = ColumnOf(json);
      return;
    }
    json.ExpectKeys({"column", "scale", "offset"}, " of time");
    layout_->time = ColumnOf(json.At("column"));
    layout_->time_scale = json.Has("scale") ? json.At("scale").Number(NumberKind::kPositive) : 1.0;
    layout_->time_offset = json.Has("offset") ? json.At("offset").Number() : 0.0;
  }

  ValueColumn ReadColumn(const JsonReader& json, bool is_long) {
    json.ExpectKeys({"column", "coordinate", "body", "point", "relative_to", "scale", "offset"},
                    " of a column");
    ValueColumn value;
    value.column = ColumnOf(json.At("column"));
    value.coordinate = ReadCoordinate(json.At("coordinate"));
    value.scale = ScaleAt(json);
    value.offset = json.Has("offset") ? json.At("offset").Number() : 0.0;
    value.relative_to = json.Has("relative_to") ? NameAt(json.At("relative_to")) : "";
    if (json.Has("body") + json.Has("point") != (is_long ? 0 : 1)) {
      json.Fail(is_long ? "expected no body or point: the column of names says whose a row is"
                        : "expected a body or a point, got both or neither");
      return value;
    }
    if (!is_long) {
      const char* const target = json.Has("body") ? "body" : "point";
      if (!layout_->values.empty() && layout_->target_column != target) {
        json.At(target).Fail(
            "expected all columns to be of bodies, or all of points: an observation file has one "
            "kind");
      }
      layout_->target_column = target;
      value.name = NameAt(json.At(target));
    }
    return value;
  }

  static Coordinate ReadCoordinate(const JsonReader& json) {
    const std::string name = json.String();
    for (int i = 0; i < kCoordinates; ++i) {
      if (name == NameOf(static_cast<Coordinate>(i))) {
        return static_cast<Coordinate>(i);
      }
    }
    json.FailExpected("x, y, angle, vx, vy, omega or distance");
    return Coordinate::kX;
  }

  JsonReader root_;
  const CsvTable& table_;
  Layout* layout_;
};

bool ReadTable(const std::string& text, const std::string& file, const TableOptions& options,
               CsvTable* table, Layout* layout, std::string* error) {
  Json json;
  if (!ParseCsv(text, file, {}, {}, table, error) ||
      !ParseJson(options.mapping, options.mapping_file, &json, error)) {
    return false;
  }
  JsonErrors errors(options.mapping_file);
  MappingReader(JsonReader(json, &errors), *table, layout).Read();
  if (!errors.ok()) {
    *error = errors.message();
  }
  return errors.ok();
}

bool IsLength(Coordinate coordinate) {
  return coordinate != Coordinate::kAngle && coordinate != Coordinate::kOmega;
}

bool TurnsWithY(Coordinate coordinate) {
  return coordinate == Coordinate::kY || coordinate == Coordinate::kVy ||
         coordinate == Coordinate::kAngle || coordinate == Coordinate::kOmega;
}

/// Reads the rows of a table with a known layout.
class RowCollector {
 public:
  RowCollector(const CsvTable& table, const Layout& layout, const TableOptions& options,
               TableRecording* recording, std::string* error)
      : table_(table), layout_(layout), options_(options), recording_(recording), error_(error) {}

  bool Collect() {
    for (int row = 0; row < static_cast<int>(table_.rows.size()); ++row) {
      double time = 0.0;
      std::string name;
      if (!ReadTime(row, &time) || !ReadName(row, &name) || !CheckClock(row, time, name)) {
        return false;
      }
      const bool wanted = layout_.name < 0 || !name.empty();
      if (!wanted || time < options_.from - kWindowRounding ||
          time > options_.to + kWindowRounding) {
        continue;
      }
      if (!ReadValues(row, time - options_.from, name)) {
        return false;
      }
    }
    return true;
  }

 private:
  bool Fail(int row, const std::string& what) {
    *error_ = OneLine(table_.file + ": line " + std::to_string(table_.lines[row]) + ": " + what);
    return false;
  }

  bool ReadTime(int row, double* time) {
    if (layout_.time >= 0) {
      const bool read = ReadCell(table_, row, layout_.time, time, error_);
      *time = layout_.time_scale * *time + layout_.time_offset;
      return read;
    }
    double frame = row;
    if (layout_.frame >= 0 && !ReadCell(table_, row, layout_.frame, &frame, error_)) {
      return false;
    }
    *time = frame / options_.frame_rate;
    return true;
  }

  bool ReadName(int row, std::string* name) {
    if (layout_.name < 0) {
      return true;
    }
    const std::string& written = table_.rows[row][layout_.name];
    const auto place = layout_.names.find(written);
    *name = layout_.names.empty()          ? Cleaned(written)
            : place == layout_.names.end() ? ""
                                           : place->second;
    return !layout_.names.empty() || !written.empty() || Fail(row, "expected a name, got none");
  }

  bool CheckClock(int row, double time, const std::string& name) {
    const auto [last, first] = last_time_.try_emplace(name, time);
    if (!first && !(time > last->second)) {
      std::ostringstream what;
      what.precision(10);
      what << "time: expected one after " << last->second << " s, got " << time
           << ": the clock stands still or runs backwards";
      return Fail(row, what.str());
    }
    last->second = time;
    return true;
  }

  /// The row with this name among those of the current time.
  TableRow* RowOf(double time, const std::string& name, const std::string& relative_to,
                  size_t first) {
    for (size_t i = first; i < recording_->rows.size(); ++i) {
      if (recording_->rows[i].name == name && recording_->rows[i].relative_to == relative_to) {
        return &recording_->rows[i];
      }
    }
    recording_->rows.push_back({time, name, relative_to, {}});
    recording_->rows.back().values.fill(kNaN);
    return &recording_->rows.back();
  }

  bool ReadValues(int row, double time, const std::string& name) {
    const size_t first = recording_->rows.size();
    for (const ValueColumn& column : layout_.values) {
      double likelihood = 1.0;
      if (column.likelihood >= 0 && !table_.rows[row][column.likelihood].empty() &&
          !ReadCell(table_, row, column.likelihood, &likelihood, error_)) {
        return false;
      }
      const std::string& cell = table_.rows[row][column.column];
      if (cell.empty() || cell == "nan" || cell == "NaN" || likelihood < options_.likelihood) {
        ++recording_->missing;
        continue;
      }
      double value = 0.0;
      if (!ReadCell(table_, row, column.column, &value, error_)) {
        return false;
      }
      value = column.scale * value + column.offset;
      value *= IsLength(column.coordinate) ? options_.scale : 1.0;
      value *= options_.y_down && TurnsWithY(column.coordinate) ? -1.0 : 1.0;
      TableRow* const to =
          RowOf(time, column.name.empty() ? name : column.name, column.relative_to, first);
      double& place = to->values[static_cast<size_t>(column.coordinate)];
      if (std::isfinite(place)) {
        return Fail(row, std::string("expected ") + NameOf(column.coordinate) + " of " + to->name +
                             " once, got it twice");
      }
      place = value;
    }
    return true;
  }

  const CsvTable& table_;
  const Layout& layout_;
  const TableOptions& options_;
  TableRecording* recording_;
  std::string* error_;
  std::map<std::string, double> last_time_;
};

void EstimateNoise(TableRecording* recording) {
  std::map<std::pair<std::string, int>, std::vector<double>> series;
  for (const TableRow& row : recording->rows) {
    for (int i = 0; i < kCoordinates; ++i) {
      if (std::isfinite(row.values[static_cast<size_t>(i)])) {
        series[{row.name, i}].push_back(row.values[static_cast<size_t>(i)]);
      }
    }
  }
  for (const auto& [key, values] : series) {
    recording->noise.push_back(
        {key.first, static_cast<Coordinate>(key.second), NoiseFromFourthDifferences(values)});
  }
}

}  // namespace

bool ParseTableRecording(const std::string& text, const std::string& file,
                         const TableOptions& options, TableRecording* recording,
                         std::string* error) {
  *recording = TableRecording();
  int open_line = 0;
  const std::string commas = WithCommas(WithoutByteOrderMark(text), &open_line);
  if (open_line > 0) {
    *error = file + ": line " + std::to_string(open_line) +
             ": expected a closing quote of the cell, got the end of the file";
    return false;
  }
  CsvTable table;
  Layout layout;
  const bool read = options.format == TableFormat::kDeepLabCut
                        ? ReadDeepLabCut(commas, file, &table, &layout, error)
                    : options.format == TableFormat::kTracker
                        ? ReadTracker(commas, file, &table, &layout, error)
                        : ReadTable(commas, file, options, &table, &layout, error);
  if (!read) {
    return false;
  }
  if ((layout.time >= 0) == (options.frame_rate > 0.0)) {
    *error = file + ": expected a column of times or a frame rate, got " +
             (layout.time >= 0 ? "both" : "neither");
    return false;
  }
  recording->target_column = layout.target_column;
  if (!RowCollector(table, layout, options, recording, error).Collect()) {
    return false;
  }
  if (recording->rows.empty()) {
    std::ostringstream what;
    what << file << ": expected at least one measured coordinate from " << options.from << " to "
         << options.to << " s, got none";
    *error = what.str();
    return false;
  }
  EstimateNoise(recording);
  return true;
}

std::string ObservationCsv(const TableRecording& recording) {
  std::array<bool, kCoordinates> used{};
  bool relative = false;
  for (const TableRow& row : recording.rows) {
    relative = relative || !row.relative_to.empty();
    for (size_t i = 0; i < used.size(); ++i) {
      used[i] = used[i] || std::isfinite(row.values[i]);
    }
  }
  std::ostringstream csv;
  csv.precision(10);
  csv << "time," << recording.target_column << (relative ? ",relative_to" : "");
  for (size_t i = 0; i < used.size(); ++i) {
    csv << (used[i] ? std::string(",") + NameOf(static_cast<Coordinate>(i)) : "");
  }
  csv << "\n";
  for (const TableRow& row : recording.rows) {
    csv << row.time << "," << row.name;
    if (relative) {
      csv << "," << row.relative_to;
    }
    for (size_t i = 0; i < used.size(); ++i) {
      if (used[i]) {
        csv << ",";
      }
      if (std::isfinite(row.values[i])) {
        csv << row.values[i];
      }
    }
    csv << "\n";
  }
  return csv.str();
}

}  // namespace tangible
