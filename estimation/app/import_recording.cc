// SPDX-License-Identifier: Apache-2.0
//
// tangible-import-recording: a recording of a real pendulum as observations for tangible-fit.

#include <gflags/gflags.h>

#include <cstdio>
#include <string>

#include "tangible/app/program.h"
#include "tangible/estimation/experiments/recording.h"

DEFINE_string(kind, "ibm_double_pendulum", "ibm_double_pendulum or multiarm_single");
DEFINE_string(out, "", "file of the observations (CSV); required");
DEFINE_double(from, 0.0, "s: start, which becomes time 0");
DEFINE_double(to, 0.5, "s: end, included");
DEFINE_double(rate, 400.0, "Hz, of ibm_double_pendulum");
DEFINE_double(length, 0.091, "m: pivot to joint of ibm_double_pendulum, which sets the scale");

namespace tangible {
namespace {

int Usage(const std::string& what) {
  return ReportError("tangible-import-recording: " + what, kExitUsage);
}

int Import(const std::string& file) {
  RecordingOptions options;
  bool known = false;
  for (const auto& [name, kind] : kRecordingKindNames) {
    if (FLAGS_kind == name) {
      options.kind = kind;
      known = true;
    }
  }
  if (!known) {
    return Usage("--kind: expected ibm_double_pendulum or multiarm_single, got '" + FLAGS_kind +
                 "'");
  }
  if (FLAGS_out.empty()) {
    return Usage("--out: expected a file");
  }
  if (!(FLAGS_from <= FLAGS_to) || !(FLAGS_rate > 0.0) || !(FLAGS_length > 0.0)) {
    return Usage("expected --from <= --to, --rate > 0 and --length > 0");
  }
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
       .synopsis = "RECORDING.csv --out=O.csv [--kind=ibm_double_pendulum|multiarm_single]",
       .description = "Makes a recording of a real pendulum into observations for tangible-fit\n"
                      "and prints the noise of each series, from its fourth differences.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__});
  return line.exit_status ? *line.exit_status : Import(line.positional[0]);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
