// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/recording_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>
#include <system_error>
#include <utility>

#include "tangible/estimation/experiments/recording.h"
#include "tangible/estimation/experiments/recording_mapping.h"
#include "tangible/estimation/experiments/tolerances.h"
#include "tangible/math/scalar.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/json_reader.h"
#include "tangible/scene/text_file.h"

namespace tangible {
namespace {

/// What separates the cells of a text: what its first lines have outside of quotes.
char SeparatorOf(std::string_view text) {
  bool quoted = false;
  bool semicolon = false;
  int lines = 0;
  char before = '\n';  // this character, without blanks
  // Tracker's first line may be a name alone.
  for (size_t i = 0; i < text.size() && lines < 2; ++i) {
    const bool may_open = before == '"' || before == ',' || before == ';' || before == '\n';
    if (text[i] == '"' && (quoted || may_open)) quoted = !quoted;
    if (text[i] != ' ') before = text[i];
    if (quoted) continue;
    if (text[i] == '\t') return '\t';
    semicolon = semicolon || text[i] == ';';
    lines += text[i] == '\n' ? 1 : 0;
  }
  return semicolon ? ';' : ',';
}

/// The last cell of a text, from `first` on, whose commas are none that separate cells: a decimal
/// comma becomes a point, others are put in quotes. `ends_quoted`: a quoted cell ends with its
/// closing quote; another one is refused later.
void FinishCell(size_t first, bool ends_quoted, std::string* text) {
  if (!ends_quoted || text->find(',', first) == std::string::npos) return;
  const std::string raw = text->substr(first);
  const bool quoted = raw[raw.find_first_not_of(" \t")] == '"';
  const std::string cell = SplitCsvLine(quoted ? raw : CsvCell(raw))[0];
  std::string number = cell;
  std::replace(number.begin(), number.end(), ',', '.');
  double value = 0.0;
  text->replace(first, std::string::npos, ParseNumber(number, &value) ? number : CsvCell(cell));
}

/// The text with its cells separated by commas and numbers with points. A line break in a quoted
/// cell becomes a space, and a blank line follows, so that lines keep their numbers. A quote inside
/// a cell that does not begin with one is a character.
class CommaText {
 public:
  explicit CommaText(std::string_view text) : separator_(SeparatorOf(text)) {
    commas_.reserve(text.size());
    for (const char c : text) Take(c);
    EndCell();
  }
  std::string& commas() { return commas_; }
  /// What is wrong with the quotes of a cell and its line, or empty.
  std::string mistake() const {
    if (open_line_ > 0) {
      return "line " + std::to_string(open_line_) +
             ": expected a closing quote of the cell, got the end of the file";
    }
    return bad_line_ == 0 ? ""
                          : "line " + std::to_string(bad_line_) +
                                ": expected the cell's end behind its closing quote, got more";
  }

 private:
  void Take(char c) {
    line_ += c == '\n' ? 1 : 0;
    if (c == '"') {
      TakeQuote();
    } else if (!quoted_ && (c == separator_ || c == '\n')) {
      EndCell();
      commas_ += c == separator_ ? ',' : c;
      if (c == '\n') commas_.append(static_cast<size_t>(std::exchange(breaks_, 0)), c);
      first_ = commas_.size();
      closed_ = false;
    } else if (c == '\n') {
      commas_ += ' ';
      ++breaks_;
    } else if (c != '\r') {
      const bool blank = c == ' ' || c == '\t';
      if (closed_ && !quoted_ && !blank && bad_line_ == 0) bad_line_ = line_;
      commas_ += c;
    }
  }

  void TakeQuote() {
    // It opens at a cell's beginning, or is the second one of two.
    const bool begins = commas_.find_first_not_of(" \t", first_) == std::string::npos;
    const bool second = closed_ && commas_.back() == '"';
    if (quoted_ || begins || second) {
      quoted_ = !quoted_;
      closed_ = !quoted_;
      open_line_ = quoted_ ? line_ : 0;
    } else if (closed_ && bad_line_ == 0) {
      bad_line_ = line_;
    }
    commas_ += '"';
  }

  void EndCell() {
    if (separator_ != ',') FinishCell(first_, bad_line_ == 0, &commas_);
  }

  char separator_;
  std::string commas_;
  size_t first_ = 0;  ///< of the cell
  int breaks_ = 0;
  int line_ = 1;
  int open_line_ = 0;  ///< of the quote that is open
  int bad_line_ = 0;
  bool quoted_ = false;
  bool closed_ = false;  ///< the cell's quote has been closed
};

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
  // Blank lines, so that lines keep their numbers.
  const std::string above(static_cast<size_t>(header_lines - 1), '\n');
  return ParseCsv(above + header + "\n" + rows, file, {}, {}, table, error);
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
    return CleanedName(individuals.empty() ? parts[i] : individuals[i] + "." + parts[i]);
  };
  for (size_t i = 1; i < parts.size(); ++i) {
    if (parts[i].empty() || (!individuals.empty() && individuals[i].empty())) {
      *error = file + ": line " + std::to_string(num_headers - 1) + ", column " +
               std::to_string(i + 1) + ": expected the name of a point, got none";
      return false;
    }
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
    value.name = CleanedName(track);
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

bool ReadTable(const std::string& text, const std::string& file, const TableOptions& options,
               CsvTable* table, Layout* layout, std::string* error) {
  Json json;
  if (!ParseCsv(text, file, {}, {}, table, error) ||
      !ParseJson(options.mapping, options.mapping_file, &json, error)) {
    return false;
  }
  JsonErrors errors(options.mapping_file);
  ReadMapping(JsonReader(json, &errors), *table, layout);
  if (!errors.ok()) {
    *error = errors.message();
  }
  return errors.ok();
}

bool IsLength(Coordinate coordinate) {
  return coordinate != Coordinate::kAngle && coordinate != Coordinate::kOmega &&
         coordinate != Coordinate::kAlpha && !IsForce(coordinate);
}

/// A number of a clock as its whole part and the rest: in one double, times since 1970 are
/// multiples of 2.4e-7 s.
struct ClockNumber {
  long double whole = 0.0L;
  long double part = 0.0L;

  long double Since(const ClockNumber& other) const {
    return (whole - other.whole) + (part - other.part);
  }
};

/// The number in a cell that reads as `rounded`.
ClockNumber ReadClock(const std::string& cell, double rounded) {
  const bool has_plus = !cell.empty() && cell[0] == '+';
  const char* const begin = cell.data() + (has_plus ? 1 : 0);
  const char* const end = cell.data() + cell.size();
  const char* const point = std::find(begin, end, '.');
  ClockNumber number{rounded, 0.0L};
  const auto whole = std::from_chars(begin, point, number.whole);
  if (whole.ec != std::errc() || whole.ptr != point) return {rounded, 0.0L};
  const std::string rest = "0" + std::string(point, end);
  const auto part = std::from_chars(rest.data(), rest.data() + rest.size(), number.part);
  // Not 1.5e9, whose exponent is that of both parts.
  if (part.ec != std::errc() || rest.find_first_of("eE") != std::string::npos) {
    return {rounded, 0.0L};
  }
  if (*begin == '-') number.part = -number.part;
  return number;
}

/// The number as it was written: 1e-9, of which a double has 16 digits.
long double AsWritten(double value) {
  const std::string digits = CsvNumber(value);
  long double written = value;
  std::from_chars(digits.data(), digits.data() + digits.size(), written);
  return written;
}

// A contact's tangent is its normal turned by a right angle, in a direction that changes too.
bool TurnsWithY(Coordinate coordinate) {
  return coordinate == Coordinate::kY || coordinate == Coordinate::kVy ||
         coordinate == Coordinate::kAngle || coordinate == Coordinate::kOmega ||
         coordinate == Coordinate::kAy || coordinate == Coordinate::kAlpha ||
         coordinate == Coordinate::kFy || coordinate == Coordinate::kTorque ||
         coordinate == Coordinate::kTangent;
}

/// Reads the rows of a table with a known layout.
class RowCollector {
 public:
  RowCollector(const CsvTable& table, const Layout& layout, const TableOptions& options,
               TableRecording* recording, std::string* error)
      : table_(table), layout_(layout), options_(options), recording_(recording), error_(error) {}

  bool Collect() {
    std::vector<Moment> moments;
    for (int row = 0; row < static_cast<int>(table_.rows.size()); ++row) {
      Moment moment{row, 0.0, {}, ""};
      if (!ReadTime(&moment) || !ReadName(row, &moment.name) || !CheckClock(moment)) {
        return false;
      }
      const bool wanted = layout_.name < 0 || !moment.name.empty();
      if (wanted && IsWithin(moment.time)) moments.push_back(moment);
      if (wanted && !options_.from && moment.time < -Rounding(0.0)) ++recording_->before_zero;
    }
    const Moment* const start = FindStart(moments);
    for (const Moment& moment : moments) {
      const double time = TimeOf(moment, start);
      if (!CheckApart(moment, time)) return false;
      if (layout_.target_column == "event") {
        if (!ReadEvent(moment.row, time, moment.name)) return false;
      } else if (!ReadValues(moment.row, time, moment.name)) {
        return false;
      }
    }
    return true;
  }

 private:
  /// When and whose a row is.
  struct Moment {
    int row;
    double time;        ///< s
    ClockNumber clock;  ///< in the file's unit
    std::string name;
  };

  bool Fail(int row, const std::string& what) {
    *error_ = OneLine(table_.file + ": line " + std::to_string(table_.lines[row]) + ": " + what);
    return false;
  }

  bool IsWithin(double time) const {
    const double from = options_.from.value_or(0.0);
    return time >= from - Rounding(from) && time <= options_.to + Rounding(options_.to);
  }

  static double Rounding(double end) {
    return kWindowRounding + (std::isfinite(end) ? kEndRounding * std::abs(end) : 0.0);
  }

  /// The moment whose time becomes 0 where times are those of a clock, else none.
  const Moment* FindStart(const std::vector<Moment>& moments) {
    if (options_.from || moments.empty()) return nullptr;
    const auto first = std::min_element(
        moments.begin(), moments.end(),
        [](const Moment& a, const Moment& b) { return a.clock.Since(b.clock) < 0.0L; });
    if (first->time <= kClockTime) return nullptr;
    recording_->start = first->time;
    return &*first;
  }

  /// The time from the start of the window, s.
  double TimeOf(const Moment& moment, const Moment* start) const {
    if (start != nullptr) {
      return static_cast<double>(scale_ * moment.clock.Since(start->clock));
    }
    const double from = options_.from.value_or(0.0);
    if (from == 0.0 && layout_.time_offset == 0.0) return moment.time;
    // The numbers as they were written: 0.3 − 0.3 is 0, though 0.3 has more bits than a double.
    const ClockNumber before = ReadClock(CsvNumber(-layout_.time_offset), -layout_.time_offset);
    const ClockNumber begin = ReadClock(CsvNumber(from), from);
    const ClockNumber shift{begin.whole + before.whole, begin.part + before.part};
    // Of a clock in ms a second is 1000 units, exactly; a thousandth is rounded.
    const long double per_second = std::round(1.0L / scale_);
    if (std::abs(per_second * scale_ - 1.0L) <= kUnitRounding) {
      const long double units = per_second * shift.part;
      const long double nearest = std::round(units);
      const bool is_whole = std::abs(units - nearest) <= kUnitRounding * std::abs(units);
      const ClockNumber shifted{moment.clock.whole - per_second * shift.whole,
                                moment.clock.part - (is_whole ? nearest : units)};
      return static_cast<double>((shifted.whole + shifted.part) / per_second);
    }
    const ClockNumber scaled{scale_ * moment.clock.whole, scale_ * moment.clock.part};
    return static_cast<double>(scaled.Since(shift));
  }

  bool ReadTime(Moment* moment) {
    double cell = moment->row;
    const int column = layout_.time >= 0 ? layout_.time : layout_.frame;
    if (column >= 0 && !ReadCell(table_, moment->row, column, &cell, error_)) {
      return false;
    }
    moment->clock =
        column >= 0 ? ReadClock(table_.rows[moment->row][column], cell) : ClockNumber{cell, 0.0L};
    moment->time = layout_.time >= 0 ? layout_.time_scale * cell + layout_.time_offset
                                     : cell / options_.frame_rate;
    return std::isfinite(moment->time) ||
           Fail(moment->row, "time: expected a finite number of seconds, got " + CsvNumber(cell) +
                                 " with a scale that is too large");
  }

  bool ReadName(int row, std::string* name) {
    if (layout_.name < 0) {
      *name = layout_.event;
      return true;
    }
    const std::string& written = table_.rows[row][layout_.name];
    const auto place = layout_.names.find(written);
    *name = layout_.names.empty()
                ? CleanedName(written, layout_.target_column == "contact" ? ":" : "")
            : place == layout_.names.end() ? ""
                                           : place->second;
    return !layout_.names.empty() || !written.empty() || Fail(row, "expected a name, got none");
  }

  bool CheckClock(const Moment& moment) {
    const auto [last, first] = last_moment_.try_emplace(moment.name, moment);
    if (!first && !(moment.clock.Since(last->second.clock) > 0.0L)) {
      return Fail(moment.row, "time: expected one after " + CsvNumber(last->second.time) +
                                  " s, got " + CsvNumber(moment.time) +
                                  ": the clock stands still or runs backwards");
    }
    last->second = moment;
    return true;
  }

  /// Whether the times of a name stay apart as they are written.
  bool CheckApart(const Moment& moment, double time) {
    const auto [last, first] = last_written_.try_emplace(moment.name, time);
    if (!first && !(time > last->second)) {
      return Fail(moment.row, "time: expected one that differs from the last as a double, got " +
                                  CsvNumber(time) +
                                  " s again: let times count from a later --from");
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
      const std::string& cell = table_.rows[row][column.column];
      if (!ReadLikelihood(row, column.likelihood, &likelihood)) {
        return false;
      }
      if (cell.empty() || cell == "nan" || cell == "NaN" || likelihood < options_.likelihood) {
        ++recording_->missing;
        continue;
      }
      double value = 0.0;
      if (!ReadValue(row, column, &value)) {
        return false;
      }
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

  bool ReadEvent(int row, double time, const std::string& name) {
    long& last = last_number_[name];
    double number = static_cast<double>(last) + 1.0;
    if (layout_.number >= 0 && !ReadCell(table_, row, layout_.number, &number, error_)) {
      return false;
    }
    if (!(number > static_cast<double>(last)) || number != std::floor(number) ||
        number > std::numeric_limits<int>::max()) {
      return Fail(row, "number: expected an integer of at least " + std::to_string(last + 1) +
                           ", got " + table_.rows[row][layout_.number]);
    }
    last = static_cast<long>(number);
    recording_->rows.push_back({time, name, "", {}, last});
    recording_->rows.back().values.fill(kNaN);
    return true;
  }

  bool ReadLikelihood(int row, int column, double* likelihood) {
    if (column < 0 || table_.rows[row][column].empty()) return true;
    return ReadCell(table_, row, column, likelihood, error_) &&
           ((*likelihood >= 0.0 && *likelihood <= 1.0) ||
            Fail(row, "likelihood: expected a number from 0 to 1, got " + CsvNumber(*likelihood)));
  }

  bool ReadValue(int row, const ValueColumn& column, double* value) {
    double cell = 0.0;
    if (!ReadCell(table_, row, column.column, &cell, error_)) {
      return false;
    }
    *value = column.scale * cell + column.offset;
    *value *= IsLength(column.coordinate) ? options_.scale : 1.0;
    *value *= options_.y_down && TurnsWithY(column.coordinate) ? -1.0 : 1.0;
    return std::isfinite(*value) ||
           Fail(row, std::string(NameOf(column.coordinate)) +
                         ": expected a finite number after its scale and offset, got " +
                         CsvNumber(cell) + " with a scale that is too large");
  }

  const CsvTable& table_;
  const Layout& layout_;
  const TableOptions& options_;
  TableRecording* recording_;
  std::string* error_;
  long double scale_ =
      layout_.time >= 0 ? AsWritten(layout_.time_scale) : 1.0L / options_.frame_rate;
  std::map<std::string, Moment> last_moment_;
  std::map<std::string, double> last_written_;
  std::map<std::string, long> last_number_;  ///< of each event
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
  std::string mistake = WhyNotText(text);
  CommaText comma_text(mistake.empty() ? WithoutByteOrderMark(text) : "");
  if (mistake.empty()) mistake = comma_text.mistake();
  if (!mistake.empty()) {
    *error = file + ": " + mistake;
    return false;
  }
  const std::string& commas = comma_text.commas();
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
    *error = file + ": expected at least one " +
             (layout.target_column == "event" ? "event" : "measured coordinate") + " from " +
             CsvNumber(options.from.value_or(0.0)) + " to " + CsvNumber(options.to) +
             " s, got none";
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
  const bool is_event = recording.target_column == "event";
  std::string csv = "time," + recording.target_column + (is_event ? ",number" : "") +
                    (relative ? ",relative_to" : "");
  for (size_t i = 0; i < used.size(); ++i) {
    if (used[i]) csv += std::string(",") + NameOf(static_cast<Coordinate>(i));
  }
  csv += "\n";
  for (const TableRow& row : recording.rows) {
    csv += CsvNumber(row.time) + "," + row.name;
    if (is_event) csv += "," + std::to_string(row.number);
    if (relative) {
      csv += "," + row.relative_to;
    }
    for (size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) continue;
      csv += ",";
      if (std::isfinite(row.values[i])) csv += CsvNumber(row.values[i]);
    }
    csv += "\n";
  }
  return csv;
}

}  // namespace tangible
