// SPDX-License-Identifier: Apache-2.0
//
// tangible-verify: compares derivatives of scenes by every method.

#include <gflags/gflags.h>

#include <algorithm>
#include <iostream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/app/row_archive.h"
#include "tangible/app/shards.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_names.h"
#include "tangible/verification/errata/errata.h"
#include "tangible/verification/gradients/verify_html.h"
#include "tangible/verification/gradients/verify_json.h"
#include "tangible/verification/gradients/verify_rows.h"
#include "tangible/verification/gradients/verify_text.h"
#include "tangible/verification/support/provenance.h"
#include "tangible/verification/support/random_scene.h"

DEFINE_string(parameters, "",
              "paths of the parameters of the given scenes, separated by commas; empty: all");
DEFINE_int32(random, -1, "number of random scenes; -1: 100 if nothing else is given, else 0");
DEFINE_int32(starts, -1,
             "number of random scenes that start in contact, near what contacts can do; -1: 10 if "
             "nothing else is given, else 0");
DEFINE_int32(coincidences, -1,
             "number of random scenes in which something happens exactly on a step's end, at the "
             "start or the end, or twice at one instant; -1: 2 if nothing else is given, else 0");
DEFINE_int32(seed, 1, "of the first random scene of each kind; the next have the next seeds");
DEFINE_string(stepping, "", "of random scenes: fixed, event or both; empty: all that there is");
DEFINE_int32(threads, 0, "how many scenes are checked at the same time; 0: one a core");
DEFINE_bool(jacobians, false, "write every method's whole Jacobian to --out");
DEFINE_bool(errata, false, "instead: the mistakes of the method's published summary as printed");
DEFINE_string(out, "", "file of all figures (JSON)");
DEFINE_string(report, "", "file of a report for people (HTML)");
TANGIBLE_DEFINE_SHARD_FLAGS();

namespace tangible {
namespace {

constexpr int kMostRandom = 1000000;
constexpr int kDefaultRandom = 100;
constexpr int kDefaultStarts = 10;
constexpr int kDefaultCoincidences = 2;

// The steppings named by --stepping; empty with a line if there is none of this name.
std::vector<Stepping> Steppings(std::string* error) {
  const bool all = FLAGS_stepping.empty() || FLAGS_stepping == "both";
  std::vector<Stepping> wanted;
  for (const auto& [name, stepping] : kSteppingNames) {
    if (all || FLAGS_stepping == name) wanted.push_back(stepping);
  }
  if (wanted.empty()) {
    *error = "--stepping: expected fixed, event or both, got '" + FLAGS_stepping + "'";
  }
  return wanted;
}

// Empty, or one line about a flag's value.
std::string CheckFlags(const std::vector<std::string>& files, ShardPlan* plan) {
  std::string wrong = ReadShardFlags(FLAGS_shard, FLAGS_merge, FLAGS_out, plan);
  if (!wrong.empty()) return wrong;
  // Of −1, the default, the numbers follow below.
  std::string outside = FirstOutside(
      {{"--random", FLAGS_random == -1 ? 0.0 : FLAGS_random, 0, kMostRandom},
       {"--starts", FLAGS_starts == -1 ? 0.0 : FLAGS_starts, 0, kMostRandom},
       {"--coincidences", FLAGS_coincidences == -1 ? 0.0 : FLAGS_coincidences, 0, kMostRandom},
       {"--seed", FLAGS_seed, 0},
       {"--threads", FLAGS_threads, 0, kMostThreads}});
  if (!outside.empty()) return outside;
  if (!FLAGS_parameters.empty() && files.empty()) {
    return "--parameters: of given scenes; random scenes choose theirs by their seed";
  }
  const bool is_asked =
      !files.empty() || FLAGS_random != -1 || FLAGS_starts != -1 || FLAGS_coincidences != -1;
  for (const auto& [number, usual] :
       {std::pair(&FLAGS_random, kDefaultRandom), std::pair(&FLAGS_starts, kDefaultStarts),
        std::pair(&FLAGS_coincidences, kDefaultCoincidences)}) {
    if (*number == -1) *number = is_asked ? 0 : usual;
  }
  if (FLAGS_random + FLAGS_starts + FLAGS_coincidences == 0 && files.empty() && !FLAGS_errata) {
    return "expected scenes, --random > 0, --starts > 0 or --coincidences > 0, got none";
  }
  if (FLAGS_errata && (!files.empty() || !FLAGS_out.empty() || !FLAGS_report.empty())) {
    return "--errata: takes no scenes and writes no files";
  }
  if (FLAGS_errata && plan->part != ShardPlan::Part::kAll) {
    return "--errata: not with --shard or --merge, as there is nothing to divide";
  }
  return "";
}

// Empty, or one line.
std::string AddFile(const std::string& file, std::vector<VerifyJob>* jobs) {
  VerifyJob job;
  std::string error;
  if (!LoadScene(file, &job.scene, &error)) return error;
  job.stepping = job.scene.simulation.stepping;
  if (FLAGS_parameters.empty()) {
    job.parameters = AllParameters(job.scene);
  } else {
    for (const std::string& path : SplitAtCommas(FLAGS_parameters)) {
      if (!ResolveParameter(job.scene, path, &job.parameters.emplace_back(), &error)) {
        return error.insert(0, ": ").insert(0, file);
      }
    }
  }
  jobs->push_back(std::move(job));
  return "";
}

// A shard's file has its rows and no verdict, which is on all scenes.
std::string Write(const VerifyResult& result, const std::string& verdict,
                  const OrderedJson& shard) {
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] {
    OrderedJson json = {{"provenance", OrderedJson::object()}};
    if (shard.is_null()) json["verdict"] = verdict;
    for (const auto& [what, value] : Provenance()) {
      json["provenance"][what] = value;
    }
    json.update(ToJson(result));
    if (!shard.is_null()) json["shard"] = shard;
    return JsonText(json);
  });
  writer.Write(FLAGS_report, [&] { return VerifyReport(result, ProvenanceLine(), verdict); });
  return writer.error();
}

int RunErrata() {
  const ErrataTable table = ComputeErrata();
  std::cout << ErrataText(table);
  const std::string broken = BrokenErrata(table);
  return broken.empty() ? kExitDone : ReportError(broken);
}

// Checks the jobs of the plan's part, which are left, or reads all from the shards; an error or
// empty.
std::string CheckPart(const ShardPlan& plan, std::vector<VerifyJob>* jobs,
                      std::vector<CheckedJob>* checked) {
  std::string error;
  const auto in_all = static_cast<long>(jobs->size());
  if (plan.IsMerge()) {
    MergedShards merged;
    error = MergeShards(plan, in_all, &merged);
    if (error.empty()) FromRows(merged.rows, checked, &error);
    return error;
  }
  std::vector<VerifyJob> part;
  for (long i = 0; i < plan.shard.NumRows(in_all); ++i) {
    part.push_back(std::move((*jobs)[static_cast<size_t>(plan.shard.RowOf(i))]));
  }
  *jobs = std::move(part);
  Progress progress("scenes", static_cast<long>(jobs->size()));
  const int cores = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 16);
  *checked = CheckJobs(*jobs, FLAGS_threads > 0 ? FLAGS_threads : cores,
                       FLAGS_jacobians ? KeepJacobians::kYes : KeepJacobians::kNo,
                       [&](long done) { progress.Show(done); });
  return error;
}

int Run(const std::vector<std::string>& files, const std::vector<Stepping>& steppings,
        const ShardPlan& plan) {
  std::vector<VerifyJob> jobs;
  for (const std::string& file : files) {
    const std::string error = AddFile(file, &jobs);
    if (!error.empty()) return ReportError(error);
  }
  if (plan.part != ShardPlan::Part::kAll) {
    const std::string error = HashInputs();
    if (!error.empty()) return ReportError(error);
  }
  const std::string over = OutputOverInput();
  if (!over.empty()) return ReportError(over, kExitUsage);
  for (const auto& [list, count] :
       {std::pair(RandomList::kScenes, FLAGS_random), std::pair(RandomList::kStarts, FLAGS_starts),
        std::pair(RandomList::kCoincidences, FLAGS_coincidences)}) {
    for (VerifyJob& job : RandomJobs(list, static_cast<unsigned>(FLAGS_seed), count, steppings)) {
      jobs.push_back(std::move(job));
    }
  }
  std::cout << ProvenanceLine() << "\n";
  if (FLAGS_random > 0) {
    std::cout << FLAGS_random << " random scenes from seed " << FLAGS_seed << "\n";
  }
  if (FLAGS_starts > 0) {
    std::cout << FLAGS_starts << " random starts from seed " << FLAGS_seed << "\n";
  }
  if (FLAGS_coincidences > 0) {
    std::cout << FLAGS_coincidences << " random coincidences from seed " << FLAGS_seed << "\n";
  }
  std::cout << std::endl;
  const auto in_all = static_cast<long>(jobs.size());
  std::vector<CheckedJob> checked;
  std::string error = CheckPart(plan, &jobs, &checked);
  if (!error.empty()) return ReportError(error);
  OrderedJson shard;
  if (plan.IsShard()) shard = ShardJson(plan.shard, in_all, ToRows(checked));
  const VerifyResult result = Summarize(jobs, std::move(checked));
  const std::string verdict = plan.IsShard() ? "" : BrokenBound(jobs, result);
  std::cout << TableText(result) << "\n" << SummaryText(result, FLAGS_random > 0);
  error = Write(result, verdict, shard);
  if (!error.empty()) return ReportError(error);
  return verdict.empty() ? kExitDone : ReportError("tangible-verify: " + verdict);
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-verify",
       .synopsis = "[SCENE.json ...] [--parameters=P1,P2] [--random=N] [--starts=N] "
                   "[--coincidences=N] [--seed=S] [--threads=T] "
                   "[--out=R.json] [--report=R.html] [--shard=I/N | --merge=R0.json,R1.json,...]",
       .description =
           "Differentiates the final state of scenes by adjoint, tangent, Jets and differences, "
           "and compares them\nentry by entry. Without scenes: 100 random ones, 10 starts and 2 "
           "coincidences. Exit status 1 where a bound\ndoes not hold.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .num_positional = 0,
       .most_positional = 1000,
       .outputs = {"out", "report"}});
  if (line.exit_status) return *line.exit_status;
  ShardPlan plan;
  std::string wrong = CheckFlags(line.positional, &plan);
  std::vector<Stepping> steppings;
  if (wrong.empty()) steppings = Steppings(&wrong);
  if (!wrong.empty()) return ReportError("tangible-verify: " + wrong, kExitUsage);
  return FLAGS_errata ? RunErrata() : Run(line.positional, steppings, plan);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
