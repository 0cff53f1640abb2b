// SPDX-License-Identifier: Apache-2.0
//
// tangible-bounce: plans through a bounce from random starts, with several derivatives.

#include <gflags/gflags.h>

#include <algorithm>
#include <iostream>
#include <string>
#include <thread>

#include "tangible/app/program.h"
#include "tangible/app/progress.h"
#include "tangible/app/row_archive.h"
#include "tangible/app/shards.h"
#include "tangible/math/median.h"
#include "tangible/scene/json_writer.h"
#include "tangible/scene/scene_json.h"
#include "tangible/verification/control/bounce_study.h"
#include "tangible/verification/support/provenance.h"

DEFINE_int32(problems, 100, "random problems");
DEFINE_int32(seed, 1, "of the problems");
DEFINE_int32(
    pieces, 1,
    "pieces of the efforts that bring the ball to the cup: 1: held, in the strokes' range");
DEFINE_string(methods, "exact,extended,surrogate,starts,sampling,fixed", "those that plan");
DEFINE_int32(starts, 5, "of the method starts");
DEFINE_int32(iterations, 60, "of each plan, at most");
DEFINE_int32(threads, 0, "problems at the same time; 0: one a core; results do not depend on it");
DEFINE_string(out, "", "file of all outcomes (JSON)");
TANGIBLE_DEFINE_SHARD_FLAGS();

namespace tangible {
namespace bounce {

// What a shard keeps of a row. That no field is left out the compiler checks.
template <typename Visitor>
void VisitFields(Outcome& outcome, const Visitor& visit) {
  auto& [distance, believed, iterations, cpu_seconds] = outcome;
  visit("distance", distance);
  visit("believed", believed);
  visit("iterations", iterations);
  visit("cpu_seconds", cpu_seconds);
}

template <typename Visitor>
void VisitFields(Problem& problem, const Visitor& visit) {
  auto& [scene, effort, cup, ball, ball_speed] = problem;
  static_cast<void>(scene);  // rows have none
  visit("effort", effort);
  visit("cup", cup);
  visit("ball", ball);
  visit("ball_speed", ball_speed);
}

template <typename Visitor>
void VisitFields(Row& row, const Visitor& visit) {
  auto& [problem, outcomes, fixed] = row;
  visit("problem", problem);
  visit("outcomes", outcomes);
  visit("fixed", fixed);
}

}  // namespace bounce

namespace {

constexpr int kMostProblems = 100000;

// Those that --methods names; false where it names another.
bool ReadMethods(std::vector<bounce::Method>* methods) {
  for (const std::string& name : SplitAtCommas(FLAGS_methods)) {
    const auto* found =
        std::find_if(std::begin(bounce::kMethods), std::end(bounce::kMethods),
                     [&](bounce::Method method) { return name == bounce::NameOf(method); });
    if (found == std::end(bounce::kMethods)) return false;
    methods->push_back(*found);
  }
  return true;
}

std::string CheckFlags(ShardPlan* plan) {
  std::string wrong = ReadShardFlags(FLAGS_shard, FLAGS_merge, FLAGS_out, plan);
  if (!wrong.empty()) return wrong;
  std::vector<bounce::Method> methods;
  if (!ReadMethods(&methods)) {
    return "--methods: expected some of exact, extended, surrogate, starts, sampling, fixed, got " +
           FLAGS_methods;
  }
  return FirstOutside({{"--problems", FLAGS_problems, 1, kMostProblems},
                       {"--seed", FLAGS_seed, 0},
                       {"--pieces", FLAGS_pieces, 1, 100},
                       {"--starts", FLAGS_starts, 2, 1000},
                       {"--iterations", FLAGS_iterations, 1, kMostProblems},
                       {"--threads", FLAGS_threads, 0, kMostThreads}});
}

// Of one method over all problems.
struct Column {
  int successes = 0, away = 0, successes_away = 0;
  double distance = 0.0, believed = 0.0, iterations = 0.0, seconds = 0.0;
};

Column ColumnOf(const std::vector<bounce::Row>& rows, size_t method) {
  Column column;
  std::vector<double> distance, believed, iterations, seconds;
  for (std::vector<double>* values : {&distance, &believed, &iterations, &seconds}) {
    values->reserve(rows.size());
  }
  for (const bounce::Row& row : rows) {
    const bounce::Outcome& outcome = row.outcomes[method];
    const bool away = row.fixed == bounce::Direction::kUp;
    column.successes += outcome.Success() ? 1 : 0;
    column.away += away ? 1 : 0;
    column.successes_away += away && outcome.Success() ? 1 : 0;
    distance.push_back(outcome.distance);
    believed.push_back(outcome.believed);
    iterations.push_back(outcome.iterations);
    seconds.push_back(outcome.cpu_seconds);
  }
  column.distance = UpperMedian(distance);
  column.believed = UpperMedian(believed);
  column.iterations = UpperMedian(iterations);
  column.seconds = UpperMedian(seconds);
  return column;
}

OrderedJson Print(const std::vector<bounce::Row>& rows,
                  const std::vector<bounce::Method>& methods) {
  int up = 0, nothing = 0;
  for (const bounce::Row& row : rows) {
    up += row.fixed == bounce::Direction::kUp ? 1 : 0;
    nothing += row.fixed == bounce::Direction::kNothing ? 1 : 0;
  }
  std::printf(
      "a step against the fixed steps' gradient at the start raises the true cost in %d of %zu "
      "problems; in %d one of both gradients is zero, as the ball is not struck\n\n",
      up, rows.size(), nothing);
  std::printf("%-10s %10s %18s %12s %12s %11s %10s\n", "method", "successes", "of those led away",
              "distance (m)", "believed (m)", "iterations", "CPU (s)");
  OrderedJson list = OrderedJson::array();
  for (const bounce::Method of : methods) {
    const auto method = static_cast<size_t>(of);
    const Column column = ColumnOf(rows, method);
    const char* name = bounce::NameOf(of);
    std::printf("%-10s %10d %11d of %3d %12.4f %12.4f %11.0f %10.2f\n", name, column.successes,
                column.successes_away, column.away, column.distance, column.believed,
                column.iterations, column.seconds);
    OrderedJson outcomes = OrderedJson::array();
    for (const bounce::Row& row : rows) {
      outcomes.push_back({{"distance", row.outcomes[method].distance},
                          {"believed", row.outcomes[method].believed},
                          {"iterations", row.outcomes[method].iterations}});
    }
    list.push_back(
        {{"method", name}, {"successes", column.successes}, {"outcomes", std::move(outcomes)}});
  }
  OrderedJson drawn = OrderedJson::array();
  for (const bounce::Row& row : rows) {
    const bounce::Problem& one = row.problem;
    drawn.push_back({{"ball", {one.ball.x(), one.ball.y()}},
                     {"ball_speed", one.ball_speed},
                     {"effort", one.effort},
                     {"cup", {one.cup.x(), one.cup.y()}}});
  }
  return {{"problems", rows.size()},
          {"drawn", std::move(drawn)},
          {"fixed_gradient_leads_away", up},
          {"a_gradient_is_zero", nothing},
          {"methods", std::move(list)}};
}

// Runs the problems of the plan's part, or reads all of them from the shards; an error or empty.
std::string RowsOf(const Scene& scene, const ShardPlan& plan,
                   const std::vector<bounce::Method>& methods, std::vector<bounce::Row>* rows) {
  std::string error;
  if (plan.IsMerge()) {
    MergedShards merged;
    error = MergeShards(plan, FLAGS_problems, &merged);
    if (error.empty()) FromRows(merged.rows, rows, &error);
    return error;
  }
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const long problems = plan.shard.NumRows(FLAGS_problems);
  Progress progress("problems", problems);
  *rows = bounce::Run(scene,
                      {.seed = static_cast<unsigned>(FLAGS_seed),
                       .problems = static_cast<int>(problems),
                       .first = static_cast<int>(plan.shard.index),
                       .stride = static_cast<int>(plan.shard.count),
                       .pieces = FLAGS_pieces,
                       .iterations = FLAGS_iterations,
                       .starts = FLAGS_starts,
                       .threads = FLAGS_threads > 0 ? FLAGS_threads : cores,
                       .methods = methods},
                      [&](long done) { progress.Show(done); });
  return error;
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-bounce",
       .synopsis =
           "SCENE.json [--problems=N] [--seed=S] [--pieces=P] [--iterations=K] [--out=R.json] "
           "[--shard=I/N | --merge=R0.json,R1.json,...]",
       .description =
           "Plans how a hammer strikes a falling ball so that it bounces into a cup, from random "
           "starts: with exact\nJacobians of event steps, with the reference extended across "
           "impacts, with a sampled surrogate, from several starts, from a sampled one, with fixed "
           "steps.\nThe scene has bodies hammer and "
           "ball and a joint slider, as data/control/struck_ball.json.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .outputs = {"out"}});
  if (line.exit_status) return *line.exit_status;
  ShardPlan plan;
  const std::string wrong = CheckFlags(&plan);
  if (!wrong.empty()) return ReportError("tangible-bounce: " + wrong, kExitUsage);
  Scene scene;
  std::string error;
  if (!LoadScene(line.positional[0], &scene, &error)) return ReportError(error);
  error = bounce::CheckScene(scene);
  if (!error.empty()) return ReportError(line.positional[0] + ": " + error);
  if (plan.part != ShardPlan::Part::kAll) error = HashInputs();
  if (!error.empty()) return ReportError(error);
  error = OutputOverInput();
  if (!error.empty()) return ReportError(error, kExitUsage);
  std::vector<bounce::Method> methods;
  ReadMethods(&methods);
  std::vector<bounce::Row> rows;
  error = RowsOf(scene, plan, methods, &rows);
  if (!error.empty()) return ReportError(error);
  std::cout << ProvenanceLine() << "; seed " << FLAGS_seed << ", cups by efforts of "
            << FLAGS_pieces << (FLAGS_pieces == 1 ? " piece" : " pieces") << "\n\n"
            << std::flush;
  OrderedJson json = Print(rows, methods);
  json["seed"] = FLAGS_seed;
  json["pieces"] = FLAGS_pieces;
  if (plan.IsShard()) json["shard"] = ShardJson(plan.shard, FLAGS_problems, ToRows(rows));
  if (!FLAGS_out.empty()) error = WriteResult(FLAGS_out, JsonText(json));
  return error.empty() ? kExitDone : ReportError(error);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
