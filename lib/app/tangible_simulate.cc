// SPDX-License-Identifier: Apache-2.0
//
// tangible-simulate: runs a scene and writes its trajectory, contacts, summary, observations and
// view; or runs it for many vectors of parameters and writes the final states.

#include <gflags/gflags.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <thread>

#include "tangible/app/batch_csv.h"
#include "tangible/app/certificate_json.h"
#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/app/run_recorders.h"
#include "tangible/app/shards.h"
#include "tangible/dynamics/model/settings.h"
#include "tangible/scene/json_writer.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_schema.h"
#include "tangible/simulation/stepping/run_warnings.h"

DEFINE_string(out, "",
              "file of the trajectory (CSV); empty: stdout, unless another result is asked for");
DEFINE_int64(every, 1, "write every so many steps; time 0 and the end always");
DEFINE_string(contacts, "", "file of contacts and joint impulses (CSV)");
DEFINE_string(initial, "", "trajectory (CSV) from whose last row a body the run starts");
DEFINE_string(view, "", "file of the animated view (HTML)");
DEFINE_string(summary, "", "file of the summary (JSON)");
DEFINE_bool(certify, false,
            "add to the summary how near the run is to kinks and jumps of its derivatives");
DEFINE_string(observe, "", "file of noisy observed positions (CSV)");
DEFINE_double(noise, 0.0, "standard deviation of the observations' noise, m");
DEFINE_uint64(seed, 0, "of the noise");
DEFINE_double(rate, 0.0, "observations a second; 0: one a step");
DEFINE_string(points, "", "points to observe instead of bodies (JSON)");
DEFINE_string(batch, "",
              "parameters (CSV: a column a path, a row a rollout); writes final states instead of "
              "a trajectory");
DEFINE_int32(threads, 0, "of a batch, or of a step's islands; 0: one a core");
TANGIBLE_DEFINE_SHARD_FLAGS();

namespace tangible {
namespace {

double WallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool IsDefault(const char* flag) { return gflags::GetCommandLineFlagInfoOrDie(flag).is_default; }

// The same for the flags of batches.
std::string CheckBatchFlags(ShardPlan* plan) {
  std::string wrong = ReadShardFlags(FLAGS_shard, FLAGS_merge, plan);
  if (!wrong.empty()) return wrong;
  if (FLAGS_batch.empty()) {
    if (plan->IsShard()) return "--shard: needs --batch, whose rows it divides";
    return plan->IsMerge() ? "--merge: needs --batch, whose rows it puts together" : "";
  }
  for (const char* name :
       {"every", "contacts", "initial", "view", "summary", "certify", "observe"}) {
    if (!IsDefault(name)) return std::string("--") + name + ": not with --batch";
  }
  return "";
}

// m; a position with this noise is still finite.
constexpr double kMaxNoise = 1e150;

// Empty, or one line about a flag's value.
std::string CheckFlags(ShardPlan* plan) {
  std::string outside = FirstOutside({{"--every", FLAGS_every, 1},
                                      {"--noise", FLAGS_noise, 0, kMaxNoise},
                                      {"--rate", FLAGS_rate, 0},
                                      {"--threads", FLAGS_threads, 0, kMostThreads}});
  if (!outside.empty()) return outside;
  if (FLAGS_certify && FLAGS_summary.empty()) {
    return "--certify: needs --summary";
  }
  if (FLAGS_observe.empty()) {
    for (const char* name : {"noise", "seed", "rate", "points"}) {
      if (!IsDefault(name)) return std::string("--") + name + ": needs --observe";
    }
  }
  return CheckBatchFlags(plan);
}

/// The scene as it is to be run; `error` is one line or empty.
struct Job {
  Scene scene;
  Model<double> model;
  State<double> initial;
  RunRecorders recorders;
  std::string error;
};

// Maximum number of lines of observations, which are written together at the end of the run.
constexpr double kMaxSamples = 1e7;

void MakeRecorders(Job* job) {
  const ModelStructure& structure = *job->model.structure;
  RunRecorders& r = job->recorders;
  const bool others = !FLAGS_view.empty() || !FLAGS_summary.empty() || !FLAGS_observe.empty();
  if (!FLAGS_out.empty() || !others) r.trajectory.emplace(structure, FLAGS_every);
  if (!FLAGS_contacts.empty()) r.contacts.emplace();
  if (!FLAGS_view.empty()) r.view.emplace(job->scene, job->model);
  if (!FLAGS_summary.empty()) r.summary.emplace();
  if (FLAGS_certify) r.certifier.emplace();
  if (FLAGS_observe.empty()) return;
  ObserveOptions options{{}, FLAGS_rate, FLAGS_noise, FLAGS_seed};
  if (!FLAGS_points.empty()) job->error = ReadPoints(FLAGS_points, structure, &options.points);
  const std::size_t points =
      options.points.empty() ? structure.moving.size() : options.points.size();
  const double samples =
      FLAGS_rate * structure.settings.duration * static_cast<double>(std::max<size_t>(points, 1));
  if (samples > kMaxSamples) {
    job->error = "--rate: expected at most 1e7 samples in the run, got " + FormatNumber(samples);
    return;
  }
  r.observations.emplace(structure, std::move(options));
}

// With event stepping nothing is interpolated: steps end at the times of observation.
void EndStepsAtObservations(SimulationSettings* settings) {
  const double samples = FLAGS_rate * settings->duration;
  if (FLAGS_observe.empty() || settings->stepping != Stepping::kEvent ||
      !(samples <= kMaxSamples)) {
    return;
  }
  std::vector<double> times;
  for (long k = 1; FLAGS_rate > 0.0 && static_cast<double>(k) <= samples; ++k) {
    times.push_back(static_cast<double>(k) / FLAGS_rate);
  }
  AddStepTimes(times, settings);
}

void Prepare(const std::string& file, Job* job) {
  if (!LoadScene(file, &job->scene, &job->error)) return;
  std::string why;
  if (!CheckSettings(job->scene, &why)) {
    job->error = file + ": " + why;
    return;
  }
  EndStepsAtObservations(&job->scene.simulation);
  BuildModel(job->scene, &job->model, &job->initial);
  if (!FLAGS_initial.empty() &&
      !ReadInitialState(FLAGS_initial, *job->model.structure, &job->initial, &job->error)) {
    return;
  }
  job->error = CheckInitialState(*job->model.structure, job->initial);
  if (!job->error.empty()) {
    job->error.insert(0, file + ": ");
    return;
  }
  MakeRecorders(job);
}

/// A run that has ended.
struct Done {
  RolloutReport report;
  State<double> last;
  double start = 0.0;        ///< s, wall-clock time
  double cpu_seconds = 0.0;  ///< of the steps
  double rounding = 0.0;     ///< of coordinates over sizes (CoordinateWatch)
  std::vector<std::string> warnings;
};

std::string WriteResults(const Job& job, const Done& run, RunRecorders* r) {
  std::string error;
  const auto write = [&error](const std::string& path, const std::string& text) {
    const std::string failed = WriteResult(path, text);
    if (error.empty()) error = failed;
  };
  if (r->trajectory) write(FLAGS_out, r->trajectory->Finish());
  if (r->contacts) write(FLAGS_contacts, r->contacts->Finish());
  if (r->observations) write(FLAGS_observe, r->observations->Finish());
  if (r->view) write(FLAGS_view, ViewHtml(r->view->data()));
  if (r->summary) {
    OrderedJson summary = r->summary->ToJson(job.model, run.report, run.last);
    summary["rounding_of_coordinates"] = run.rounding;
    summary["warnings"] = run.warnings;
    if (r->certifier) {
      summary["certificate"] = ToJson(r->certifier->Finish(job.model, run.report));
    }
    summary["cpu_seconds"] = run.cpu_seconds;
    summary["seconds"] = WallSeconds() - run.start;
    write(FLAGS_summary, JsonText(summary));
  }
  return error;
}

int Run(const std::string& file) {
  Job job;
  Prepare(file, &job);
  if (!job.error.empty()) return ReportError(job.error);
  const std::string over = OutputOverInput();
  if (!over.empty()) return ReportError(over, kExitUsage);
  Done run;
  RunWarnings warnings(job.model, job.initial);
  run.start = WallSeconds();
  const double cpu_start = CpuSeconds();
  {
    Progress progress("steps", NumSteps(job.scene.simulation));
    const int cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    Stepper stepper(job.model, FLAGS_threads > 0 ? FLAGS_threads : cores);
    run.report = Rollout(
        job.model, job.initial,
        [&](long k, double t, const State<double>& state, Stepper* stepper) {
          job.recorders.Add(job.model, k, t, state, stepper);
          warnings.Add(job.model, k, t, state, stepper);
          progress.Show(k);
        },
        &stepper, &run.last);
  }
  run.cpu_seconds = CpuSeconds() - cpu_start - job.recorders.seconds;
  run.warnings = warnings.Finish(job.model, run.report, run.last);
  run.rounding = warnings.rounding();
  const std::string error = WriteResults(job, run, &job.recorders);
  if (!error.empty()) return ReportError(error);
  // If the run failed, its message says why.
  if (run.report.status != StepStatus::kDone) {
    const std::string coordinates = warnings.CoordinatesMessage(job.model);
    return ReportError(file + ": " + run.report.message +
                       (coordinates.empty() ? "" : "; " + coordinates));
  }
  const std::string warning = file + ": warning: ";
  for (const std::string& line : run.warnings) ReportError(warning + line);
  return kExitDone;
}

// What stderr is told of a row.
struct RowNotes {
  int line = 0;         // of the row, in its file
  std::string message;  // empty unless it failed
  std::vector<std::string> warnings;
};

// Prints the warnings of the first row that has any, with the number of other rows that have some.
void ReportWarnings(const std::vector<RowNotes>& rows) {
  const RowNotes* first = nullptr;
  int others = 0;
  for (const RowNotes& row : rows) {
    if (row.warnings.empty()) continue;
    others += first != nullptr ? 1 : 0;
    first = first == nullptr ? &row : first;
  }
  if (first == nullptr) return;
  std::string place = FLAGS_batch + ": line ";
  place += std::to_string(first->line) + ": warning: ";
  const std::string more = others == 0 ? ""
                                       : " (and " + std::to_string(others) +
                                             (others == 1 ? " more row)" : " more rows)");
  for (std::string line : first->warnings) ReportError(line.insert(0, place).append(more));
}

// Reports what failed, and warnings; returns the exit status.
int Report(const std::vector<RowNotes>& rows) {
  int exit_status = kExitDone;
  for (const RowNotes& row : rows) {
    if (row.message.empty()) continue;
    exit_status =
        ReportError(FLAGS_batch + ": line " + std::to_string(row.line) + ": " + row.message);
  }
  ReportWarnings(rows);
  return exit_status;
}

std::vector<RowNotes> NotesOf(const BatchTable& table, const std::vector<BatchRow>& rows) {
  std::vector<RowNotes> notes;
  for (size_t r = 0; r < rows.size(); ++r) {
    const bool failed = rows[r].status != RolloutStatus::kDone;
    notes.push_back({table.lines[r], failed ? rows[r].message : "", rows[r].warnings});
  }
  return notes;
}

// The same in a shard's file, in which the states stand already: [message, warnings...], or null of
// a row of which nothing is told.
std::vector<Json> ToJson(const std::vector<RowNotes>& notes) {
  std::vector<Json> rows;
  for (const RowNotes& row : notes) {
    Json told;
    if (!row.message.empty() || !row.warnings.empty()) {
      told = Json::array({row.message});
      for (const std::string& warning : row.warnings) told.push_back(warning);
    }
    rows.push_back(std::move(told));
  }
  return rows;
}

// Puts the shards' rows together; nothing is run.
int MergeRows(const ShardPlan& plan, const BatchTable& table) {
  MergedShards merged;
  std::string error = MergeShards(plan, table.values.rows(), &merged);
  if (!error.empty()) return ReportError(error);
  std::string text;
  if (!MergeBatchCsv(merged.texts, table.values.rows(), &text, &error)) return ReportError(error);
  std::vector<RowNotes> notes;
  for (const Json& told : merged.rows) {
    RowNotes row{table.lines[notes.size()], "", {}};
    for (size_t i = 0; i < told.size(); ++i) {
      (i == 0 ? row.message : row.warnings.emplace_back()) = told[i].get<std::string>();
    }
    notes.push_back(std::move(row));
  }
  error = WriteResult(FLAGS_out, text);
  return error.empty() ? Report(notes) : ReportError(error);
}

// Runs all rows of a table, or those of a shard; those that fail are reported, the others written.
int RunRows(const std::string& file, const ShardPlan& plan) {
  Scene scene;
  BatchTable table;
  std::string error;
  if (!LoadScene(file, &scene, &error)) return ReportError(error);
  if (!CheckSettings(scene, &error)) return ReportError(error.insert(0, file + ": "));
  if (!ReadBatch(FLAGS_batch, scene, &table, &error)) return ReportError(error);
  if (plan.part != ShardPlan::Part::kAll) error = HashInputs();
  if (!error.empty()) return ReportError(error);
  if (plan.IsMerge()) return MergeRows(plan, table);
  const long rows_in_all = table.values.rows();
  table = RowsOf(plan.shard, std::move(table));
  BatchResult batch;
  {
    Progress progress("rollouts", table.values.rows());
    batch = RunBatch(scene, table.parameters, table.values, {.threads = FLAGS_threads},
                     [&progress](long done) { progress.Show(done); });
  }
  if (!batch.message.empty()) return ReportError(error.append(file + ": ").append(batch.message));
  const std::vector<RowNotes> notes = NotesOf(table, batch.rows);
  std::string text = BatchCsv(*BuildStructure(scene), batch.rows, plan.shard);
  if (plan.IsShard()) {
    text = WithShard(std::move(text), plan.shard, rows_in_all, ToJson(notes));
  }
  error = WriteResult(FLAGS_out, text);
  return error.empty() ? Report(notes) : ReportError(error);
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-simulate",
       .synopsis =
           "SCENE.json [--out=T.csv] [--every=K] [--contacts=C.csv] [--initial=T.csv] "
           "[--view=V.html] [--summary=S.json] [--certify] [--observe=O.csv --noise=S --seed=N "
           "--rate=HZ --points=P.json] | --batch=PARAMETERS.csv [--out=F.csv] [--threads=T] "
           "[--shard=I/N | --merge=F0.csv,F1.csv,...]",
       .description = "Runs a scene and writes the trajectory of its bodies as CSV; on request "
                      "contacts, a summary,\nnoisy observations and an animated view. With "
                      "--batch runs it for each row of a table of parameters and\nwrites the final "
                      "states.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .outputs = {"out", "contacts", "view", "summary", "observe"},
       .inputs = {"initial", "points", "batch"},
       .schema = [] { return JsonText(SceneSchema()); }});
  if (line.exit_status) return *line.exit_status;
  ShardPlan plan;
  const std::string wrong = CheckFlags(&plan);
  if (!wrong.empty()) {
    return ReportError("tangible-simulate: " + wrong, kExitUsage);
  }
  return FLAGS_batch.empty() ? Run(line.positional[0]) : RunRows(line.positional[0], plan);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
