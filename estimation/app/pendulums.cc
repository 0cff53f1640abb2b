// SPDX-License-Identifier: Apache-2.0
//
// tangible-pendulums: what the recordings of real pendulums identify.

#include "tangible/estimation/experiments/pendulums.h"

#include <gflags/gflags.h>

#include <cstdio>
#include <string>

#include "tangible/app/program.h"

DEFINE_string(fits, "data/fits", "folder of the fit files");
DEFINE_string(observations, "out",
              "folder for the observations, where the fit files look for them");
DEFINE_string(out, "", "file of the results (JSON); empty: none is written");

namespace tangible {
namespace {

void PrintQuantity(const std::string& name, double estimate, double deviation, double bias) {
  std::printf("  %-16s %13.6g ± %-9.2g step's bias %9.2g\n", name.c_str(), estimate, deviation,
              bias);
}

void Print(const PendulumResult& result) {
  const double scale = result.recording.metres_per_pixel;
  std::printf("%s: %zu frames, %zu iterations, %.2g s\n", result.name.c_str(),
              result.recording.times.size(), result.fit.iterations.size() - 1, result.fit.seconds);
  if (scale > 0.0) {
    std::printf("  noise %.4f mm (%.3f pixels), residual rms %.4f mm (%.3f pixels), ratio %.2f\n",
                1e3 * result.recording.noise, result.recording.noise / scale,
                1e3 * result.residual_rms, result.residual_rms / scale,
                result.residual_rms / result.recording.noise);
  } else {
    std::printf("  noise %.2g rad, residual rms %.2g rad\n", result.recording.noise,
                result.residual_rms);
  }
  if (!IsTrustworthyMap(result.fit.certificate)) {
    std::printf("  warning: not trustworthy at the estimate: %s\n",
                result.fit.certificate.verdict.c_str());
  }
  for (Eigen::Index k = 0; k < result.fit.estimate.size(); ++k) {
    PrintQuantity(result.parameters[k].name, result.fit.estimate[k],
                  result.fit.uncertainty.standard_deviation[k], result.check.bias[k]);
  }
  for (size_t i = 0; i < result.derived.size(); ++i) {
    PrintQuantity(result.derived[i].name, result.derived[i].estimate,
                  result.derived[i].standard_deviation, result.derived_bias[i]);
  }
  for (const PredictionError& prediction : result.predictions) {
    std::printf("  predicted the next %g s to %.4f rad\n", prediction.seconds, prediction.error);
  }
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-pendulums",
       .synopsis = "RECORDINGS [--fits=data/fits] [--observations=out] [--out=R.json]",
       .description =
           "Fits the recordings of real pendulums below RECORDINGS (multiarm_pendulum/ and\n"
           "ibm_double_pendulum/) and prints the parameters, what follows from them, the\n"
           "residuals against the noise, and the errors of predictions.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__});
  if (line.exit_status) {
    return *line.exit_status;
  }
  OrderedJson all = OrderedJson::array();
  for (const PendulumJob& job : PendulumJobs(line.positional[0])) {
    PendulumResult result;
    std::string error;
    if (!RunPendulum(job, FLAGS_fits, FLAGS_observations, &result, &error)) {
      return ReportError(error);
    }
    Print(result);
    all.push_back(PendulumToJson(result));
  }
  const std::string over = OutputOverInput();
  if (!over.empty()) return ReportError(over, kExitUsage);
  if (!FLAGS_out.empty()) {
    const std::string error = WriteFileAtomically(FLAGS_out, all.dump(2) + "\n");
    if (!error.empty()) {
      return ReportError(error);
    }
  }
  return kExitDone;
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
