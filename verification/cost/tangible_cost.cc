// SPDX-License-Identifier: Apache-2.0
//
// tangible-cost: measures the cost of a gradient by each method, in time and memory.

#include <gflags/gflags.h>

#include <charconv>
#include <cmath>
#include <iostream>
#include <string>
#include <tuple>
#include <vector>

#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/verification/cost/cost_report.h"
#include "tangible/verification/cost/cost_scene.h"
#include "tangible/verification/cost/motion_cost.h"
#include "tangible/verification/support/provenance.h"

DEFINE_string(parameters, "1,8,64", "numbers of parameters, ascending, separated by commas");
DEFINE_string(steps, "10,100,1000", "numbers of steps, ascending, separated by commas");
DEFINE_bool(full, false,
            "instead of both: 1, 2, 4, ..., 256 parameters and 10, 100, 1000, 10000 steps");
DEFINE_string(stepping, "fixed", "fixed or event (which the tape has not)");
DEFINE_double(budget_seconds, 5.0, "CPU time of a cell, s");
DEFINE_double(budget_mib, 1024.0, "memory of a cell, 2^20 bytes");
DEFINE_double(repeat_seconds, 0.2, "CPU time of the repeats of a cell, s, about");
DEFINE_int32(long_run, 10000, "steps of the run whose adjoint's memory is bounded");
DEFINE_double(adjoint_bound, 2.0,
              "rollouts that the adjoint may take; by events half as many more");
DEFINE_double(tangent_bound, 3.0, "rollouts that the tangent of 8 parameters may take; the same");
DEFINE_double(jet_bound, 4.0, "rollouts that implicit Jets of 8 derivatives may take; the same");
DEFINE_bool(bounds, true, "exit with status 1 where a bound does not hold");
DEFINE_bool(scaling, false,
            "instead of gradients: steps of scenes of many contacts, in motion and settled");
DEFINE_string(discs, "10,100", "with --scaling: numbers of discs that fall, ascending");
DEFINE_string(bouncing, "10", "with --scaling: numbers of discs that bounce, by events, ascending");
DEFINE_string(pyramids, "10", "with --scaling: boxes at the base of pyramids, ascending");
DEFINE_string(out, "", "file of all figures (JSON)");
DEFINE_string(picture, "", "file of a picture of time and memory (SVG)");

namespace tangible {
namespace {

using cost::BoundsText;
using cost::CheckedBound;
using cost::CostBounds;
using cost::CostCell;
using cost::CostMethod;
using cost::CostOptions;
using cost::Crossover;
using cost::kMebibyte;

constexpr int kMostParameters = 4096;
constexpr int kMostSteps = 1000000;

// Reads whole numbers from 1 to `most`, ascending; false if the text is not such a list.
template <typename Number>
bool ReadList(const std::string& text, Number most, std::vector<Number>* list) {
  const char* at = text.data();
  const char* const end = at + text.size();
  for (;;) {
    Number number = 0;
    const auto [rest, error] = std::from_chars(at, end, number);
    if (error != std::errc() || number < 1 || number > most ||
        (!list->empty() && number <= list->back())) {
      return false;
    }
    list->push_back(number);
    if (rest == end) return true;
    if (*rest != ',') return false;
    at = rest + 1;
  }
}

// Empty, or one line about a flag's value.
std::string CheckScaling(cost::MotionOptions* options) {
  const std::tuple<const char*, const std::string&, std::vector<int>*> lists[] = {
      {"--discs", FLAGS_discs, &options->discs},
      {"--bouncing", FLAGS_bouncing, &options->bouncing},
      {"--pyramids", FLAGS_pyramids, &options->pyramids}};
  for (const auto& [flag, text, list] : lists) {
    list->clear();
    if (!ReadList(text, kMostParameters, list)) {
      return std::string(flag) + ": expected ascending numbers from 1 to " +
             std::to_string(kMostParameters) + ", separated by commas, got '" + text + "'";
    }
  }
  return "";
}

int RunScaling(const cost::MotionOptions& options) {
  std::cout << ProvenanceLine() << "\n" << std::flush;
  Progress progress("scenes", cost::NumMotionRows(options));
  const std::vector<cost::MotionRow> rows =
      cost::MeasureAllMotion(options, [&](long done) { progress.Show(done); });
  std::cout << cost::MotionText(rows) << std::flush;
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] {
    OrderedJson json = {{"provenance", OrderedJson::object()}};
    for (const auto& [what, value] : Provenance()) json["provenance"][what] = value;
    json["scenes"] = cost::ToJson(rows);
    return JsonText(json);
  });
  if (!writer.error().empty()) return ReportError(writer.error());
  for (const cost::MotionRow& row : rows) {
    if (!row.message.empty())
      return ReportError("tangible-cost: " + row.scene + ": " + row.message);
  }
  return kExitDone;
}

// Empty, or one line about a flag's value.
std::string CheckFlags(CostOptions* options, CostBounds* bounds) {
  if (FLAGS_full) {
    FLAGS_parameters = "1,2,4,8,16,32,64,128,256";
    FLAGS_steps = "10,100,1000,10000";
  }
  if (FLAGS_stepping != "fixed" && FLAGS_stepping != "event") {
    return "--stepping: expected fixed or event, got '" + FLAGS_stepping + "'";
  }
  const bool by_events = FLAGS_stepping == "event";
  options->stepping = by_events ? Stepping::kEvent : Stepping::kFixed;
  const auto expected = [](const char* flag, int most, const std::string& got) {
    return std::string(flag) + ": expected ascending numbers from 1 to " + std::to_string(most) +
           ", separated by commas, got '" + got + "'";
  };
  if (!ReadList(FLAGS_parameters, kMostParameters, &options->parameters)) {
    return expected("--parameters", kMostParameters, FLAGS_parameters);
  }
  if (!ReadList<long>(FLAGS_steps, kMostSteps, &options->steps)) {
    return expected("--steps", kMostSteps, FLAGS_steps);
  }
  std::string outside = FirstOutside({{"--long_run", FLAGS_long_run, 1, kMostSteps}});
  if (!outside.empty()) return outside;
  const std::pair<const char*, double> positive[] = {
      {"--budget_seconds", FLAGS_budget_seconds}, {"--budget_mib", FLAGS_budget_mib},
      {"--repeat_seconds", FLAGS_repeat_seconds}, {"--adjoint_bound", FLAGS_adjoint_bound},
      {"--tangent_bound", FLAGS_tangent_bound},   {"--jet_bound", FLAGS_jet_bound}};
  for (const auto& [flag, value] : positive) {
    // Above a million seconds or MiB a timer or a limit would overflow.
    if (!(value > 0.0 && value <= 1e6)) {
      return std::string(flag) + ": expected a number > 0 and <= 1e6, got " + FormatNumber(value);
    }
  }
  options->budget = {FLAGS_budget_seconds, static_cast<size_t>(FLAGS_budget_mib * kMebibyte)};
  options->repeat_seconds = FLAGS_repeat_seconds;
  const double share = by_events ? 1.5 : 1.0;
  bounds->adjoint = share * FLAGS_adjoint_bound;
  bounds->tangent = share * FLAGS_tangent_bound;
  bounds->implicit_jet = share * FLAGS_jet_bound;
  bounds->long_run_mib *= share;
  bounds->long_run = FLAGS_long_run;
  return "";
}

std::string Header(const CostOptions& options) {
  const Scene scene = cost::ChainAndBall(1);
  const int numbers = cost::NumNumbers(scene);
  std::string text =
      ProvenanceLine() + "\nchain of 10 links and a ball, dt 0.002 s" +
      (options.stepping == Stepping::kEvent ? ", by events with runge_kutta_4" : "") +
      "; loss: the squares of two positions "
      "at the end; parameters: its " +
      std::to_string(numbers) + " numbers";
  if (options.parameters.back() > numbers) {
    text += ", then patterns that set several, then these again";
  }
  return text + "\nwidest Jet built: " + std::to_string(cost::WidestJetBuilt()) + "\n\n";
}

int Run(const CostOptions& options, const CostBounds& bounds) {
  std::cout << Header(options) << std::flush;
  Progress progress("cells", cost::NumCells(options) + 1);
  const std::vector<CostCell> cells =
      cost::RunCosts(options, [&](long done) { progress.Show(done); });
  std::vector<double> gradient;
  const CostCell long_run = cost::MeasureCell(options, CostMethod::kAdjointWithCheckpoints, 8,
                                              bounds.long_run, {}, &gradient);
  const std::vector<CheckedBound> checked = cost::CheckBounds(bounds, cells, long_run);
  const std::vector<Crossover> crossovers = cost::Crossovers(cells);
  std::cout << cost::TableText(cells) << "\n"
            << cost::CrossoverText(crossovers) << "\n"
            << BoundsText(checked) << std::flush;
  const std::string broken = cost::BrokenBound(checked, cells);
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] {
    OrderedJson json = {{"provenance", OrderedJson::object()}, {"verdict", broken}};
    for (const auto& [what, value] : Provenance()) json["provenance"][what] = value;
    json.update(cost::ToJson(cells, long_run, crossovers, checked));
    return JsonText(json);
  });
  writer.Write(FLAGS_picture, [&] { return cost::Picture(cells); });
  if (!writer.error().empty()) return ReportError(writer.error());
  return broken.empty() || !FLAGS_bounds ? kExitDone : ReportError("tangible-cost: " + broken);
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-cost",
       .synopsis = "[--full | --parameters=N1,N2 --steps=N1,N2] [--stepping=fixed|event] "
                   "[--out=R.json] [--picture=P.svg] | --scaling [--discs=N1,N2] "
                   "[--bouncing=N1,N2] [--pyramids=N1,N2] [--out=R.json]",
       .description =
           "Time and peak memory of the gradient of a rollout by adjoint, tangent, Jets, "
           "differences "
           "and a tape, each cell in a\nprocess of its own. Exit status 1 where a bound does not "
           "hold. With --scaling: times of steps of\nscenes of many contacts, in motion and "
           "settled; "
           "exit status 1 where a step is not solved.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .num_positional = 0,
       .outputs = {"out", "picture"}});
  if (line.exit_status) return *line.exit_status;
  if (FLAGS_scaling) {
    cost::MotionOptions motion;
    const std::string wrong = CheckScaling(&motion);
    return wrong.empty() ? RunScaling(motion) : ReportError("tangible-cost: " + wrong, kExitUsage);
  }
  CostOptions options;
  CostBounds bounds;
  const std::string wrong = CheckFlags(&options, &bounds);
  if (!wrong.empty()) return ReportError("tangible-cost: " + wrong, kExitUsage);
#if defined(__SANITIZE_ADDRESS__)
  // The sanitizer's own memory: its shadow memory, freed blocks, the space around each block.
  bounds.long_run_mib += 512.0;
#endif
  return Run(options, bounds);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
