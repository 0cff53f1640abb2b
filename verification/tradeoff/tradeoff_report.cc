// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/tradeoff/tradeoff_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "tangible/render/html.h"
#include "tangible/render/plot.h"
#include "tangible/scene/scene_json.h"
#include "tangible/scene/scene_names.h"

namespace tangible::tradeoff {
namespace {

constexpr int kPlotHeight = 400;
constexpr int kNameWidth = 60;

template <typename... Values>
std::string Format(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

std::string ErrorText(double error, bool below_reference) {
  if (std::isnan(error)) return "-";
  return Format("%.1e%s", error, below_reference ? "*" : "");
}

// The least times of all cells, to which other times are relative.
struct LeastSeconds {
  double run = HUGE_VAL, both = HUGE_VAL;
};

LeastSeconds LeastOf(const Tradeoff& tradeoff) {
  LeastSeconds least;
  for (const Cell& cell : tradeoff.cells) {
    if (!cell.measured()) continue;
    least.run = std::min(least.run, cell.run_seconds);
    least.both = std::min(least.both, cell.both_seconds);
  }
  return least;
}

struct Counts {
  int measured = 0, failed = 0, over = 0;
};

Counts CountsOf(const Tradeoff& tradeoff) {
  Counts counts;
  for (const Cell& cell : tradeoff.cells) {
    ++(cell.measured() ? counts.measured : cell.failed ? counts.failed : counts.over);
  }
  return counts;
}

std::string HeadText(const Tradeoff& tradeoff) {
  const Reference& reference = tradeoff.reference;
  std::string text = tradeoff.scene + "\nparameters:";
  for (const std::string& path : tradeoff.parameters) text += " " + path;
  text += Format("\nlength scale %.3g m; reference: ", tradeoff.scale.length) +
          NameOf(reference.settings.stepping, kSteppingNames) + " " +
          NameOf(IntegratorOf(reference.settings), kIntegratorNames) +
          Format(", dt %.4g s, its own errors: trajectory ", reference.settings.dt) +
          ErrorText(reference.trajectory_error, false) + ", gradient " +
          ErrorText(reference.gradient_error, false) + "\n";
  if (!reference.note.empty()) text += "reference: " + reference.note + "\n";
  const Counts counts = CountsOf(tradeoff);
  text += Format("%d cells measured, %d over their budget, %d failed\n", counts.measured,
                 counts.over, counts.failed);
  std::map<std::string, int> failures;
  for (const Cell& cell : tradeoff.cells) {
    if (cell.failed) ++failures[NameOf(cell.settings, tradeoff.own)];
  }
  for (const auto& [name, count] : failures) text += Format("failed %d: ", count) + name + "\n";
  for (const std::string& line : tradeoff.left_out) text += "left out: " + line + "\n";
  return text;
}

std::string Marks(const Cell& cell) {
  return std::string(cell.trajectory_front ? "T" : "") + (cell.gradient_front ? "G" : "");
}

OrderedJson OrNull(double value) {
  return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr);
}

OrderedJson SettingsJson(const SimulationSettings& settings) {
  return {{"dt", settings.dt},
          {"stepping", NameOf(settings.stepping, kSteppingNames)},
          {"integrator", NameOf(IntegratorOf(settings), kIntegratorNames)},
          {"joint_correction", NameOf(JointCorrectionOf(settings), kJointCorrectionNames)},
          {"lcp_tolerance", settings.lcp_tolerance}};
}

OrderedJson CellJson(const Tradeoff& tradeoff, const LeastSeconds& least, const Cell& cell) {
  OrderedJson json = SettingsJson(cell.settings);
  json["instead"] = cell.instead;
  if (!cell.measured()) return json;
  json["steps"] = cell.steps;
  json["trajectory_error"] = OrNull(cell.trajectory_error);
  json["trajectory_below_reference"] = tradeoff.TrajectoryBelowReference(cell);
  json["gradient_error"] = OrNull(cell.gradient_error);
  json["gradient_below_reference"] = tradeoff.GradientBelowReference(cell);
  json["rollout_seconds"] = cell.run_seconds;
  json["rollout_ratio"] = cell.run_seconds / least.run;
  json["gradient_seconds"] = cell.both_seconds;
  json["gradient_ratio"] = cell.both_seconds / least.both;
  json["repeats"] = cell.repeats;
  json["trajectory_front"] = cell.trajectory_front;
  json["gradient_front"] = cell.gradient_front;
  return json;
}

// The values of a cell that a plot shows.
struct Axes {
  double Cell::*seconds;
  double Cell::*error;
  bool Cell::*front;
  double own_error;
};

Axes AxesOf(const Tradeoff& tradeoff, bool of_gradient) {
  if (of_gradient) {
    return {&Cell::both_seconds, &Cell::gradient_error, &Cell::gradient_front,
            tradeoff.reference.gradient_error};
  }
  return {&Cell::run_seconds, &Cell::trajectory_error, &Cell::trajectory_front,
          tradeoff.reference.trajectory_error};
}

// The error is drawn no lower than the reference's own, because smaller errors cannot be measured.
void AddPoint(const Cell& cell, const Axes& axes, PlotSeries* series) {
  series->x.push_back(1e3 * cell.*axes.seconds);
  series->y.push_back(std::max(cell.*axes.error, axes.own_error));
}

PlotSeries FrontOf(const Tradeoff& tradeoff, const Axes& axes, const std::string& label) {
  std::vector<const Cell*> cells;
  for (const Cell& cell : tradeoff.cells) {
    if (cell.*axes.front) cells.push_back(&cell);
  }
  std::sort(cells.begin(), cells.end(),
            [&](const Cell* a, const Cell* b) { return a->*axes.seconds < b->*axes.seconds; });
  PlotSeries series;
  series.label = label;
  series.style = PlotStyle::kLineAndPoints;
  for (const Cell* cell : cells) AddPoint(*cell, axes, &series);
  return series;
}

std::vector<PlotSeries> SeriesOf(const std::vector<Tradeoff>& tradeoffs, bool of_gradient) {
  std::vector<PlotSeries> all;
  if (tradeoffs.size() != 1) {
    for (const Tradeoff& one : tradeoffs) {
      all.push_back(FrontOf(one, AxesOf(one, of_gradient), one.scene));
    }
    return all;
  }
  const Axes axes = AxesOf(tradeoffs[0], of_gradient);
  std::map<std::string, PlotSeries> kinds;
  for (const Cell& cell : tradeoffs[0].cells) {
    if (!cell.measured()) continue;
    const bool fixed = cell.settings.stepping == Stepping::kFixed;
    const std::string name =
        fixed ? "fixed" : "event " + NameOf(IntegratorOf(cell.settings), kIntegratorNames);
    PlotSeries& series = kinds[name];
    series.label = name;
    series.style = PlotStyle::kPoints;
    AddPoint(cell, axes, &series);
  }
  for (auto& [name, series] : kinds) all.push_back(std::move(series));
  all.push_back(FrontOf(tradeoffs[0], axes, "front"));
  return all;
}

std::string Plot(const std::vector<Tradeoff>& tradeoffs, bool of_gradient) {
  PlotOptions options;
  options.title = std::string(of_gradient ? "Gradient of the final state" : "Trajectory") +
                  (tradeoffs.size() == 1 ? ": " + tradeoffs[0].scene : ", fronts");
  options.x_label =
      of_gradient ? "CPU time of a rollout with its adjoint (ms)" : "CPU time of a rollout (ms)";
  options.y_label = "relative error";
  options.x_scale = options.y_scale = AxisScale::kLogarithmic;
  options.height = kPlotHeight;
  return PlotSvg(options, SeriesOf(tradeoffs, of_gradient));
}

std::string CellsTable(const Tradeoff& tradeoff) {
  const LeastSeconds least = LeastOf(tradeoff);
  std::vector<std::vector<std::string>> rows;
  for (const Cell& cell : tradeoff.cells) {
    rows.push_back({NameOf(cell.settings, tradeoff.own), Format("%.4g", cell.settings.dt)});
    if (!cell.measured()) {
      rows.back().push_back(cell.instead);
      continue;
    }
    for (const std::string& text :
         {ErrorText(cell.trajectory_error, tradeoff.TrajectoryBelowReference(cell)),
          ErrorText(cell.gradient_error, tradeoff.GradientBelowReference(cell)),
          Format("%.3g", 1e3 * cell.run_seconds), Format("%.2f", cell.run_seconds / least.run),
          Format("%.3g", 1e3 * cell.both_seconds), Format("%.2f", cell.both_seconds / least.both),
          Marks(cell)}) {
      rows.back().push_back(text);
    }
  }
  return HtmlTable({"settings", "dt, s", "trajectory error", "gradient error", "rollout, ms",
                    "ratio", "with adjoint, ms", "ratio", "front"},
                   rows);
}

}  // namespace

std::string TableText(const Tradeoff& tradeoff) {
  std::string text = HeadText(tradeoff);
  text += Format("\n%-*s %10s %9s %9s %10s %7s %10s %7s\n", kNameWidth, "on a front", "dt, s",
                 "traject.", "gradient", "run, ms", "ratio", "grad., ms", "ratio");
  const LeastSeconds least = LeastOf(tradeoff);
  std::vector<const Cell*> cells;
  for (const Cell& cell : tradeoff.cells) {
    if (cell.trajectory_front || cell.gradient_front) cells.push_back(&cell);
  }
  std::sort(cells.begin(), cells.end(),
            [](const Cell* a, const Cell* b) { return a->both_seconds < b->both_seconds; });
  for (const Cell* cell : cells) {
    const std::string name = NameOf(cell->settings, tradeoff.own);
    const std::string trajectory =
        ErrorText(cell->trajectory_error, tradeoff.TrajectoryBelowReference(*cell));
    const std::string gradient =
        ErrorText(cell->gradient_error, tradeoff.GradientBelowReference(*cell));
    text += Format("%-2s %-*s %10.4g %9s %9s %10.3g %7.2f %10.3g %7.2f\n", Marks(*cell).c_str(),
                   kNameWidth - 3, name.c_str(), cell->settings.dt, trajectory.c_str(),
                   gradient.c_str(), 1e3 * cell->run_seconds, cell->run_seconds / least.run,
                   1e3 * cell->both_seconds, cell->both_seconds / least.both);
  }
  return text;
}

OrderedJson ToJson(const Tradeoff& tradeoff) {
  const LeastSeconds least = LeastOf(tradeoff);
  const Reference& reference = tradeoff.reference;
  OrderedJson cells = OrderedJson::array();
  for (const Cell& cell : tradeoff.cells) cells.push_back(CellJson(tradeoff, least, cell));
  OrderedJson of_reference = SettingsJson(reference.settings);
  of_reference["trajectory_error"] = OrNull(reference.trajectory_error);
  of_reference["gradient_error"] = OrNull(reference.gradient_error);
  of_reference["note"] = reference.note;
  return {{"scene", tradeoff.scene},         {"parameters", tradeoff.parameters},
          {"length", tradeoff.scale.length}, {"reference", of_reference},
          {"left_out", tradeoff.left_out},   {"cells", cells}};
}

std::string Picture(const std::vector<Tradeoff>& tradeoffs) {
  const int width = PlotOptions().width;
  return Format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
             "viewBox=\"0 0 %d %d\">\n",
             width, 2 * kPlotHeight, width, 2 * kPlotHeight) +
         Plot(tradeoffs, false) + Format("<g transform=\"translate(0 %d)\">\n", kPlotHeight) +
         Plot(tradeoffs, true) + "</g>\n</svg>\n";
}

std::string Page(const std::vector<Tradeoff>& tradeoffs, const std::string& provenance) {
  std::string body = "<h1>Error against time</h1>\n<p>" + HtmlEscape(provenance) + "</p>\n";
  if (tradeoffs.size() > 1) body += Plot(tradeoffs, false) + Plot(tradeoffs, true);
  for (const Tradeoff& one : tradeoffs) {
    body += "<h2>" + HtmlEscape(one.scene) + "</h2>\n<pre>" + HtmlEscape(HeadText(one)) +
            "</pre>\n" + Plot({one}, false) + Plot({one}, true) + CellsTable(one);
  }
  return HtmlPage("Error against time", body);
}

std::string SimulationBlock(const Scene& scene, const SimulationSettings& settings) {
  Scene copy = scene;
  copy.simulation = settings;
  const OrderedJson whole = OrderedJson::parse(SceneToJson(copy));
  return "\"simulation\": " + JsonText(whole.at("simulation"));
}

std::string WhyNone(const Tradeoff& tradeoff, double error) {
  double trajectory = HUGE_VAL;
  double gradient = HUGE_VAL;
  for (const Cell& cell : tradeoff.cells) {
    if (!cell.measured()) continue;
    trajectory = std::min(trajectory, cell.trajectory_error);
    gradient = std::min(gradient, cell.gradient_error);
  }
  const Reference& reference = tradeoff.reference;
  std::string text =
      Format("expected settings with errors <= %g, got none: the least of trajectories is %.2g",
             error, trajectory);
  text += std::isnan(reference.gradient_error) ? "" : Format(", of gradients %.2g", gradient);
  text += Format(", to which the reference's own are added, %.2g", reference.trajectory_error);
  return text + (std::isnan(reference.gradient_error)
                     ? ""
                     : Format(" and %.2g", reference.gradient_error));
}

}  // namespace tangible::tradeoff
