// SPDX-License-Identifier: Apache-2.0
//
// tangible-control: finds the forces and efforts with which a scene minimises a cost.

#include <gflags/gflags.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "tangible/app/control_output.h"
#include "tangible/app/control_problem.h"
#include "tangible/app/control_run.h"
#include "tangible/app/control_schema.h"
#include "tangible/app/program.h"
#include "tangible/scene/json_writer.h"
#include "tangible/scene/scene_json.h"

DEFINE_bool(mpc, false, "receding horizon: plan anew in each step, and play the first control");
DEFINE_string(plant, "", "with --mpc: the scene that is controlled; empty: the problem's own");
DEFINE_double(budget_ms, 0.0,
              "with --mpc: time of each plan, ms; 0: a number of iterations, with the same result "
              "on any machine");
DEFINE_int32(threads, 0,
             "of starts and sampling; 0: one a core; results do not depend on their number");
DEFINE_string(out, "", "file of the result (JSON); empty: stdout");
DEFINE_string(plan, "", "file of the controls, a row a step (CSV)");
DEFINE_string(trajectory, "", "file of the motion (CSV)");
DEFINE_string(view, "", "file of the animated view, with the plan (HTML)");

namespace tangible {
namespace {

std::string CheckFlags() {
  std::string outside = FirstOutside(
      {{"--budget_ms", FLAGS_budget_ms, 0}, {"--threads", FLAGS_threads, 0, kMostThreads}});
  if (!outside.empty()) return outside;
  if (!FLAGS_mpc && !FLAGS_plant.empty()) return "--plant: needs --mpc";
  if (!FLAGS_mpc && FLAGS_budget_ms > 0.0) return "--budget_ms: needs --mpc";
  return "";
}

// A plan's numbers beside those of its replay, on a terminal, where the result goes to a file.
void PrintBesideMotion(const ControlRun& run) {
  const std::vector<std::vector<std::string>>& rows = run.beside_motion;
  constexpr size_t kMostRows = 31;
  std::printf("%s\n%-28s %16s %16s\n", run.verdict.status.c_str(), "", "planned", "by events");
  for (size_t i = 0; i < std::min(rows.size(), kMostRows); ++i) {
    std::printf("%-28s %16s %16s\n", rows[i][0].c_str(), rows[i][1].c_str(), rows[i][2].c_str());
  }
  if (rows.size() > kMostRows) {
    std::printf("... (%zu more numbers in the result)\n", rows.size() - kMostRows);
  }
}

// Prints the warnings, and writes the result and what else is asked for: the controls as a table,
// the motion as a table and as a page.
std::string WriteRun(const std::string& path, const ControlFile& file, const ControlRun& run) {
  const std::string start = path + ": warning: ";
  for (const std::string& warning : run.warnings) ReportError(std::string(start).append(warning));
  std::vector<OutputFile> files = {{FLAGS_out, JsonText(run.result)}};
  if (!FLAGS_plan.empty()) files.push_back({FLAGS_plan, PlanCsv(file, run)});
  if (FLAGS_trajectory.empty() && FLAGS_view.empty()) return WriteAllOrNone(files);
  DrawnMotion drawn;
  std::string error = DrawMotion(file, run, &drawn);
  if (!error.empty()) return error;
  if (!FLAGS_trajectory.empty()) files.push_back({FLAGS_trajectory, std::move(drawn.trajectory)});
  if (!FLAGS_view.empty()) files.push_back({FLAGS_view, std::move(drawn.page)});
  return WriteAllOrNone(files);
}

int ReportVerdict(const std::string& path, const ControlRun& run) {
  if (run.verdict.holds) return kExitDone;
  return ReportError(path + ": " + run.verdict.status + ": " + run.verdict.message);
}

int WritePlan(const std::string& path, const ControlFile& file) {
  ControlRun run;
  std::string error = MakePlan(path, file, {.threads = FLAGS_threads}, &run);
  if (error.empty()) error = WriteRun(path, file, run);
  if (!error.empty()) return ReportError(error);
  if (!FLAGS_out.empty()) PrintBesideMotion(run);
  return ReportVerdict(path, run);
}

int Predict(const std::string& path, const ControlFile& file) {
  Scene plant = file.scene;
  std::string error;
  if (!FLAGS_plant.empty()) {
    if (!LoadScene(FLAGS_plant, &plant, &error)) return ReportError(error);
    error = CheckPlant(file, plant, FLAGS_plant);
    if (!error.empty()) return ReportError(error);
  }
  ControlRun run;
  const ControlRunOptions options{.threads = FLAGS_threads, .budget = FLAGS_budget_ms / 1000.0};
  error = RunPredictive(path, file, plant, FLAGS_plant.empty() ? file.scene_path : FLAGS_plant,
                        options, &run);
  if (error.empty()) error = WriteRun(path, file, run);
  return error.empty() ? ReportVerdict(path, run) : ReportError(error);
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-control",
       .synopsis =
           "PROBLEM.json [--out=R.json] [--plan=U.csv] [--trajectory=T.csv] [--view=V.html] "
           "[--threads=N] [--mpc [--plant=SCENE.json] [--budget_ms=T]]",
       .description =
           "Plans forces and efforts of a scene, within bounds, so that a cost is least: "
           "iLQR over the\nengine's exact step derivatives. With --mpc controls a plant "
           "with plans over a receding horizon.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .outputs = {"out", "plan", "trajectory", "view"},
       .inputs = {"plant"},
       .schema = [] { return JsonText(ControlSchema()); }});
  if (line.exit_status) return *line.exit_status;
  const std::string wrong = CheckFlags();
  if (!wrong.empty()) return ReportError("tangible-control: " + wrong, kExitUsage);
  ControlFile file;
  std::string error;
  if (!LoadControlFile(line.positional[0], &file, &error)) return ReportError(error);
  const std::string over = OutputOverInput();
  if (!over.empty()) return ReportError(over, kExitUsage);
  return FLAGS_mpc ? Predict(line.positional[0], file) : WritePlan(line.positional[0], file);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
