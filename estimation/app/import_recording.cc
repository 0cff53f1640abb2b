// SPDX-License-Identifier: Apache-2.0
//
// tangible-import-recording: a recording of real motion as observations for tangible-fit.

#include <gflags/gflags.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "tangible/app/program.h"
#include "tangible/estimation/experiments/recording.h"
#include "tangible/estimation/experiments/recording_table.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/text_file.h"

DEFINE_string(kind, "ibm_double_pendulum",
              "table, deeplabcut, tracker, ibm_double_pendulum or multiarm_single");
DEFINE_string(out, "", "file of the observations (CSV); required");
DEFINE_string(mapping, "", "of a table: file (JSON) that says which columns are what");
DEFINE_double(
    from, 0.0,
    "s: start, which becomes time 0; of a table or tracker by default the first row, if it "
    "is later than 1e4 s");
DEFINE_double(to, 0.5, "s: end, included; of table, deeplabcut and tracker by default all");
DEFINE_double(frame_rate, 0.0, "Hz, of a recording whose rows are frames without times");
DEFINE_double(likelihood, 0.0,
              "from 0 to 1, of deeplabcut: points that are less likely are missing data");
DEFINE_double(scale, 1.0, "m a unit of length of a table, deeplabcut or tracker");
DEFINE_bool(y_down, false, "y counts downwards, as in images: y and angles change sign");
DEFINE_double(rate, 400.0, "Hz, of ibm_double_pendulum");
DEFINE_double(length, 0.091, "m: pivot to joint of ibm_double_pendulum, which sets the scale");

namespace tangible {
namespace {

int Usage(const std::string& what) {
  return ReportError("tangible-import-recording: " + what, kExitUsage);
}

/// The flags that only some kinds take, and these kinds.
constexpr std::pair<const char*, const char*> kFlagsOfKinds[] = {
    {"mapping", "table"},
    {"frame_rate", "table or deeplabcut"},
    {"likelihood", "deeplabcut"},
    {"scale", "table, deeplabcut or tracker"},
    {"y_down", "table, deeplabcut or tracker"},
    {"rate", "ibm_double_pendulum"},
    {"length", "ibm_double_pendulum"}};

/// What is wrong with a flag of another kind, or empty.
std::string FlagOfAnotherKind() {
  for (const auto& [flag, kinds] : kFlagsOfKinds) {
    if (!gflags::GetCommandLineFlagInfoOrDie(flag).is_default &&
        std::string(kinds).find(FLAGS_kind) == std::string::npos) {
      return std::string("--").append(flag).append(": goes with --kind=").append(kinds) +
             ", got it with " + FLAGS_kind;
    }
  }
  return "";
}

/// The format or kind that --kind names, if it is in the list.
template <typename Kind, size_t N>
std::optional<Kind> FindKind(const std::pair<const char*, Kind> (&names)[N]) {
  for (const auto& [name, kind] : names) {
    if (FLAGS_kind == name) {
      return kind;
    }
  }
  return std::nullopt;
}

bool IsGiven(const char* flag) { return !gflags::GetCommandLineFlagInfoOrDie(flag).is_default; }

/// What is wrong with the numbers of flags, or empty. `to`: the window's end.
std::string WrongNumber(double to) {
  const auto got = [](double value) { return ", got " + FormatNumber(value); };
  if (!std::isfinite(FLAGS_from)) {
    return "--from: expected a finite number of seconds" + got(FLAGS_from);
  }
  if (!(FLAGS_from <= to)) return "--to: expected a number >= --from" + got(to);
  const std::pair<const char*, double> positive[] = {{"rate", FLAGS_rate},
                                                     {"length", FLAGS_length},
                                                     {"scale", FLAGS_scale},
                                                     {"frame_rate", FLAGS_frame_rate}};
  for (const auto& [flag, value] : positive) {
    if (IsGiven(flag) && !(value > 0.0 && std::isfinite(value))) {
      return std::string("--").append(flag) + ": expected a finite number > 0" + got(value);
    }
  }
  return FirstOutside({{"--likelihood", FLAGS_likelihood, 0.0, 1.0}});
}

int ImportTable(const std::string& file, TableFormat format) {
  TableOptions options;
  options.format = format;
  if (IsGiven("from")) {
    options.from = FLAGS_from;
  }
  if (IsGiven("to")) {
    options.to = FLAGS_to;
  }
  options.frame_rate = FLAGS_frame_rate;
  options.likelihood = FLAGS_likelihood;
  options.scale = FLAGS_scale;
  options.y_down = FLAGS_y_down;
  options.mapping_file = FLAGS_mapping;
  if (format == TableFormat::kDeepLabCut && FLAGS_frame_rate == 0.0) {
    return Usage("--frame_rate: expected that of the film, as files of deeplabcut have no times");
  }
  std::string text;
  std::string error;
  if (format == TableFormat::kTable) {
    if (FLAGS_mapping.empty()) {
      return Usage("--mapping: expected a file that says which columns are what");
    }
    if (!ReadTextFile(FLAGS_mapping, &options.mapping, &error)) {
      return ReportError(error);
    }
  }
  TableRecording recording;
  if (!ReadTextFile(file, &text, &error) ||
      !ParseTableRecording(text, file, options, &recording, &error)) {
    return ReportError(error);
  }
  error = WriteFileAtomically(FLAGS_out, ObservationCsv(recording));
  if (!error.empty()) {
    return ReportError(error);
  }
  if (recording.target_column == "event") {
    std::printf("%zu events\n", recording.rows.size());
  } else {
    std::printf("%zu rows, %ld coordinates missing\n", recording.rows.size(), recording.missing);
  }
  if (recording.before_zero > 0) {
    ReportError(file + ": " + std::to_string(recording.before_zero) +
                (recording.before_zero == 1 ? " row has a time before 0 and is"
                                            : " rows have times before 0 and are") +
                " left out (--from begins earlier)");
  }
  if (recording.start != 0.0) {
    const std::string start = CsvNumber(recording.start);
    std::printf("times count from %s s of the recording\n", start.c_str());
    ReportError(file + ": the first time is " + start +
                " s, a clock's: times are shifted to begin at 0 (--from=0 keeps them)");
  }
  for (const TableRecording::Noise& noise : recording.noise) {
    if (std::isfinite(noise.value)) {
      std::printf("noise of %s %s: %.3g %s\n", noise.name.c_str(), NameOf(noise.coordinate),
                  noise.value, UnitOf(noise.coordinate));
    }
  }
  return kExitDone;
}

int Import(const std::string& file) {
  if (FLAGS_out.empty()) {
    return Usage("--out: expected a file");
  }
  const std::optional<TableFormat> format = FindKind(kTableFormatNames);
  const std::optional<RecordingKind> kind = FindKind(kRecordingKindNames);
  if (!format && !kind) {
    return Usage(
        "--kind: expected table, deeplabcut, tracker, ibm_double_pendulum or multiarm_single, got "
        "'" +
        FLAGS_kind + "'");
  }
  const std::string other = FlagOfAnotherKind();
  if (!other.empty()) {
    return Usage(other);
  }
  const std::string wrong =
      WrongNumber(format && !IsGiven("to") ? std::numeric_limits<double>::infinity() : FLAGS_to);
  if (!wrong.empty()) {
    return Usage(wrong);
  }
  if (format) {
    return ImportTable(file, *format);
  }
  RecordingOptions options;
  options.kind = *kind;
  options.from = FLAGS_from;
  options.to = FLAGS_to;
  options.rate = FLAGS_rate;
  options.first_length = FLAGS_length;
  Recording recording;
  std::string error;
  if (!ReadRecording(file, options, &recording, &error)) {
    return ReportError(error);
  }
  error = WriteFileAtomically(FLAGS_out, ObservationCsv(recording));
  if (!error.empty()) {
    return ReportError(error);
  }
  std::printf("%zu frames over %g s\n", recording.times.size(), recording.times.back());
  if (recording.metres_per_pixel > 0.0) {
    std::printf("%.6g mm a pixel, length ratio %.4f\n", 1e3 * recording.metres_per_pixel,
                recording.length_ratio);
  }
  for (const RecordedSeries& series : recording.series) {
    std::printf("noise of %s %s: ", series.target.c_str(), series.coordinate.c_str());
    if (recording.metres_per_pixel > 0.0) {
      std::printf("%.4f mm, %.3f pixels\n", 1e3 * series.noise,
                  series.noise / recording.metres_per_pixel);
    } else {
      std::printf("%.3g rad\n", series.noise);
    }
  }
  return kExitDone;
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-import-recording",
       .synopsis = "RECORDING --out=O.csv --kind=table|deeplabcut|tracker|ibm_double_pendulum|"
                   "multiarm_single\n"
                   "                                 [--mapping=M.json] [--frame_rate=HZ] "
                   "[--likelihood=P] [--y_down]",
       .description = "Makes a recording of real motion into observations for tangible-fit and\n"
                      "prints the noise of each series, from its fourth differences.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .inputs = {"mapping"}});
  return line.exit_status ? *line.exit_status : Import(line.positional[0]);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
