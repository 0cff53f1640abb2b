// SPDX-License-Identifier: Apache-2.0
//
// tangible-corpus: runs the solvers on many problems with known answers.

#include <gflags/gflags.h>

#include <algorithm>
#include <iostream>
#include <string>
#include <thread>

#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/verification/corpus/corpus_report.h"
#include "tangible/verification/corpus/crowd_run.h"
#include "tangible/verification/corpus/crowd_scene.h"
#include "tangible/verification/support/provenance.h"

DEFINE_string(problems, "", "folder of problem files, all of which are solved");
DEFINE_int32(random, 20, "random problems of each kind");
DEFINE_int32(seed, 1, "of the random problems");
DEFINE_int32(first, 0, "number of the first random problem of each kind");
DEFINE_string(kind, "", "random problems of this kind only");
DEFINE_int32(contacts, 100, "largest number of contacts in a random problem");
DEFINE_int32(dense_contacts, 30, "the general solver takes random problems of up to so many");
DEFINE_int32(crowds, 0, "random scenes of each kind of crowd, run by fixed steps");
DEFINE_int32(crowd_steps, 1000, "of each");
DEFINE_int32(crowd_bodies, 400, "largest number of bodies in a crowd");
DEFINE_int32(threads, 0, "how many problems are solved at the same time; 0: one a core");
DEFINE_string(out, "", "file of all figures (JSON)");

namespace tangible {
namespace {

constexpr int kMostRandom = 1000000;
constexpr int kMostContacts = 1000;

// Empty, or one line about a flag's value.
std::string CheckFlags() {
  std::string outside = FirstOutside({{"--random", FLAGS_random, 0, kMostRandom},
                                      {"--seed", FLAGS_seed, 0},
                                      {"--first", FLAGS_first, 0, 2147483647.0 - kMostRandom},
                                      {"--contacts", FLAGS_contacts, 1, kMostContacts},
                                      {"--dense_contacts", FLAGS_dense_contacts, 0, kMostContacts},
                                      {"--crowds", FLAGS_crowds, 0, kMostRandom},
                                      {"--crowd_steps", FLAGS_crowd_steps, 1, kMostRandom},
                                      {"--crowd_bodies", FLAGS_crowd_bodies, 20, kMostContacts},
                                      {"--threads", FLAGS_threads, 0, kMostThreads}});
  if (!outside.empty()) return outside;
  if (FLAGS_random == 0 && FLAGS_problems.empty() && FLAGS_crowds == 0) {
    return "--random: expected a number > 0 where there are no --problems or --crowds, got 0";
  }
  const std::vector<std::string>& kinds = corpus::RandomKinds();
  if (FLAGS_kind.empty() || std::find(kinds.begin(), kinds.end(), FLAGS_kind) != kinds.end()) {
    return "";
  }
  std::string names;
  for (const std::string& kind : kinds) names += (names.empty() ? "" : ", ") + kind;
  return "--kind: expected one of " + names + ", got '" + FLAGS_kind + "'";
}

int Run() {
  std::vector<corpus::FileCase> files;
  std::string error;
  if (!FLAGS_problems.empty()) error = corpus::ReadProblemFolder(FLAGS_problems, &files);
  if (!error.empty()) return ReportError(error);
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const long total = static_cast<long>(files.size()) +
                     static_cast<long>(FLAGS_random) *
                         (FLAGS_kind.empty() ? static_cast<long>(corpus::RandomKinds().size()) : 1);
  Progress progress("problems", total);
  const corpus::CorpusResult result =
      corpus::RunCorpus(files, {.random = FLAGS_random,
                                .seed = static_cast<std::uint64_t>(FLAGS_seed),
                                .first = FLAGS_first,
                                .only = FLAGS_kind,
                                .most_contacts = FLAGS_contacts,
                                .most_dense = FLAGS_dense_contacts,
                                .threads = FLAGS_threads > 0 ? FLAGS_threads : cores,
                                .progress = [&](long done) { progress.Show(done); }});
  std::cout << ProvenanceLine() << "; seed " << FLAGS_seed << "\n\n"
            << corpus::TableText(result) << std::flush;
  std::vector<corpus::CrowdRow> crowds;
  if (FLAGS_crowds > 0) {
    Progress scenes(
        "scenes", static_cast<long>(FLAGS_crowds) * static_cast<long>(corpus::CrowdKinds().size()));
    crowds = corpus::RunCrowds({.scenes = FLAGS_crowds,
                                .seed = static_cast<std::uint64_t>(FLAGS_seed),
                                .first = FLAGS_first,
                                .steps = FLAGS_crowd_steps,
                                .most_bodies = FLAGS_crowd_bodies,
                                .threads = FLAGS_threads > 0 ? FLAGS_threads : cores,
                                .progress = [&](long done) { scenes.Show(done); }});
    std::cout << corpus::TableText(crowds) << std::flush;
  }
  if (!FLAGS_out.empty()) {
    OrderedJson json = {{"provenance", OrderedJson::object()}, {"seed", FLAGS_seed}};
    for (const auto& [what, value] : Provenance()) json["provenance"][what] = value;
    json.update(corpus::ToJson(result));
    if (FLAGS_crowds > 0) json["crowds"] = corpus::ToJson(crowds);
    error = WriteResult(FLAGS_out, JsonText(json));
    if (!error.empty()) return ReportError(error);
  }
  std::string failure = corpus::FirstFailure(result);
  if (failure.empty()) failure = corpus::FirstFailure(crowds);
  return failure.empty() ? kExitDone : ReportError("tangible-corpus: " + failure);
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-corpus",
       .synopsis = "[--problems=FOLDER] [--random=N] [--crowds=N] [--seed=S] [--out=R.json]",
       .description =
           "Solves problems of which the answer is known, files and random contact problems, by "
           "every solver; judges each\nanswer from the data. Exit status 1 where an answer is "
           "wrong, or fewer are solved than should be. With --crowds runs random scenes of many "
           "contacts.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .num_positional = 0});
  if (line.exit_status) return *line.exit_status;
  const std::string wrong = CheckFlags();
  if (!wrong.empty()) return ReportError("tangible-corpus: " + wrong, kExitUsage);
  return Run();
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
