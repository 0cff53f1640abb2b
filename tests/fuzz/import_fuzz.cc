// SPDX-License-Identifier: Apache-2.0
// A first byte that chooses format and options, then any bytes as a recording of another program;
// of a table a mapping stands before it, up to a line "%". It is refused with one line, or written
// as observations that read back to the same doubles, in ascending times for each name.
#include <cmath>
#include <cstdint>
#include <map>
#include <string>

#include "expect.h"
#include "tangible/estimation/experiments/recording.h"
#include "tangible/estimation/experiments/recording_table.h"
#include "tangible/scene/csv.h"

namespace {

using tangible::testing::Expect;

void ExpectReadable(const std::string& csv, size_t least_rows) {
  tangible::CsvTable table;
  std::string error;
  Expect(tangible::ParseCsv(csv, "o.csv", {"time"}, {}, &table, &error), "a table", error);
  Expect(table.rows.size() >= least_rows, "all rows", csv);
  for (int row = 0; row < static_cast<int>(table.rows.size()); ++row) {
    double time = 0.0;
    Expect(tangible::ReadCell(table, row, 0, &time, &error), "a time", error);
  }
}

void ImportTable(const std::string& text, const tangible::TableOptions& options) {
  tangible::TableRecording recording;
  std::string error;
  if (!tangible::ParseTableRecording(text, "r.csv", options, &recording, &error)) {
    Expect(!error.empty() && error.find('\n') == std::string::npos, "one line", error);
    return;
  }
  const std::string csv = tangible::ObservationCsv(recording);
  ExpectReadable(csv, recording.rows.size());
  std::map<std::string, double> last;
  tangible::CsvTable table;
  Expect(tangible::ParseCsv(csv, "o.csv", {}, {}, &table, &error), "a table", error);
  for (size_t i = 0; i < recording.rows.size(); ++i) {
    const tangible::TableRow& row = recording.rows[i];
    double time = 0.0;
    Expect(tangible::ParseNumber(table.rows[i][0], &time) && time == row.time, "the same time",
           table.rows[i][0]);
    const auto [before, first] = last.try_emplace(row.name + "," + row.relative_to, row.time);
    Expect(first || row.time > before->second, "ascending times", row.name);
    before->second = row.time;
  }
}

void ImportPendulum(const std::string& text, tangible::RecordingKind kind) {
  tangible::RecordingOptions options;
  options.kind = kind;
  options.to = 10.0;
  tangible::Recording recording;
  std::string error;
  if (tangible::ParseRecording(text, "r.csv", options, &recording, &error)) {
    ExpectReadable(tangible::ObservationCsv(recording), recording.times.size());
  } else {
    Expect(!error.empty() && error.find('\n') == std::string::npos, "one line", error);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const unsigned choice = data[0];
  std::string text(reinterpret_cast<const char*>(data + 1), size - 1);
  if (choice % 5 > 2) {
    ImportPendulum(text, choice % 5 == 3 ? tangible::RecordingKind::kIbmDoublePendulum
                                         : tangible::RecordingKind::kMultiarmSingle);
    return 0;
  }
  tangible::TableOptions options;
  options.format = static_cast<tangible::TableFormat>(choice % 5);
  if (options.format == tangible::TableFormat::kTable) {
    const size_t end = text.find("\n%\n");
    if (end == std::string::npos) return 0;
    options.mapping = text.substr(0, end);
    options.mapping_file = "m.json";
    text.erase(0, end + 3);
  }
  const unsigned bits = choice / 5;
  if ((bits & 1U) != 0) options.from = 0.25;
  if ((bits & 2U) != 0) options.frame_rate = 30.0;
  if ((bits & 4U) != 0) options.likelihood = 0.5;
  if ((bits & 8U) != 0) options.scale = 1e-3;
  options.y_down = (bits & 16U) != 0;
  ImportTable(text, options);
  return 0;
}
