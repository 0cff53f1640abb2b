// SPDX-License-Identifier: Apache-2.0
#include "tangible/app/control_output.h"

#include <string>
#include <vector>

#include "tangible/app/program.h"
#include "tangible/app/trajectory_csv.h"
#include "tangible/control/engine_step.h"
#include "tangible/render/html.h"
#include "tangible/render/plot.h"
#include "tangible/render/recorder/view_recorder.h"

namespace tangible {
namespace {

std::string ControlPlot(const ControlFile& file, const ControlRun& run) {
  const RowMatrixXd& controls = run.controls;
  const double dt = run.scene.simulation.dt;
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

std::string PageOfPlan(const ControlRun& run) {
  const PlanVerdict& verdict = run.verdict;
  return "<p>Status: <b>" + HtmlEscape(verdict.status) + "</b>" +
         (verdict.message.empty() ? "" : ", " + HtmlEscape(verdict.message)) +
         ". The animation shows the planned motion.</p>" +
         HtmlTable({"at the end", "planned", "replayed by events"}, run.beside_motion) +
         CostPlot(run.iterations);
}

}  // namespace

std::string PlanCsv(const ControlFile& file, const ControlRun& run) {
  const RowMatrixXd& controls = run.controls;
  const double dt = run.scene.simulation.dt;
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

std::string DrawMotion(const ControlFile& file, const ControlRun& run, DrawnMotion* drawn) {
  const Scene& scene = run.scene;
  const double dt = scene.simulation.dt;
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
  for (Eigen::Index k = 0; k < run.states.rows(); ++k) {
    const State<double> state = step.StateOf(k, run.states.row(k));
    const double t = static_cast<double>(k) * dt;
    trajectory.Add(k, t, state);
    view.Add(model, t, state, nullptr);
  }
  drawn->trajectory = trajectory.Finish();
  ViewOptions options;
  options.below = (run.beside_motion.empty() ? "" : PageOfPlan(run)) + ControlPlot(file, run);
  drawn->page = ViewHtml(view.data(), options);
  return "";
}

}  // namespace tangible
