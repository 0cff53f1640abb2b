// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/noise_output.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tangible/render/html.h"
#include "tangible/render/plot.h"

namespace tangible {
namespace {

constexpr size_t kMostForcePlots = 12;
constexpr int kForceBuckets = 360;

std::string NoiseUnit(const NoiseTerm& term) {
  return std::string(term.IsTorque() ? "N m" : "N") +
         (term.correlation_time > 0.0 ? "" : " sqrt(s)");
}

OrderedJson ColumnOf(const RowMatrixXd& values, Eigen::Index column) {
  OrderedJson array = OrderedJson::array();
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    const double x = values(i, column);
    array.push_back(std::isfinite(x) ? OrderedJson(x) : OrderedJson(nullptr));
  }
  return array;
}

std::vector<double> ValuesOf(const RowMatrixXd& values, Eigen::Index column) {
  std::vector<double> all;
  for (Eigen::Index i = 0; i < values.rows(); ++i) all.push_back(values(i, column));
  return all;
}

std::string NoiseInterval95(const NoiseIntensity& one) {
  if (!one.estimated) return "given";
  if (!one.seen) return "no such force is seen";
  return one.interval ? CompactNumber(one.interval->first, 4) + " to " +
                            CompactNumber(one.interval->second, 4)
                      : "";
}

}  // namespace

OrderedJson ProcessNoiseToJson(const VarianceComponents& components) {
  OrderedJson all = OrderedJson::array();
  for (size_t i = 0; i < components.forces.size(); ++i) {
    const NoiseIntensity& one = components.forces[i];
    const auto column = static_cast<Eigen::Index>(i);
    const bool is_body = !one.term.body.empty();
    OrderedJson json = {
        {is_body ? "body" : "joint", is_body ? one.term.body : one.term.joint},
        {"coordinate", NameOf(one.term.coordinate)},
        {"intensity", one.intensity},
        {"unit", NoiseUnit(one.term)},
        {"correlation_time", one.term.correlation_time},
        {"estimated", one.estimated},
        {"interval_95", one.interval ? OrderedJson{one.interval->first, one.interval->second}
                                     : OrderedJson(nullptr)}};
    OrderedJson runs = OrderedJson::array();
    for (const SmoothedRun& run : components.smoothed) {
      OrderedJson course = OrderedJson::object();
      if (!run.recording.empty()) course["recording"] = run.recording;
      course["time"] = std::vector<double>(run.times.begin(), run.times.end() - 1);
      course["force"] = ColumnOf(run.forces, column);
      course["standard_deviation"] = ColumnOf(run.force_deviations, column);
      course["coordinate"] = ColumnOf(run.coordinates, column);
      course["rate"] = ColumnOf(run.rates, column);
      runs.push_back(std::move(course));
    }
    json["forces"] = std::move(runs);
    all.push_back(std::move(json));
  }
  return all;
}

OrderedJson SmoothedStatesToJson(const VarianceComponents& components) {
  OrderedJson all = OrderedJson::array();
  for (const SmoothedRun& run : components.smoothed) {
    OrderedJson json = OrderedJson::object();
    if (!run.recording.empty()) json["recording"] = run.recording;
    json["time"] = run.times;
    OrderedJson states = OrderedJson::object();
    OrderedJson deviations = OrderedJson::object();
    for (size_t i = 0; i < run.names.size(); ++i) {
      states[run.names[i]] = ColumnOf(run.states, static_cast<Eigen::Index>(i));
      deviations[run.names[i]] = ColumnOf(run.state_deviations, static_cast<Eigen::Index>(i));
    }
    json["states"] = std::move(states);
    json["standard_deviations"] = std::move(deviations);
    all.push_back(std::move(json));
  }
  return all;
}

std::string ProcessNoisePart(const VarianceComponents* components) {
  if (components == nullptr || components->forces.empty()) return "";
  std::vector<std::vector<std::string>> rows;
  std::string plots;
  size_t drawn = 0;
  for (size_t i = 0; i < components->forces.size(); ++i) {
    const NoiseIntensity& one = components->forces[i];
    const auto column = static_cast<Eigen::Index>(i);
    rows.push_back({NameOf(one.term), CompactNumber(one.intensity, 5) + " " + NoiseUnit(one.term),
                    NoiseInterval95(one),
                    one.term.correlation_time > 0.0
                        ? CompactNumber(one.term.correlation_time, 4) + " s"
                        : "white"});
    for (const SmoothedRun& run : components->smoothed) {
      if (drawn++ >= kMostForcePlots) break;
      const std::string unit = one.term.IsTorque() ? "torque (N m)" : "force (N)";
      const std::string name =
          NameOf(one.term) + (run.recording.empty() ? "" : " of " + run.recording);
      const std::vector<double> force = ValuesOf(run.forces, column);
      const std::vector<double> time(run.times.begin(), run.times.end() - 1);
      plots += PlotSvg(
          {.title = name, .x_label = "time (s)", .y_label = unit, .height = 260},
          {Thinned({"", time, force, PlotStyle::kLine, ValuesOf(run.force_deviations, column)},
                   kForceBuckets)});
      const bool turns = one.term.IsTorque();
      const auto over = [&](const RowMatrixXd& x, const std::string& label) {
        plots += PlotSvg(
            {.title = name, .x_label = label, .y_label = unit, .height = 260},
            {Thinned({"", ValuesOf(x, column), force, PlotStyle::kPoints, {}}, 4 * kForceBuckets)});
      };
      over(run.coordinates, turns ? "angle (rad)" : "position (m)");
      over(run.rates, turns ? "angular velocity (rad/s)" : "speed (m/s)");
    }
  }
  return "<h2>Random forces</h2>\n<p>Beside the scene's own forces these act, as the observations "
         "show them; the band is one standard deviation. A force that depends on the coordinate or "
         "its rate is missing in the model.</p>\n" +
         HtmlTable({"force", "intensity", "95 %", "correlation"}, rows) + plots;
}

std::string RefusedWithNoise(const RecordingsProblem& problem,
                             const std::vector<std::pair<const char*, bool>>& asked) {
  for (const auto& [option, is_asked] : asked) {
    if (problem.HasNoise() && is_asked) return std::string(option) + ": not with process_noise";
  }
  return "";
}

std::string DescribeProcessNoise(const VarianceComponents& components) {
  std::string text;
  for (const NoiseIntensity& one : components.forces) {
    text += "random force of " + NameOf(one.term) + ": " + CompactNumber(one.intensity, 5) + " " +
            NoiseUnit(one.term) + " (" + (one.estimated && one.seen ? "95 %: " : "") +
            NoiseInterval95(one) + ")\n";
  }
  return text;
}

}  // namespace tangible
