// SPDX-License-Identifier: Apache-2.0
//
// tangible-extremes: the engine at its limits, a table of cases with a bound each.

#include <gflags/gflags.h>

#include <algorithm>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/verification/extremes/extreme_report.h"
#include "tangible/verification/support/provenance.h"

DEFINE_string(group, "", "only the cases of this group");
DEFINE_string(case, "", "only the cases whose name contains this");
DEFINE_string(stepping, "", "only this stepping: fixed or event");
DEFINE_bool(long, false, "full sizes: 60 s at rest, 1e6 steps, 1e5 gradients in a row");
DEFINE_bool(list, false, "print the cases instead of running them");
DEFINE_int32(threads, 0, "how many cases run at the same time; 0: one a core");
DEFINE_string(out, "", "file of all figures (JSON)");
DEFINE_string(report, "", "file of a report for people (HTML)");

namespace tangible {
namespace {

using extremes::CaseResult;
using extremes::ExtremeCase;

// The groups' names, each once, separated by commas.
std::string GroupNames(const std::vector<ExtremeCase>& cases) {
  std::string names, last;
  for (const ExtremeCase& one : cases) {
    if (one.group == last) continue;
    names += (names.empty() ? "" : ", ") + one.group;
    last = one.group;
  }
  return names;
}

// Empty, or one line about a flag's value.
std::string ChooseCases(std::vector<ExtremeCase>* cases) {
  std::string outside = FirstOutside({{"--threads", FLAGS_threads, 0, kMostThreads}});
  if (!outside.empty()) return outside;
  if (!FLAGS_stepping.empty() && FLAGS_stepping != "fixed" && FLAGS_stepping != "event") {
    return "--stepping: expected fixed or event, got '" + FLAGS_stepping + "'";
  }
  const std::vector<ExtremeCase> all = extremes::AllCases();
  for (const ExtremeCase& one : all) {
    if ((FLAGS_group.empty() || one.group == FLAGS_group) &&
        (FLAGS_stepping.empty() || one.stepping == FLAGS_stepping) &&
        one.name.find(FLAGS_case) != std::string::npos) {
      cases->push_back(one);
    }
  }
  if (cases->empty()) {
    const bool group = std::any_of(all.begin(), all.end(), [](const ExtremeCase& one) {
      return FLAGS_group.empty() || one.group == FLAGS_group;
    });
    return group ? "--case: no case's name contains '" + FLAGS_case + "'; --list prints them"
                 : "--group: expected one of " + GroupNames(all) + ", got '" + FLAGS_group + "'";
  }
  return "";
}

int Run(const std::vector<ExtremeCase>& cases) {
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  extremes::RunOptions options;
  options.length = FLAGS_long ? extremes::Length::kLong : extremes::Length::kShort;
  options.threads = FLAGS_threads > 0 ? FLAGS_threads : cores;
  Progress progress("cases", static_cast<long>(cases.size()));
  const std::vector<CaseResult> results =
      extremes::RunCases(cases, options, [&](long done) { progress.Show(done); });
  std::cout << ProvenanceLine() << "\n\n" << extremes::TableText(results) << std::flush;
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] {
    OrderedJson json = {{"provenance", OrderedJson::object()}, {"long", FLAGS_long}};
    for (const auto& [what, value] : Provenance()) json["provenance"][what] = value;
    json.update(extremes::ToJson(results));
    return JsonText(json);
  });
  writer.Write(FLAGS_report, [&] { return extremes::Page(results, ProvenanceLine()); });
  if (!writer.error().empty()) return ReportError(writer.error());
  const std::string failure = extremes::FirstFailure(results);
  return failure.empty() ? kExitDone : ReportError("tangible-extremes: " + failure);
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-extremes",
       .synopsis = "[--group=NAME] [--case=NAME] [--long] [--out=R.json] [--report=R.html]",
       .description =
           "Runs the engine at its limits, each case in a process of its own: figures against "
           "bounds, gradients by several\nmethods. Exit status 1 where a bound does not hold, but "
           "for cases that are known not to.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .num_positional = 0,
       .outputs = {"out", "report"}});
  if (line.exit_status) return *line.exit_status;
  std::vector<ExtremeCase> cases;
  const std::string wrong = ChooseCases(&cases);
  if (!wrong.empty()) return ReportError("tangible-extremes: " + wrong, kExitUsage);
  if (FLAGS_list) {
    for (const ExtremeCase& one : cases) {
      std::cout << one.group << ": " << one.name << ", " << one.stepping << "\n";
    }
    return kExitDone;
  }
  return Run(cases);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
