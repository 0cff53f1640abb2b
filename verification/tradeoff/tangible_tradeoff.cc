// SPDX-License-Identifier: Apache-2.0
//
// tangible-tradeoff: errors of a scene's trajectory and gradient over CPU time, for many settings
// of its simulation.

#include <gflags/gflags.h>

#include <algorithm>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/scene/csv.h"
#include "tangible/scene/scene_json.h"
#include "tangible/verification/support/provenance.h"
#include "tangible/verification/tradeoff/tradeoff_report.h"

DEFINE_string(parameters, "", "paths, separated by commas; empty: a few that the scene has");
DEFINE_double(
    target_error, 0.0,
    "print the simulation block of the cheapest settings with at most this error, instead "
    "of the table; 0: none");
DEFINE_string(target, "both", "whose error: trajectory, gradient or both");
DEFINE_string(dt_factors, "8,4,2,1,0.5,0.25,0.125", "steps tried, in the scene's dt");
DEFINE_bool(full, false, "every combination of settings, not only one change at a time");
DEFINE_double(budget, 2.0, "CPU time of one rollout with its gradient, s");
DEFINE_double(repeat_seconds, 0.1, "CPU time of the repeats of a cell, s, about");
DEFINE_double(reference_error, 1e-10, "at which the reference is fine enough");
DEFINE_double(reference_seconds, 20.0, "CPU time of the reference, s, about");
DEFINE_int32(threads, 1, "of the cells; with more than one they disturb each other's times");
DEFINE_string(out, "", "file of all figures (JSON)");
DEFINE_string(report, "", "file of pictures and all cells (HTML)");
DEFINE_string(picture, "", "file of a picture of errors over time (SVG)");

namespace tangible {
namespace {

using tradeoff::Target;
using tradeoff::Tradeoff;
using tradeoff::TradeoffOptions;

constexpr int kMostScenes = 8;
constexpr double kMostSteps = 1e6;
constexpr double kLeastFactor = 1e-6;
constexpr double kMostFactor = 1e6;

// Empty, or one line about a flag's value.
std::string CheckFlags(size_t scenes, TradeoffOptions* options, Target* target) {
  for (const std::string& text : SplitAtCommas(FLAGS_dt_factors)) {
    double factor = 0.0;
    if (!ParseNumber(text, &factor) || factor < kLeastFactor || factor > kMostFactor) {
      return "--dt_factors: expected numbers from 1e-6 to 1e6, separated by commas, got '" +
             FLAGS_dt_factors + "'";
    }
    options->dt_factors.push_back(factor);
  }
  const std::pair<const char*, double> positive[] = {
      {"--budget", FLAGS_budget},
      {"--repeat_seconds", FLAGS_repeat_seconds},
      {"--reference_error", FLAGS_reference_error},
      {"--reference_seconds", FLAGS_reference_seconds}};
  for (const auto& [flag, value] : positive) {
    if (!(value > 0.0 && value <= 1e6)) {
      return std::string(flag) + ": expected a number > 0 and <= 1e6, got " + FormatNumber(value);
    }
  }
  if (!(FLAGS_target_error >= 0.0 && FLAGS_target_error <= 1e6)) {
    return "--target_error: expected a number > 0 and <= 1e6, got " +
           FormatNumber(FLAGS_target_error);
  }
  std::string outside = FirstOutside({{"--threads", FLAGS_threads, 1, kMostThreads}});
  if (!outside.empty()) return outside;
  if (FLAGS_target != "both" && FLAGS_target != "trajectory" && FLAGS_target != "gradient") {
    return "--target: expected trajectory, gradient or both, got '" + FLAGS_target + "'";
  }
  if (FLAGS_target_error > 0.0 && scenes > 1) return "--target_error: expected one scene with it";
  *target = FLAGS_target == "both"         ? Target::kBoth
            : FLAGS_target == "trajectory" ? Target::kTrajectory
                                           : Target::kGradient;
  options->sweep = FLAGS_full ? tradeoff::SweepKind::kFull : tradeoff::SweepKind::kStar;
  options->budget_seconds = FLAGS_budget;
  options->repeat_seconds = FLAGS_repeat_seconds;
  options->reference_error = FLAGS_reference_error;
  options->reference_seconds = FLAGS_reference_seconds;
  options->threads = FLAGS_threads;
  return "";
}

// Loads the scene and its parameters; returns a message or empty.
std::string Load(const std::string& file, const TradeoffOptions& options, Scene* scene,
                 std::vector<ParameterPath>* parameters) {
  std::string error;
  if (!LoadScene(file, scene, &error)) return error;
  const std::string place = file + ": ";
  if (!(scene->simulation.duration > 0.0)) {
    return place + "/simulation/duration: expected a number > 0, got 0";
  }
  if (std::none_of(scene->bodies.begin(), scene->bodies.end(),
                   [](const auto& body) { return body.motion == Motion::kMoving; })) {
    return place + "/bodies: expected a moving body, got none";
  }
  const double steps =
      scene->simulation.duration /
      tradeoff::StepLengths(scene->simulation, options.samples, options.dt_factors)[0];
  if (steps > kMostSteps) {
    return place + "/simulation/dt: expected at most 1e6 steps of the longest that is tried, got " +
           FormatNumber(steps);
  }
  if (FLAGS_parameters.empty()) {
    *parameters = tradeoff::DefaultParameters(*scene);
    return "";
  }
  for (const std::string& path : SplitAtCommas(FLAGS_parameters)) {
    if (!ResolveParameter(*scene, path, &parameters->emplace_back(), &error)) return place + error;
  }
  return "";
}

std::string WriteFiles(const std::vector<Tradeoff>& tradeoffs) {
  ResultWriter writer;
  writer.Write(FLAGS_out, [&] {
    OrderedJson json = {{"provenance", OrderedJson::object()}, {"scenes", OrderedJson::array()}};
    for (const auto& [what, value] : Provenance()) json["provenance"][what] = value;
    for (const Tradeoff& one : tradeoffs) json["scenes"].push_back(tradeoff::ToJson(one));
    return JsonText(json);
  });
  writer.Write(FLAGS_report, [&] { return tradeoff::Page(tradeoffs, ProvenanceLine()); });
  writer.Write(FLAGS_picture, [&] { return tradeoff::Picture(tradeoffs); });
  return writer.error();
}

int Run(const std::vector<std::string>& files, const TradeoffOptions& options, Target target) {
  const bool table = FLAGS_target_error == 0.0;
  std::vector<Scene> scenes(files.size());
  std::vector<std::vector<ParameterPath>> parameters(files.size());
  for (size_t i = 0; i < files.size(); ++i) {
    const std::string error = Load(files[i], options, &scenes[i], &parameters[i]);
    if (!error.empty()) return ReportError(error);
  }
  const std::string over = OutputOverInput();
  if (!over.empty()) return ReportError(over, kExitUsage);
  if (table) std::cout << ProvenanceLine() << "\n" << std::flush;
  std::vector<Tradeoff> tradeoffs;
  for (size_t i = 0; i < files.size(); ++i) {
    std::optional<Progress> progress;
    tradeoffs.push_back(RunTradeoff(scenes[i], parameters[i], options, [&](long done, long total) {
      if (!progress) progress.emplace("cells", total);
      progress->Show(done);
    }));
    progress.reset();
    if (!tradeoffs[i].message.empty()) {
      // The engine's own messages begin with the file's name.
      const std::string& why = tradeoffs[i].message;
      return ReportError(why.find(files[i]) != std::string::npos ? why : files[i] + ": " + why);
    }
    if (table) std::cout << "\n" << TableText(tradeoffs[i]) << std::flush;
  }
  const std::string error = WriteFiles(tradeoffs);
  if (!error.empty()) return ReportError(error);
  if (table) return kExitDone;
  const tradeoff::Cell* cell = Cheapest(tradeoffs[0], target, FLAGS_target_error);
  if (cell == nullptr) {
    return ReportError(files[0] + ": " + WhyNone(tradeoffs[0], FLAGS_target_error));
  }
  std::cout << tradeoff::SimulationBlock(scenes[0], cell->settings) << std::flush;
  return kExitDone;
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-tradeoff",
       .synopsis = "SCENE.json [SCENE2.json ...] [--target_error=E] [--parameters=P1,P2] "
                   "[--out=R.json] [--report=R.html] [--picture=P.svg]",
       .description =
           "Errors of a scene's trajectory and of the gradient of its final state against CPU "
           "time, over time step,\nstepping, integrator, joint correction and tolerance; with a "
           "target the cheapest simulation\nblock that meets it.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .most_positional = kMostScenes,
       .outputs = {"out", "report", "picture"}});
  if (line.exit_status) return *line.exit_status;
  TradeoffOptions options;
  options.dt_factors.clear();
  Target target = Target::kBoth;
  const std::string wrong = CheckFlags(line.positional.size(), &options, &target);
  if (!wrong.empty()) return ReportError("tangible-tradeoff: " + wrong, kExitUsage);
  return Run(line.positional, options, target);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
