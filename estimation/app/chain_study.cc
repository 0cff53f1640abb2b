// SPDX-License-Identifier: Apache-2.0
//
// tangible-chain-study: how well the masses of all links of a chain are found at once.

#include "tangible/estimation/experiments/chain_study.h"

#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "tangible/app/program.h"
#include "tangible/scene/scene_json.h"

DEFINE_int32(starts, 20, "starts without noise, each link's mass log-uniform");
DEFINE_double(range, 100.0, "of the starts: from truth / range to range truth");
DEFINE_int32(replicas, 0, "fits of observations with noise, from the truth");
DEFINE_double(rate, 100.0, "observations of all bodies a second");
DEFINE_double(sigma, 0.001, "standard deviation of the noise, m");
DEFINE_int32(seed, 1, "of starts and noise");

namespace tangible {
namespace {

// Starts are drawn in logarithms; observations are kept, a number each; and residuals are divided
// by sigma.
constexpr double kMostRange = 1e9;
constexpr double kLeastRate = 0.001;
constexpr double kMostRate = 1e6;
constexpr double kLeastSigma = 1.0 / 1e12;

// What must hold: of the starts, and of the 95 % intervals pooled and of each link.
constexpr double kLeastReached = 0.95;
constexpr double kPooled[] = {0.935, 0.965};
constexpr double kEach[] = {0.92, 0.98};

bool PrintStarts(const ChainStudy& study) {
  int reached = 0;
  std::printf("start  status           initial cost     final cost   largest error  seconds\n");
  for (int i = 0; i < FLAGS_starts; ++i) {
    const ChainStart start = study.RunStart(i);
    reached += start.error < ChainStudyOptions().reached ? 1 : 0;
    std::printf("%5d  %-14s %14.6g %14.6g %15.3g %8.2f\n", i, NameOf(start.status),
                start.initial_cost, start.final_cost, start.error, start.seconds);
    std::fflush(stdout);
  }
  const bool enough = reached >= kLeastReached * FLAGS_starts;
  std::printf("%d of %d starts reach the true masses to %g (expected at least %g): %s\n", reached,
              FLAGS_starts, ChainStudyOptions().reached, kLeastReached * FLAGS_starts,
              enough ? "holds" : "DOES NOT HOLD");
  return enough;
}

/// Prints the coverage by one kind of interval; whether it is within the bounds.
bool PrintCoverage(const char* name, const ChainCoverage& coverage,
                   const std::vector<int>& counts) {
  const double replicas = coverage.replicas;
  const double pooled = coverage.Pooled(counts);
  bool holds = pooled >= kPooled[0] && pooled <= kPooled[1];
  std::printf("%-20s pooled %.2f %%, by link", name, 100.0 * pooled);
  for (const int count : counts) {
    holds = holds && count >= kEach[0] * replicas && count <= kEach[1] * replicas;
    std::printf(" %.1f", 100.0 * count / replicas);
  }
  std::printf(" %%\n");
  return holds;
}

bool PrintReplicas(const ChainStudy& study) {
  const ChainCoverage coverage = study.RunCoverage({});
  std::printf("%d replicas with noise of %g m, %d not converged\n", coverage.replicas, FLAGS_sigma,
              coverage.failed);
  const bool holds = PrintCoverage("confidence_95", coverage, coverage.covered);
  PrintCoverage("confidence_95_robust", coverage, coverage.covered_robust);
  std::printf("confidence_95 expected: pooled %g to %g %%, each link %g to %g %%: %s\n",
              100.0 * kPooled[0], 100.0 * kPooled[1], 100.0 * kEach[0], 100.0 * kEach[1],
              holds ? "holds" : "DOES NOT HOLD");
  return holds;
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-chain-study",
       .synopsis = "SCENE.json [--starts=20] [--replicas=1000]",
       .description =
           "Estimates the masses of all bodies named link* at once from positions that the scene\n"
           "itself predicts: from far starts without noise, and with noise to count how many 95 %\n"
           "intervals contain the truth. Exits with 1 where a bound that it prints does not hold.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__});
  if (line.exit_status) {
    return *line.exit_status;
  }
  const std::string wrong = FirstOutside({{"--starts", FLAGS_starts, 0},
                                          {"--replicas", FLAGS_replicas, 0},
                                          {"--range", FLAGS_range, 1, kMostRange},
                                          {"--rate", FLAGS_rate, kLeastRate, kMostRate},
                                          {"--sigma", FLAGS_sigma, kLeastSigma},
                                          {"--seed", FLAGS_seed, 0}});
  if (!wrong.empty()) return ReportError("tangible-chain-study: " + wrong, kExitUsage);
  Scene scene;
  std::string error;
  if (!LoadScene(line.positional[0], &scene, &error)) {
    return ReportError(error);
  }
  ChainStudyOptions options;
  options.starts = FLAGS_starts;
  options.range = FLAGS_range;
  options.replicas = FLAGS_replicas;
  options.sigma = FLAGS_sigma;
  options.seed = static_cast<unsigned>(FLAGS_seed);
  const ChainStudy study(scene, FLAGS_rate, options);
  if (study.num_links() == 0) {
    return ReportError(line.positional[0] + ": /bodies: expected bodies named link*, got none");
  }
  const bool starts = FLAGS_starts == 0 || PrintStarts(study);
  const bool replicas = FLAGS_replicas == 0 || PrintReplicas(study);
  return starts && replicas ? kExitDone : kExitFailed;
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
