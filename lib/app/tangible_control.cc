// SPDX-License-Identifier: Apache-2.0
//
// tangible-control: finds the forces and efforts with which a scene minimises a cost.

#include <gflags/gflags.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <optional>
#include <string>
#include <vector>

#include "tangible/app/certificate_json.h"
#include "tangible/app/control_problem.h"
#include "tangible/app/control_schema.h"
#include "tangible/app/program.h"
#include "tangible/app/trajectory_csv.h"
#include "tangible/app/view_recorder.h"
#include "tangible/control/model_predictive.h"
#include "tangible/control/plan_search.h"
#include "tangible/control/replay.h"
#include "tangible/control/unreached_targets.h"
#include "tangible/math/median.h"
#include "tangible/render/html.h"
#include "tangible/render/plot.h"
#include "tangible/scene/json_writer.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_names.h"

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

std::vector<double> ToVector(const VectorX<double>& values) {
  return {values.data(), values.data() + values.size()};
}

// The planned or applied controls, and the motion.
struct Played {
  RowMatrixXd states, controls;
  double cost = 0.0;
};

// A plan's status and message: the optimiser's own, or why the plan does not hold.
struct Verdict {
  std::string status, message;
  bool holds = true;
};

// A plan, and what became of it in the motion.
struct Judged {
  IlqrResult result;
  double seconds = 0.0;  // CPU
  Replay replay;
  double cost_of_nothing = 0.0;
  Verdict verdict;
  Certificate certificate;
  SearchResult search;  // without `best`, which is the result
};

// Adds the largest entries of the columns of B, a control each.
void AddEffect(const MatrixX<double>& b, VectorX<double>* effect) {
  *effect += b.cwiseAbs().colwise().maxCoeff().transpose();
}

// Finds a control that moves nothing in any step of the motion with these controls, and with a
// surrogate in none of its samples either. Empty, or an error of one line. Where a step cannot be
// made only those before it count.
std::string FindIdle(const ControlProblem& problem, const ControlFile& file,
                     const RolloutFunction& function, const RowMatrixXd& controls) {
  const long steps = controls.rows();
  Model<double> model;
  State<double> state;
  BuildModel(function.scene(), &model, &state);
  double heaviest = 0.0;
  for (const int body : model.structure->moving) {
    const BodyIndex& index = model.structure->bodies[body];
    heaviest = std::max({heaviest, model.parameters[index.mass], model.parameters[index.inertia]});
  }
  const double least = kMovesNothing * file.scene.simulation.dt / heaviest;
  VectorX<double> effect = VectorX<double>::Zero(problem.map->num_controls());
  VectorX<double> x = problem.initial, next;
  MatrixX<double> a, b;
  std::string error;
  for (long k = 0; k < steps && effect.minCoeff() <= least; ++k) {
    if (!problem.map->Linearise(k, x, controls.row(k), &next, &a, &b, &error)) return "";
    AddEffect(b, &effect);
    x = next;
  }
  if (effect.minCoeff() <= least && file.options.surrogate.samples > 0) {
    Plan plan;
    plan.controls = controls;
    plan.states = problem.initial.transpose();
    std::vector<MatrixX<double>> mean_a(steps, a), mean_b(steps, MatrixX<double>(0.0 * b));
    AverageJacobians(problem, plan, file.options.surrogate, &mean_a, &mean_b);
    for (const MatrixX<double>& one : mean_b) AddEffect(one, &effect);
  }
  Eigen::Index idle = 0;
  if (effect.minCoeff(&idle) > least) return "";
  return "/controls/" + std::to_string(idle) +
         "/path: expected a control that moves something, got " + file.paths[idle] +
         ", which moves nothing in any step with the initial controls";
}

OrderedJson DescribeControls(const ControlFile& file, const RowMatrixXd& controls, double dt) {
  OrderedJson json = {
      {"paths", file.paths}, {"times", OrderedJson::array()}, {"values", OrderedJson::array()}};
  for (Eigen::Index k = 0; k < controls.rows(); ++k) {
    json["times"].push_back(static_cast<double>(k) * dt);
    json["values"].push_back(ToVector(controls.row(k)));
  }
  return json;
}

std::string PlanCsv(const ControlFile& file, const RowMatrixXd& controls, double dt) {
  std::string text = "time";
  for (const std::string& path : file.paths) text += "," + path;
  text += "\n";
  for (Eigen::Index k = 0; k < controls.rows(); ++k) {
    AppendNumber(static_cast<double>(k) * dt, &text);
    for (Eigen::Index i = 0; i < controls.cols(); ++i) {
      text += ",";
      AppendNumber(controls(k, i), &text);
    }
    text += "\n";
  }
  return text;
}

std::string ControlPlot(const ControlFile& file, const RowMatrixXd& controls, double dt) {
  std::vector<PlotSeries> series;
  for (Eigen::Index i = 0; i < controls.cols(); ++i) {
    PlotSeries& one = series.emplace_back();
    one.label = file.paths[i];
    for (Eigen::Index k = 0; k < controls.rows(); ++k) {
      for (const Eigen::Index end : {k, k + 1}) {
        one.x.push_back(static_cast<double>(end) * dt);
        one.y.push_back(controls(k, i));
      }
    }
  }
  return PlotSvg({.title = "Controls", .x_label = "time (s)", .y_label = "N or N m"}, series);
}

std::string CostPlot(const std::vector<IlqrIteration>& iterations) {
  PlotSeries series;
  series.style = PlotStyle::kLineAndPoints;
  for (const IlqrIteration& iteration : iterations) {
    series.x.push_back(static_cast<double>(series.x.size()));
    series.y.push_back(iteration.cost);
  }
  return PlotSvg({.title = "Cost",
                  .x_label = "iteration",
                  .y_label = "cost",
                  .y_scale = AxisScale::kLogarithmic},
                 {series});
}

// Writes the result and what else is asked for: the controls as a table, the motion as a table and
// as a view, with `below` under it.
std::string WriteResults(const ControlFile& file, Scene scene, const Played& played,
                         const std::string& below, const OrderedJson& result) {
  const double dt = scene.simulation.dt;
  std::vector<OutputFile> files = {{FLAGS_out, JsonText(result)}};
  if (!FLAGS_plan.empty()) files.push_back({FLAGS_plan, PlanCsv(file, played.controls, dt)});
  if (FLAGS_trajectory.empty() && FLAGS_view.empty()) return WriteAllOrNone(files);
  scene.simulation.duration = static_cast<double>(played.controls.rows()) * dt;
  RolloutFunction function;
  std::string error = function.Create(scene, {}, file.paths, {});
  if (!error.empty()) return error;
  const EngineStep step(function);
  Model<double> model;
  State<double> initial;
  BuildModel(scene, &model, &initial);
  TrajectoryCsv trajectory(*model.structure, 1);
  ViewRecorder view(scene, model);
  // The planned motion is written: a run of all steps at once would differ only by rounding.
  for (Eigen::Index k = 0; k < played.states.rows(); ++k) {
    const State<double> state = step.StateOf(k, played.states.row(k));
    const double t = static_cast<double>(k) * dt;
    trajectory.Add(k, t, state);
    view.Add(model, t, state, nullptr);
  }
  if (!FLAGS_trajectory.empty()) files.push_back({FLAGS_trajectory, trajectory.Finish()});
  if (!FLAGS_view.empty()) {
    ViewOptions options;
    options.below = below + ControlPlot(file, played.controls, dt);
    files.push_back({FLAGS_view, ViewHtml(view.data(), options)});
  }
  return WriteAllOrNone(files);
}

// `sampled`: how many of them, at the start, have the surrogate's Jacobians.
OrderedJson DescribeIterations(const std::vector<IlqrIteration>& iterations, long sampled) {
  OrderedJson list = OrderedJson::array();
  for (const IlqrIteration& iteration : iterations) {
    const bool is_sampled = static_cast<long>(list.size()) < sampled;
    list.push_back({{"cost", iteration.cost},
                    {"gradient", iteration.gradient},
                    {"shift", iteration.shift},
                    {"step", iteration.step}});
    if (sampled > 0) list.back()["jacobians"] = is_sampled ? "surrogate" : "exact";
  }
  return list;
}

OrderedJson FinalState(const RolloutFunction& function, const RowMatrixXd& states) {
  const std::vector<std::string> names = OutputNames(function.structure());
  OrderedJson json = OrderedJson::object();
  if (states.rows() == 0) return json;
  for (size_t i = 0; i < names.size(); ++i) {
    json[names[i]] = states(states.rows() - 1, static_cast<Eigen::Index>(i));
  }
  return json;
}

// The cost of the motion with controls of 0, or of the bounds nearest to it; not finite where there
// is no such motion.
double CostOfNothing(const ControlFile& file, const Cost& cost, long steps) {
  const VectorX<double> none =
      VectorX<double>::Zero(file.low.size()).cwiseMax(file.low).cwiseMin(file.high);
  return ReplayByEvents(file.scene, file.paths, cost, none.transpose().replicate(steps, 1)).cost;
}

std::string NamesOf(const ControlFile& file, const std::vector<int>& terms) {
  std::string names;
  for (const int term : terms) names += (names.empty() ? "" : ", ") + file.term_names[term];
  return names;
}

Verdict VerdictOf(const ControlFile& file, const Judged& plan, const UnreachedTargets& unreached) {
  const IlqrResult& result = plan.result;
  const Replay& replay = plan.replay;
  if (DiffersFromMotion(result.plan.cost, replay, plan.cost_of_nothing)) {
    const std::string why = replay.done ? "the plan's cost is " + CompactNumber(result.plan.cost) +
                                              ", and that of its replay by events " +
                                              CompactNumber(replay.cost)
                                        : "the plan's replay by events failed: " + replay.message;
    return {"differs_from_motion", why, false};
  }
  if (unreached.all) {
    return {"no_effect_on_target",
            "the controls have no effect on " + NamesOf(file, unreached.terms) +
                " from where the plan is; try starts or sampling, another initial, or a surrogate",
            false};
  }
  return {NameOf(result.status), result.message, true};
}

// Rows of planned numbers beside those of the replay: the cost, then the final state.
std::vector<std::vector<std::string>> PlannedBesideMotion(const RolloutFunction& function,
                                                          const IlqrResult& result,
                                                          const Replay& replay) {
  constexpr int kDigits = 8;
  const std::vector<std::string> names = OutputNames(function.structure());
  const auto text = [](double value) {
    return std::isfinite(value) ? CompactNumber(value, kDigits) : std::string("none");
  };
  std::vector<std::vector<std::string>> rows = {
      {"cost", text(result.plan.cost), text(replay.cost)}};
  const Eigen::Index last = result.plan.states.rows() - 1;
  for (size_t i = 0; i < names.size(); ++i) {
    const auto j = static_cast<Eigen::Index>(i);
    const double moved = replay.states.rows() > last ? replay.states(last, j) : std::nan("");
    rows.push_back({names[i], text(result.plan.states(last, j)), text(moved)});
  }
  return rows;
}

// The same on a terminal, where the result goes to a file.
void PrintBesideMotion(const Verdict& verdict, const std::vector<std::vector<std::string>>& rows) {
  constexpr size_t kMostRows = 31;
  std::printf("%s\n%-28s %16s %16s\n", verdict.status.c_str(), "", "planned", "by events");
  for (size_t i = 0; i < std::min(rows.size(), kMostRows); ++i) {
    std::printf("%-28s %16s %16s\n", rows[i][0].c_str(), rows[i][1].c_str(), rows[i][2].c_str());
  }
  if (rows.size() > kMostRows) {
    std::printf("... (%zu more numbers in the result)\n", rows.size() - kMostRows);
  }
}

std::string PageOfPlan(const Verdict& verdict, const IlqrResult& result,
                       const std::vector<std::vector<std::string>>& rows) {
  return "<p>Status: <b>" + HtmlEscape(verdict.status) + "</b>" +
         (verdict.message.empty() ? "" : ", " + HtmlEscape(verdict.message)) +
         ". The animation shows the planned motion.</p>" +
         HtmlTable({"at the end", "planned", "replayed by events"}, rows) +
         CostPlot(result.iterations);
}

void WarnOfMaximum(const std::string& path) {
  ReportError(
      path +
      ": warning: with the initial controls the cost has no gradient, as an angle that wraps "
      "is half a turn from its target, where its cost is largest; they were offset by " +
      FormatNumber(kStartOffset) + " of their ranges");
}

void WarnOfDiscreteMap(const std::string& path, const Certificate& certificate) {
  const std::string advice = AdviceOf(certificate);
  if (!advice.empty()) {
    ReportError(path + ": warning: a plan may exploit when its steps have impacts: " + advice);
  }
}

SearchOptions SearchOf(const ControlFile& file) {
  return {file.starts, file.sampling, file.options, FLAGS_threads};
}

OrderedJson DescribePlan(const ControlFile& file, const RolloutFunction& function,
                         const Judged& plan) {
  const IlqrResult& result = plan.result;
  OrderedJson json = {
      {"status", plan.verdict.status},
      {"message", plan.verdict.message},
      {"planned_status", NameOf(result.status)},
      {"cost", result.plan.cost},
      {"gradient", result.gradient},
      {"final_state", FinalState(function, result.plan.states)},
      {"motion",
       {{"cost", plan.replay.cost},
        {"message", plan.replay.message},
        {"final_state", FinalState(function, plan.replay.states)},
        {"cost_of_nothing", plan.cost_of_nothing}}},
      {"certificate", ToJson(plan.certificate)},
      {"rollouts", result.rollouts},
      {"linearisations", result.linearisations},
      {"cpu_seconds", plan.seconds},
      {"iterations", DescribeIterations(result.iterations, result.surrogate_iterations)},
      {"controls", DescribeControls(file, result.plan.controls, file.scene.simulation.dt)}};
  if (file.starts.count > 1 || file.sampling.samples > 0) {
    json["starts"] = {{"count", plan.search.start_costs.size()},
                      {"pieces", file.starts.pieces},
                      {"seed", file.starts.seed},
                      {"drawn", plan.search.drawn},
                      {"chosen", plan.search.chosen},
                      {"costs", plan.search.start_costs},
                      {"polished_costs", plan.search.polished_costs}};
  }
  if (file.sampling.samples > 0) {
    json["sampling"] = {{"method", NameOf(file.sampling.method)},
                        {"samples", file.sampling.samples},
                        {"iterations", file.sampling.iterations},
                        {"seed", file.sampling.seed}};
  }
  if (file.options.surrogate.samples > 0) {
    json["surrogate"] = {{"samples", file.options.surrogate.samples},
                         {"deviation", file.options.surrogate.deviation},
                         {"seed", file.options.surrogate.seed},
                         {"iterations", result.surrogate_iterations}};
  }
  return json;
}

// Writes what was asked for, and says on stderr where the plan does not hold.
int FinishPlan(const std::string& path, const ControlFile& file, const RolloutFunction& function,
               const Judged& plan) {
  const auto rows = PlannedBesideMotion(function, plan.result, plan.replay);
  const tangible::Plan& planned = plan.result.plan;
  const std::string error =
      WriteResults(file, file.scene, {planned.states, planned.controls, planned.cost},
                   PageOfPlan(plan.verdict, plan.result, rows), DescribePlan(file, function, plan));
  if (!error.empty()) return ReportError(error);
  if (!FLAGS_out.empty()) PrintBesideMotion(plan.verdict, rows);
  if (plan.verdict.holds) return kExitDone;
  return ReportError(path + ": " + plan.verdict.status + ": " + plan.verdict.message);
}

int MakePlan(const std::string& path, const ControlFile& file) {
  RolloutFunction function;
  std::string error = function.Create(file.scene, {}, file.paths, {});
  if (!error.empty()) return ReportError(path + ": " + error);
  EngineStep map(function);
  const Cost cost(map.num_states(), map.num_controls(), file.scene.simulation.dt, file.terms);
  const ControlProblem problem{&map, &cost, map.initial(), file.low, file.high, 0};
  const RowMatrixXd start = file.InitialControls(function.num_steps());
  const SearchOptions search = SearchOf(file);
  const std::string idle = FindIdle(problem, file, function, start);
  if (!idle.empty() && !search.searches()) return ReportError(path + ": " + idle);
  Judged plan;
  const std::clock_t began = std::clock();
  plan.search = SearchPlan({&function, &cost, file.low, file.high}, start, search);
  plan.result = std::move(plan.search.best);
  plan.seconds = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
  const RowMatrixXd& controls = plan.result.plan.controls;
  if (plan.result.status == IlqrStatus::kFailed) {
    return ReportError(path + ": " + plan.result.message);
  }
  // What moves nothing at first may in the plan from another start.
  if (!idle.empty()) error = FindIdle(problem, file, function, controls);
  if (!error.empty()) return ReportError(path + ": " + error);
  if (plan.result.left_maximum) WarnOfMaximum(path);
  RolloutInput input{VectorX<double>(), VectorX<double>(), controls};
  RolloutWorker worker(function);
  const RolloutOutput run = worker.Run(input);
  for (std::string& warning : worker.Warnings(run.report, run.final)) {
    ReportError(warning.insert(0, ": warning: ").insert(0, path));
  }
  plan.certificate = worker.Certify(input);
  WarnOfDiscreteMap(path, plan.certificate);
  plan.replay = ReplayByEvents(file.scene, file.paths, cost, controls);
  plan.cost_of_nothing = CostOfNothing(file, cost, controls.rows());
  const UnreachedTargets unreached = FindUnreachedTargets(problem, plan.result.plan);
  plan.verdict = VerdictOf(file, plan, unreached);
  if (plan.verdict.holds && !unreached.terms.empty()) {
    ReportError(path + ": warning: the controls have no effect on " +
                NamesOf(file, unreached.terms) + " from where the plan is");
  }
  return FinishPlan(path, file, function, plan);
}

std::vector<std::string> MovingBodies(const Scene& scene) {
  std::vector<std::string> names;
  for (const BasicBody<double>& body : scene.bodies) {
    if (body.motion == Motion::kMoving) names.push_back(body.name);
  }
  return names;
}

// "a, b", of many the first ones.
std::string Listed(const std::vector<std::string>& names) {
  constexpr size_t kMostNames = 5;
  std::string list;
  for (size_t i = 0; i < std::min(names.size(), kMostNames); ++i) {
    list.append(i == 0 ? "" : ", ").append(names[i]);
  }
  return list + (names.size() > kMostNames ? ", ... (" + std::to_string(names.size()) + ")" : "");
}

// The scene that is controlled, with the model's steps.
std::string LoadPlant(const ControlFile& file, Scene* plant) {
  *plant = file.scene;
  if (FLAGS_plant.empty()) return "";
  std::string error;
  if (!LoadScene(FLAGS_plant, plant, &error)) return error;
  if (plant->simulation.dt != file.scene.simulation.dt) {
    return FLAGS_plant + ": /simulation/dt: expected the problem's, " +
           FormatNumber(file.scene.simulation.dt) + ", got " + FormatNumber(plant->simulation.dt);
  }
  const std::vector<std::string> expected = MovingBodies(file.scene), got = MovingBodies(*plant);
  if (got != expected) {
    return FLAGS_plant + ": /bodies: expected the moving bodies of " + file.scene_path + ", " +
           Listed(expected) + ", got " + Listed(got);
  }
  int which = -1;
  error = CheckControls(*plant, file.paths, &which);
  return error.empty() ? "" : FLAGS_plant + ": " + error;
}

struct PredictiveRun {
  Played played;
  std::vector<double> seconds;  // of each plan, CPU
  long failed = 0;
  // States of the plant that are not on the model's joints, and the largest error of one, m or rad.
  long projected = 0;
  double joint_error = 0.0;
  std::string failure;        // of the first plan that failed: where and why
  bool left_maximum = false;  // in any plan
  std::string error;
};

long NumRunSteps(const ControlFile& file) {
  SimulationSettings whole = file.scene.simulation;
  whole.duration = file.run_duration;
  return NumSteps(whole);
}

// Where the first plan begins: with starts or sampling at the plan that they find.
RowMatrixXd FirstControls(const ControlFile& file, const Cost& cost, long horizon) {
  RowMatrixXd initial = file.InitialControls(horizon);
  const SearchOptions search = SearchOf(file);
  Scene scene = file.scene;
  scene.simulation.duration = static_cast<double>(horizon) * scene.simulation.dt;
  RolloutFunction function;
  if (!search.searches() || !function.Create(scene, {}, file.paths, {}).empty()) return initial;
  const IlqrResult best = SearchPlan({&function, &cost, file.low, file.high}, initial, search).best;
  return best.status == IlqrStatus::kFailed ? initial : best.plan.controls;
}

PredictiveRun RunPredictive(const ControlFile& file, EngineStep* map, EngineStep* plant) {
  PredictiveRun run;
  const double dt = file.scene.simulation.dt;
  const long steps = NumRunSteps(file);
  const long horizon = std::max(1L, std::lround(file.plan_horizon / dt));
  const Cost cost(map->num_states(), map->num_controls(), dt, file.terms);
  PredictiveOptions options{file.options, FLAGS_budget_ms / 1000.0};
  options.ilqr.max_iterations = file.plan_iterations;
  if (FLAGS_budget_ms > 0.0) options.ilqr.max_iterations = file.options.max_iterations;
  PredictiveController controller({map, &cost, map->initial(), file.low, file.high, 0},
                                  FirstControls(file, cost, horizon), options);
  VectorX<double> x = plant->initial();
  run.played.states.resize(steps + 1, x.size());
  run.played.controls.resize(steps, map->num_controls());
  run.played.states.row(0) = x.transpose();
  VectorX<double> next;
  for (long k = 0; k < steps; ++k) {
    const std::clock_t began = std::clock();
    VectorX<double> seen = x;
    double error = 0.0;
    if (map->ProjectOntoJoints(k, &seen, &error) != JointState::Outcome::kOnJoints) {
      ++run.projected;
      run.joint_error = std::max(run.joint_error, error);
    }
    const VectorX<double> u = controller.Control(k, seen);
    run.seconds.push_back(static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC);
    run.left_maximum |= controller.last().left_maximum;
    if (controller.last().status == IlqrStatus::kFailed && run.failed++ == 0) {
      run.failure = "in step " + std::to_string(k) + ": " + controller.last().message;
    }
    if (!plant->Step(k, x, u, &next, &run.error)) return run;
    run.played.cost += cost.Value(x, u);
    run.played.controls.row(k) = u.transpose();
    run.played.states.row(k + 1) = next.transpose();
    x = next;
  }
  run.played.cost += cost.EndValue(x);
  return run;
}

// Of the model's run with the controls that were played, which is about what the plans were for.
Certificate CertifyPlayed(const ControlFile& file, const Played& played) {
  Scene scene = file.scene;
  scene.simulation.duration = static_cast<double>(played.controls.rows()) * scene.simulation.dt;
  RolloutFunction function;
  if (!function.Create(scene, {}, file.paths, {}).empty()) return {};
  return RolloutWorker(function).Certify({VectorX<double>(), VectorX<double>(), played.controls});
}

std::string FailedPlans(const PredictiveRun& run) {
  return std::to_string(run.failed) + " of " + std::to_string(run.seconds.size()) + " plans failed";
}

// What keeps a run from having a result, or empty.
std::string WhyNoResult(const PredictiveRun& run, const ControlFile& file) {
  const std::string plant = FLAGS_plant.empty() ? file.scene_path : FLAGS_plant;
  if (!run.error.empty()) return plant + ": " + run.error;
  if (run.failed == static_cast<long>(run.seconds.size())) {
    return FailedPlans(run) + ", the first " + run.failure;
  }
  if (!std::isfinite(run.played.cost)) return "the cost of the run is not finite";
  return "";
}

int Predict(const std::string& path, const ControlFile& file) {
  if (!(file.run_duration > 0.0)) {
    return ReportError(path + ": /mpc: missing, expected an object with duration and horizon");
  }
  Scene plant_scene;
  std::string error = LoadPlant(file, &plant_scene);
  if (!error.empty()) return ReportError(error);
  RolloutFunction function, of_plant;
  error = function.Create(file.scene, {}, file.paths, {});
  if (error.empty()) error = of_plant.Create(plant_scene, {}, file.paths, {});
  if (!error.empty()) return ReportError(path + ": " + error);
  EngineStep map(function), plant(of_plant);
  error = FindIdle({&map, nullptr, map.initial(), file.low, file.high}, file, function,
                   file.InitialControls(NumRunSteps(file)));
  if (!error.empty()) return ReportError(path + ": " + error);
  const PredictiveRun run = RunPredictive(file, &map, &plant);
  error = WhyNoResult(run, file);
  if (!error.empty()) return ReportError(run.error.empty() ? path + ": " + error : error);
  if (run.failed > 0) {
    ReportError(path + ": warning: " + FailedPlans(run) +
                ", where the plans before them were continued; the first " + run.failure);
  }
  if (run.left_maximum) WarnOfMaximum(path);
  const Certificate certificate = CertifyPlayed(file, run.played);
  WarnOfDiscreteMap(path, certificate);
  OrderedJson json = {
      {"status", "done"},
      {"cost", run.played.cost},
      {"final_state", FinalState(of_plant, run.played.states)},
      {"plans", run.seconds.size()},
      {"plans_failed", run.failed},
      {"states_projected", run.projected},
      {"joint_error_max", run.joint_error},
      {"certificate", ToJson(certificate)},
      {"cpu_seconds_median", UpperMedian(run.seconds)},
      {"cpu_seconds_max", *std::max_element(run.seconds.begin(), run.seconds.end())},
      {"controls", DescribeControls(file, run.played.controls, file.scene.simulation.dt)}};
  error = WriteResults(file, plant_scene, run.played, "", json);
  return error.empty() ? kExitDone : ReportError(error);
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
  return FLAGS_mpc ? Predict(line.positional[0], file) : MakePlan(line.positional[0], file);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
