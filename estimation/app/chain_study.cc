// SPDX-License-Identifier: Apache-2.0
//
// tangible-chain-study: how well the masses of all links of a chain are found at once.

#include "tangible/estimation/experiments/chain_study.h"

#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "tangible/app/program.h"
#include "tangible/app/row_archive.h"
#include "tangible/app/shards.h"
#include "tangible/scene/scene_json.h"

DEFINE_int32(starts, 20, "starts without noise, each link's mass log-uniform");
DEFINE_double(range, 100.0, "of the starts: from truth / range to range truth");
DEFINE_int32(replicas, 0, "fits of observations with noise, from the truth");
DEFINE_double(rate, 100.0, "observations of all bodies a second");
DEFINE_double(sigma, 0.001, "standard deviation of the noise, m");
DEFINE_int32(seed, 1, "of starts and noise");
DEFINE_string(out, "", "file of all starts and of how often intervals hold the truth (JSON)");
TANGIBLE_DEFINE_SHARD_FLAGS();

namespace tangible {

// What a shard keeps of a row. That no field is left out the compiler checks.
template <typename Visitor>
void VisitFields(ChainStart& start, const Visitor& visit) {
  auto& [status, initial_cost, final_cost, error, seconds] = start;
  visit("status", status);
  visit("initial_cost", initial_cost);
  visit("final_cost", final_cost);
  visit("error", error);
  visit("seconds", seconds);
}

template <typename Visitor>
void VisitFields(ChainReplica& replica, const Visitor& visit) {
  auto& [converged, covered, covered_robust] = replica;
  visit("converged", converged);
  visit("covered", covered);
  visit("covered_robust", covered_robust);
}

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

/// The rows of a study, or of one shard of it: the starts, then the replicas.
class Rows {
 public:
  explicit Rows(const ShardPlan& plan) : plan_(plan) {}

  static long InAll() { return static_cast<long>(FLAGS_starts) + FLAGS_replicas; }

  /// Reads all rows from the shards; an error or empty.
  std::string Merge() {
    MergedShards merged;
    std::string error = MergeShards(plan_, InAll(), &merged);
    if (!error.empty()) return error;
    const auto middle = merged.rows.begin() + FLAGS_starts;
    if (FromRows<ChainStart>({merged.rows.begin(), middle}, &starts_, &error)) {
      FromRows<ChainReplica>({middle, merged.rows.end()}, &replicas_, &error);
    }
    return error;
  }

  /// Start i, which is run unless it was read; by number.
  const ChainStart& Start(const ChainStudy& study, int number) {
    if (!plan_.IsMerge()) starts_.push_back(study.RunStart(number));
    return plan_.IsMerge() ? starts_[static_cast<size_t>(number)] : starts_.back();
  }
  bool HasStart(int number) const { return plan_.shard.Has(number); }

  const std::vector<ChainReplica>& Replicas(const ChainStudy& study) {
    if (!plan_.IsMerge()) {
      replicas_ = study.RunReplicas(
          [this](int number) { return plan_.shard.Has(static_cast<long>(FLAGS_starts) + number); });
    }
    return replicas_;
  }

  /// Of a shard no bound is judged: that is for all rows.
  bool IsPart() const { return plan_.IsShard(); }

  OrderedJson ToJson() const {
    std::vector<Json> rows = ToRows(starts_);
    for (Json& row : ToRows(replicas_)) rows.push_back(std::move(row));
    return ShardJson(plan_.shard, InAll(), rows);
  }

 private:
  const ShardPlan& plan_;
  std::vector<ChainStart> starts_;
  std::vector<ChainReplica> replicas_;
};

bool PrintStarts(const ChainStudy& study, Rows* rows, OrderedJson* json) {
  int reached = 0;
  std::printf("start  status           initial cost     final cost   largest error  seconds\n");
  for (int i = 0; i < FLAGS_starts; ++i) {
    if (!rows->HasStart(i)) continue;
    const ChainStart& start = rows->Start(study, i);
    reached += start.error < ChainStudyOptions().reached ? 1 : 0;
    std::printf("%5d  %-14s %14.6g %14.6g %15.3g %8.2f\n", i, NameOf(start.status),
                start.initial_cost, start.final_cost, start.error, start.seconds);
    std::fflush(stdout);
    (*json)["starts"].push_back({{"start", i},
                                 {"status", NameOf(start.status)},
                                 {"initial_cost", start.initial_cost},
                                 {"final_cost", start.final_cost},
                                 {"largest_error", start.error},
                                 {"seconds", start.seconds}});
  }
  (*json)["reached"] = reached;
  if (rows->IsPart()) return true;
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

bool PrintReplicas(const ChainStudy& study, Rows* rows, OrderedJson* json) {
  const ChainCoverage coverage = study.CoverageOf(rows->Replicas(study));
  std::printf("%d replicas with noise of %g m, %d not converged\n", coverage.replicas, FLAGS_sigma,
              coverage.failed);
  const bool holds = PrintCoverage("confidence_95", coverage, coverage.covered);
  PrintCoverage("confidence_95_robust", coverage, coverage.covered_robust);
  (*json)["replicas"] = coverage.replicas;
  (*json)["not_converged"] = coverage.failed;
  (*json)["covered"] = coverage.covered;
  (*json)["covered_robust"] = coverage.covered_robust;
  if (rows->IsPart()) return true;
  std::printf("confidence_95 expected: pooled %g to %g %%, each link %g to %g %%: %s\n",
              100.0 * kPooled[0], 100.0 * kPooled[1], 100.0 * kEach[0], 100.0 * kEach[1],
              holds ? "holds" : "DOES NOT HOLD");
  return holds;
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-chain-study",
       .synopsis = "SCENE.json [--starts=20] [--replicas=1000] [--out=R.json] "
                   "[--shard=I/N | --merge=R0.json,R1.json,...]",
       .description =
           "Estimates the masses of all bodies named link* at once from positions that the scene\n"
           "itself predicts: from far starts without noise, and with noise to count how many 95 %\n"
           "intervals contain the truth. Exits with 1 where a bound that it prints does not hold.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__});
  if (line.exit_status) {
    return *line.exit_status;
  }
  ShardPlan plan;
  std::string wrong = ReadShardFlags(FLAGS_shard, FLAGS_merge, FLAGS_out, &plan);
  if (!wrong.empty()) return ReportError("tangible-chain-study: " + wrong, kExitUsage);
  wrong = FirstOutside({{"--starts", FLAGS_starts, 0},
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
  if (plan.part != ShardPlan::Part::kAll) error = HashInputs();
  if (!error.empty()) return ReportError(error);
  error = OutputOverInput();
  if (!error.empty()) return ReportError(error, kExitUsage);
  Rows rows(plan);
  if (plan.IsMerge()) error = rows.Merge();
  if (!error.empty()) return ReportError(error);
  OrderedJson json = {{"links", study.num_links()}, {"starts", OrderedJson::array()}};
  const bool starts = FLAGS_starts == 0 || PrintStarts(study, &rows, &json);
  const bool replicas = FLAGS_replicas == 0 || PrintReplicas(study, &rows, &json);
  if (plan.IsShard()) {
    json["shard"] = rows.ToJson();
  } else {
    json["holds"] = starts && replicas;
  }
  if (!FLAGS_out.empty()) error = WriteResult(FLAGS_out, JsonText(json));
  if (!error.empty()) return ReportError(error);
  return starts && replicas ? kExitDone : kExitFailed;
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
