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
#include "tangible/app/program.h"
#include "tangible/app/trajectory_csv.h"
#include "tangible/app/view_recorder.h"
#include "tangible/control/model_predictive.h"
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
DEFINE_string(out, "", "file of the result (JSON); empty: stdout");
DEFINE_string(plan, "", "file of the controls, a row a step (CSV)");
DEFINE_string(trajectory, "", "file of the motion (CSV)");
DEFINE_string(view, "", "file of the animated view, with the plan (HTML)");

namespace tangible {
namespace {

std::string CheckFlags() {
  if (!(FLAGS_budget_ms >= 0.0 && std::isfinite(FLAGS_budget_ms))) {
    return "--budget_ms: expected a number >= 0, got " + FormatNumber(FLAGS_budget_ms);
  }
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

// Finds a control without any effect in any step.
std::string FindIdle(const ControlProblem& problem, const ControlFile& file,
                     const RolloutFunction& function, const Plan& plan) {
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
  VectorX<double> next;
  MatrixX<double> a, b;
  std::string error;
  for (long k = 0; k < plan.controls.rows(); ++k) {
    if (!problem.map->Linearise(k, plan.states.row(k), plan.controls.row(k), &next, &a, &b,
                                &error)) {
      return error;
    }
    effect += b.cwiseAbs().colwise().maxCoeff().transpose();
  }
  for (Eigen::Index i = 0; i < effect.size(); ++i) {
    if (effect[i] <= least) {
      return file.paths[i] +
             ": expected a control that moves something, got one that moves nothing";
    }
  }
  return "";
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

// Runs the scene once more with the applied controls, for the tables and the view.
std::string WriteMotion(const ControlFile& file, Scene scene, const Played& played,
                        const std::vector<IlqrIteration>& iterations) {
  const double dt = scene.simulation.dt;
  std::string error;
  if (!FLAGS_plan.empty()) error = WriteResult(FLAGS_plan, PlanCsv(file, played.controls, dt));
  if (!error.empty() || (FLAGS_trajectory.empty() && FLAGS_view.empty())) return error;
  scene.simulation.duration = static_cast<double>(played.controls.rows()) * dt;
  RolloutFunction function;
  error = function.Create(scene, {}, file.paths, {});
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
  if (!FLAGS_trajectory.empty()) error = WriteResult(FLAGS_trajectory, trajectory.Finish());
  if (!error.empty() || FLAGS_view.empty()) return error;
  ViewOptions options;
  options.below =
      ControlPlot(file, played.controls, dt) + (iterations.empty() ? "" : CostPlot(iterations));
  return WriteResult(FLAGS_view, ViewHtml(view.data(), options));
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
  for (size_t i = 0; i < names.size(); ++i) {
    json[names[i]] = states(states.rows() - 1, static_cast<Eigen::Index>(i));
  }
  return json;
}

int Plan(const std::string& path, const ControlFile& file) {
  RolloutFunction function;
  std::string error = function.Create(file.scene, {}, file.paths, {});
  if (!error.empty()) return ReportError(path + ": " + error);
  EngineStep map(function);
  const Cost cost(map.num_states(), map.num_controls(), file.scene.simulation.dt, file.terms);
  const ControlProblem problem{&map, &cost, map.initial(), file.low, file.high, 0};
  const RowMatrixXd start = file.initial.transpose().replicate(function.num_steps(), 1);
  const std::clock_t began = std::clock();
  const IlqrResult result = SolveIlqr(problem, start, file.options);
  const double seconds = static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
  if (result.status == IlqrStatus::kFailed) return ReportError(path + ": " + result.message);
  error = FindIdle(problem, file, function, result.plan);
  if (!error.empty()) return ReportError(path + ": " + error);
  RolloutInput input{VectorX<double>(), VectorX<double>(), result.plan.controls};
  RolloutWorker worker(function);
  const RolloutOutput run = worker.Run(input);
  for (std::string& warning : worker.Warnings(run.report, run.final)) {
    ReportError(warning.insert(0, ": warning: ").insert(0, path));
  }
  const Certificate certificate = worker.Certify(input);
  OrderedJson json = {
      {"status", NameOf(result.status)},
      {"message", result.message},
      {"cost", result.plan.cost},
      {"gradient", result.gradient},
      {"final_state", FinalState(function, result.plan.states)},
      {"certificate", ToJson(certificate)},
      {"rollouts", result.rollouts},
      {"linearisations", result.linearisations},
      {"cpu_seconds", seconds},
      {"iterations", DescribeIterations(result.iterations, result.surrogate_iterations)},
      {"controls", DescribeControls(file, result.plan.controls, file.scene.simulation.dt)}};
  if (file.options.surrogate.samples > 0) {
    json["surrogate"] = {{"samples", file.options.surrogate.samples},
                         {"deviation", file.options.surrogate.deviation},
                         {"seed", file.options.surrogate.seed},
                         {"iterations", result.surrogate_iterations}};
  }
  error =
      WriteMotion(file, file.scene, {result.plan.states, result.plan.controls, result.plan.cost},
                  result.iterations);
  if (error.empty()) error = WriteResult(FLAGS_out, JsonText(json));
  return error.empty() ? kExitDone : ReportError(error);
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
  if (OutputNames(*BuildStructure(*plant)) != OutputNames(*BuildStructure(file.scene))) {
    return FLAGS_plant + ": expected the moving bodies of " + file.scene_path + ", got others";
  }
  return "";
}

struct PredictiveRun {
  Played played;
  std::vector<double> seconds;  // of each plan, CPU
  long failed = 0;
  std::string error;
};

PredictiveRun RunPredictive(const ControlFile& file, EngineStep* map, EngineStep* plant) {
  PredictiveRun run;
  const double dt = file.scene.simulation.dt;
  SimulationSettings whole = file.scene.simulation;
  whole.duration = file.run_duration;
  const long steps = NumSteps(whole);
  const long horizon = std::max(1L, std::lround(file.plan_horizon / dt));
  const Cost cost(map->num_states(), map->num_controls(), dt, file.terms);
  PredictiveOptions options{file.options, FLAGS_budget_ms / 1000.0};
  options.ilqr.max_iterations = file.plan_iterations;
  if (FLAGS_budget_ms > 0.0) options.ilqr.max_iterations = file.options.max_iterations;
  PredictiveController controller({map, &cost, map->initial(), file.low, file.high, 0},
                                  file.initial.transpose().replicate(horizon, 1), options);
  VectorX<double> x = plant->initial();
  run.played.states.resize(steps + 1, x.size());
  run.played.controls.resize(steps, map->num_controls());
  run.played.states.row(0) = x.transpose();
  VectorX<double> next;
  for (long k = 0; k < steps; ++k) {
    const std::clock_t began = std::clock();
    const VectorX<double> u = controller.Control(k, x);
    run.seconds.push_back(static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC);
    run.failed += controller.last().status == IlqrStatus::kFailed ? 1 : 0;
    if (!plant->Step(k, x, u, &next, &run.error)) return run;
    run.played.cost += cost.Value(x, u);
    run.played.controls.row(k) = u.transpose();
    run.played.states.row(k + 1) = next.transpose();
    x = next;
  }
  run.played.cost += cost.EndValue(x);
  return run;
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
  PredictiveRun run = RunPredictive(file, &map, &plant);
  if (!run.error.empty()) return ReportError(path + ": plant: " + run.error);
  std::vector<double> sorted = run.seconds;
  std::sort(sorted.begin(), sorted.end());
  OrderedJson json = {
      {"status", "done"},
      {"cost", run.played.cost},
      {"final_state", FinalState(of_plant, run.played.states)},
      {"plans", run.seconds.size()},
      {"plans_failed", run.failed},
      {"cpu_seconds_median", sorted[sorted.size() / 2]},
      {"cpu_seconds_max", sorted.back()},
      {"controls", DescribeControls(file, run.played.controls, file.scene.simulation.dt)}};
  error = WriteMotion(file, plant_scene, run.played, {});
  if (error.empty()) error = WriteResult(FLAGS_out, JsonText(json));
  return error.empty() ? kExitDone : ReportError(error);
}

int Main(int argc, char** argv) {
  const CommandLine line = ParseCommandLine(
      argc, argv,
      {.name = "tangible-control",
       .synopsis =
           "PROBLEM.json [--out=R.json] [--plan=U.csv] [--trajectory=T.csv] [--view=V.html] "
           "[--mpc [--plant=SCENE.json] [--budget_ms=T]]",
       .description =
           "Plans forces and efforts of a scene, within bounds, so that a cost is least: "
           "iLQR over the\nengine's exact step derivatives. With --mpc controls a plant "
           "with plans over a receding horizon.",
       .version = TANGIBLE_VERSION,
       .source_file = __FILE__,
       .outputs = {"out", "plan", "trajectory", "view"},
       .inputs = {"plant"}});
  if (line.exit_status) return *line.exit_status;
  const std::string wrong = CheckFlags();
  if (!wrong.empty()) return ReportError("tangible-control: " + wrong, kExitUsage);
  ControlFile file;
  std::string error;
  if (!LoadControlFile(line.positional[0], &file, &error)) return ReportError(error);
  return FLAGS_mpc ? Predict(line.positional[0], file) : Plan(line.positional[0], file);
}

}  // namespace
}  // namespace tangible

int main(int argc, char** argv) { return tangible::RunMain(&tangible::Main, argc, argv); }
