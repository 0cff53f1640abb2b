// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/cost/cost_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "tangible/math/median.h"
#include "tangible/render/plot.h"

namespace tangible::cost {
namespace {

constexpr int kNameWidth = 21;
constexpr int kCellWidth = 13;
constexpr int kPlotHeight = 420;

template <typename... Values>
std::string Format(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

std::string CellText(const CostCell& cell) {
  if (!cell.measured()) {
    return cell.failed ? "failed" : cell.instead;
  }
  return Format("%.*f / %.0f", cell.ratio() < 99.5 ? 2 : 0, cell.ratio(),
                static_cast<double>(cell.peak_bytes) / kMebibyte);
}

template <typename Value, typename Get>
std::vector<Value> Distinct(const std::vector<CostCell>& cells, const Get& get) {
  std::set<Value> values;
  for (const CostCell& cell : cells) {
    values.insert(get(cell));
  }
  return {values.begin(), values.end()};
}

std::vector<long> StepsOf(const std::vector<CostCell>& cells) {
  return Distinct<long>(cells, [](const CostCell& cell) { return cell.steps; });
}

std::vector<int> ParametersOf(const std::vector<CostCell>& cells) {
  std::vector<int> counts = Distinct<int>(cells, [](const CostCell& c) { return c.parameters; });
  std::erase(counts, 0);  // that of the plain rollout
  return counts;
}

std::string BlockText(const std::vector<CostCell>& cells, long steps) {
  std::string text;
  std::string line;
  CostMethod method = CostMethod::kRollout;
  const auto end_line = [&] {
    if (!line.empty()) text += line + "\n";
    line.clear();
  };
  for (const CostCell& cell : cells) {
    if (cell.steps != steps) continue;
    if (cell.method == CostMethod::kRollout) {
      text += Format("%ld steps: one rollout %.4g ms, %.0f MiB\n", steps,
                     1e3 * Least(cell.rollout_seconds),
                     static_cast<double>(cell.peak_bytes) / kMebibyte);
      line = Format("%-*s", kNameWidth, "parameters");
      for (const int count : ParametersOf(cells)) line += Format("%*d", kCellWidth, count);
      continue;
    }
    if (cell.method != method) {
      end_line();
      method = cell.method;
      line = Format("%-*s", kNameWidth, NameOf(method));
    }
    line += Format("%*s", kCellWidth, CellText(cell).c_str());
  }
  end_line();
  return text;
}

OrderedJson OrNull(double value) {
  return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr);
}

OrderedJson CellJson(const CostCell& cell) {
  OrderedJson json = {{"method", NameOf(cell.method)},
                      {"parameters", cell.parameters},
                      {"steps", cell.steps},
                      {"instead", cell.instead}};
  if (cell.measured()) {
    json["seconds_min"] = Least(cell.seconds);
    json["seconds_median"] = Median(cell.seconds);
    json["repeats"] = cell.seconds.size();
    json["rollout_seconds_min"] = Least(cell.rollout_seconds);
    json["rollout_seconds_median"] = Median(cell.rollout_seconds);
    json["ratio"] = cell.ratio();
    json["median_ratio"] = cell.median_ratio();
    json["peak_bytes"] = cell.peak_bytes;
    json["difference_from_adjoint"] = OrNull(cell.difference);
  }
  if (cell.tape_bytes > 0) {
    json["tape_bytes"] = cell.tape_bytes;
    json["runs_again"] = cell.runs_again;
  }
  return json;
}

std::vector<PlotSeries> Series(const std::vector<CostCell>& cells, bool of_time, long steps,
                               int parameters) {
  std::vector<PlotSeries> all;
  // The plain rollout comes last, so that methods have the same colours in both plots.
  for (int k = 1; k <= (of_time ? kNumCostMethods - 1 : kNumCostMethods); ++k) {
    const int m = k % kNumCostMethods;
    const auto method = static_cast<CostMethod>(m);
    PlotSeries series;
    series.label = NameOf(method);
    series.style = PlotStyle::kLineAndPoints;
    for (const CostCell& cell : cells) {
      if (cell.method != method || !cell.measured()) continue;
      if (of_time && cell.steps == steps) {
        series.x.push_back(cell.parameters);
        series.y.push_back(cell.ratio());
      } else if (!of_time && (cell.parameters == parameters || m == 0)) {
        series.x.push_back(static_cast<double>(cell.steps));
        series.y.push_back(static_cast<double>(cell.peak_bytes) / kMebibyte);
      }
    }
    if (!series.x.empty()) all.push_back(std::move(series));
  }
  return all;
}

}  // namespace

std::string TableText(const std::vector<CostCell>& cells) {
  std::string text = "time in rollouts of the same run / peak memory of the process, MiB\n";
  for (const long steps : StepsOf(cells)) text += "\n" + BlockText(cells, steps);
  return text;
}

std::string CrossoverText(const std::vector<Crossover>& crossovers) {
  std::string text =
      "from how many parameters on a method takes less time than another (-: nowhere measured)\n";
  for (size_t i = 0; i < crossovers.size(); ++i) {
    const Crossover& c = crossovers[i];
    const bool new_line = i == 0 || crossovers[i - 1].steps != c.steps;
    if (new_line || crossovers[i - 1].other != c.other) {
      text += new_line ? Format("%s%ld steps, than ", i == 0 ? "" : "\n", c.steps) : "; than ";
      text += std::string(NameOf(c.other)) + ":";
    } else {
      text += ",";
    }
    text += std::string(" ") + NameOf(c.method) + " " +
            (std::isnan(c.parameters) ? "-" : Format("%.2g", c.parameters));
  }
  return text + "\n";
}

std::string BoundsText(const std::vector<CheckedBound>& bounds) {
  std::string text;
  for (const CheckedBound& bound : bounds) {
    text += bound.what + ": ";
    text += bound.why_not.empty()
                ? Format("%.3g, at most %g: %s", bound.measured, bound.limit,
                         bound.holds() ? "holds" : "does not hold")
                : Format("at most %g: not checked, ", bound.limit) + bound.why_not;
    text += "\n";
  }
  return text;
}

OrderedJson ToJson(const std::vector<CostCell>& cells, const CostCell& long_run,
                   const std::vector<Crossover>& crossovers,
                   const std::vector<CheckedBound>& bounds) {
  OrderedJson list = OrderedJson::array();
  for (const CostCell& cell : cells) list.push_back(CellJson(cell));
  OrderedJson crossings = OrderedJson::array();
  for (const Crossover& c : crossovers) {
    crossings.push_back({{"steps", c.steps},
                         {"method", NameOf(c.method)},
                         {"other", NameOf(c.other)},
                         {"parameters", OrNull(c.parameters)},
                         {"from_the_first", c.from_the_first}});
  }
  OrderedJson checked = OrderedJson::array();
  for (const CheckedBound& bound : bounds) {
    checked.push_back(
        {{"bound", bound.what},
         {"limit", bound.limit},
         {"measured", OrNull(bound.measured)},
         {"holds", bound.why_not.empty() ? OrderedJson(bound.holds()) : OrderedJson(nullptr)},
         {"not_checked", bound.why_not}});
  }
  return {{"cells", list},
          {"long_run", CellJson(long_run)},
          {"crossovers", crossings},
          {"bounds", checked}};
}

std::string Picture(const std::vector<CostCell>& cells) {
  const std::vector<long> steps = StepsOf(cells);
  const std::vector<int> parameters = ParametersOf(cells);
  const long shown = steps.size() > 1 ? steps[steps.size() - 2] : steps.empty() ? 0 : steps[0];
  const int fewest = parameters.empty() ? 0 : parameters[0];
  PlotOptions time;
  time.title = "Gradient of a loss, " + std::to_string(shown) + " steps of a chain and a ball";
  time.x_label = "parameters";
  time.y_label = "time / one rollout";
  PlotOptions memory;
  memory.title = "Peak memory of the process, parameters: " + std::to_string(fewest);
  memory.x_label = "steps";
  memory.y_label = "memory (MiB)";
  for (PlotOptions* options : {&time, &memory}) {
    options->x_scale = options->y_scale = AxisScale::kLogarithmic;
    options->height = kPlotHeight;
  }
  return Format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" "
             "viewBox=\"0 0 %d %d\">\n",
             time.width, 2 * kPlotHeight, time.width, 2 * kPlotHeight) +
         PlotSvg(time, Series(cells, true, shown, fewest)) +
         Format("<g transform=\"translate(0 %d)\">\n", kPlotHeight) +
         PlotSvg(memory, Series(cells, false, shown, fewest)) + "</g>\n</svg>\n";
}

}  // namespace tangible::cost
