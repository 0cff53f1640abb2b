// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "tangible/render/html.h"
#include "tangible/render/plot.h"

namespace tangible {
namespace {

// More coordinates than this are listed with their residuals but not drawn.
constexpr size_t kMostPlots = 24;

/// One coordinate of one body or point.
struct Series {
  std::string label;
  const char* unit = "m";
  std::vector<double> time, observed, fitted, residual;
};

std::vector<Series> CollectSeries(const RolloutResiduals& residuals, const FitResult& result) {
  std::map<std::tuple<int, int, Coordinate>, std::vector<int>> groups;
  for (int i = 0; i < residuals.num_residuals(); ++i) {
    const Observation& observation = residuals.observations()[i];
    groups[{observation.body, observation.point, observation.coordinate}].push_back(i);
  }
  std::vector<Series> all;
  for (auto& [key, indices] : groups) {
    std::stable_sort(indices.begin(), indices.end(), [&](int a, int b) {
      return residuals.observations()[a].time < residuals.observations()[b].time;
    });
    const Observation& first = residuals.observations()[indices.front()];
    Series series;
    series.label = TargetName(residuals.scene().scene(), residuals.scene().points(), first) + " " +
                   NameOf(first.coordinate);
    series.unit = first.coordinate == Coordinate::kAngle ? "rad" : "m";
    for (const int i : indices) {
      const Observation& observation = residuals.observations()[i];
      const double residual = result.residuals[i];
      series.time.push_back(observation.time);
      series.observed.push_back(observation.value);
      series.fitted.push_back(observation.value + residual * observation.sigma);
      series.residual.push_back(residual);
    }
    all.push_back(std::move(series));
  }
  return all;
}

std::string EstimateTable(const RolloutResiduals& residuals, const FitResult& result) {
  const auto end = [](const ConfidenceInterval& interval,
                      double std::pair<double, double>::*which) {
    return interval ? CompactNumber((*interval).*which, 8) : std::string();
  };
  const auto number = [](double x) {
    return std::isfinite(x) ? CompactNumber(x, 3) : std::string();
  };
  std::vector<std::vector<std::string>> rows;
  const auto& entries = residuals.scene().entries();
  const Uncertainty& uncertainty = result.uncertainty;
  using Ends = std::pair<double, double>;
  for (size_t k = 0; k < entries.size(); ++k) {
    const ConfidenceInterval& robust = uncertainty.confidence_95_robust[k];
    const ConfidenceInterval& interval = uncertainty.confidence_95[k];
    const Eigen::Index i = static_cast<Eigen::Index>(k);
    rows.push_back({entries[k].name, CompactNumber(result.starts.front().initial[k], 6),
                    CompactNumber(result.estimate[i], 9),
                    number(uncertainty.standard_deviation_robust[i]), end(robust, &Ends::first),
                    end(robust, &Ends::second), number(uncertainty.degrees_of_freedom[i]),
                    number(uncertainty.standard_deviation[i]), end(interval, &Ends::first),
                    end(interval, &Ends::second),
                    uncertainty.prior_share[i] > 0.0
                        ? CompactNumber(100.0 * uncertainty.prior_share[i], 2) + " %"
                        : "",
                    uncertainty.messages[k]});
  }
  return HtmlTable({"parameter", "initial", "estimate", "robust standard deviation", "95 % from",
                    "to", "degrees of freedom", "standard deviation from sigma", "95 % from", "to",
                    "by priors", ""},
                   rows) +
         "<p>" + HtmlEscape(DescribeRobust(uncertainty)) + ".</p>\n";
}

/// What is determined of parameters that are not determined one by one.
std::string CombinationTable(const Uncertainty& uncertainty) {
  std::vector<std::vector<std::string>> rows;
  for (const DeterminedCombination& combination : uncertainty.combinations) {
    const double robust = combination.standard_deviation_robust;
    rows.push_back({combination.sum, combination.product, CompactNumber(combination.value, 9),
                    std::isfinite(robust) ? CompactNumber(robust, 3) : "",
                    CompactNumber(combination.standard_deviation, 3)});
  }
  return rows.empty()
             ? ""
             : "<h2>Determined combinations</h2>\n" +
                   HtmlTable({"sum", "locally the product", "value of the sum",
                              "robust standard deviation", "standard deviation from sigma"},
                             rows);
}

std::string SummaryTable(const FitResult& result) {
  const Uncertainty& uncertainty = result.uncertainty;
  return HtmlTable({"", ""},
                   {{"status", NameOf(result.status)},
                    {"message", result.message},
                    {"measured coordinates", std::to_string(result.residuals.size())},
                    {"cost at the initial values", CompactNumber(result.initial_cost)},
                    {"cost at the estimate", CompactNumber(result.final_cost)},
                    {"residual rms (sigma)", CompactNumber(uncertainty.residual_rms, 4)},
                    {"reduced chi-square", CompactNumber(uncertainty.reduced_chi_square, 4)},
                    {"condition of the Jacobian", CompactNumber(uncertainty.condition, 3)},
                    {"derivatives at the estimate", result.certificate.verdict},
                    {"iterations", std::to_string(result.iterations.size() - 1)},
                    {"rollouts", std::to_string(result.rollouts)},
                    {"seconds", CompactNumber(result.seconds, 3)}});
}

std::string Warnings(const Uncertainty& uncertainty) {
  std::string html;
  for (const std::string& warning : uncertainty.warnings) {
    html += "<p><strong>Warning:</strong> " + HtmlEscape(warning) + "</p>\n";
  }
  return html;
}

std::string CorrelationTable(const RolloutResiduals& residuals, const FitResult& result) {
  const auto& entries = residuals.scene().entries();
  std::vector<std::string> header = {""};
  std::vector<std::vector<std::string>> rows;
  for (const auto& entry : entries) {
    header.push_back(entry.name);
  }
  const Uncertainty& u = result.uncertainty;
  for (Eigen::Index i = 0; i < u.covariance.rows(); ++i) {
    std::vector<std::string> row = {entries[i].name};
    for (Eigen::Index j = 0; j < u.covariance.cols(); ++j) {
      const double c = u.covariance(i, j) / (u.standard_deviation[i] * u.standard_deviation[j]);
      row.push_back(std::isfinite(c) ? CompactNumber(c, 3) : "");
    }
    rows.push_back(row);
  }
  return entries.size() < 2 ? "" : "<h2>Correlation</h2>\n" + HtmlTable(header, rows);
}

std::string IterationPlots(const RolloutResiduals& residuals, const FitResult& result) {
  std::vector<double> index, cost, gradient;
  for (const FitIteration& iteration : result.iterations) {
    index.push_back(static_cast<double>(index.size()));
    cost.push_back(iteration.cost);
    gradient.push_back(iteration.gradient_norm);
  }
  std::string html = "<h2>By iteration</h2>\n";
  html += PlotSvg({.title = "cost and gradient",
                   .x_label = "iteration",
                   .y_label = "",
                   .y_scale = AxisScale::kLogarithmic,
                   .height = 280},
                  {{"cost", index, cost, PlotStyle::kLineAndPoints, {}},
                   {"gradient norm", index, gradient, PlotStyle::kLineAndPoints, {}}});
  const auto& entries = residuals.scene().entries();
  for (size_t k = 0; k < entries.size(); ++k) {
    std::vector<double> values;
    for (const FitIteration& iteration : result.iterations) {
      values.push_back(iteration.parameters[k]);
    }
    html +=
        PlotSvg({.title = entries[k].name, .x_label = "iteration", .y_label = "", .height = 260},
                {{"", index, values, PlotStyle::kLineAndPoints, {}}});
  }
  return html;
}

std::string SeriesPlots(const std::vector<Series>& all) {
  std::string html = "<h2>Observed and fitted</h2>\n";
  std::vector<std::vector<std::string>> rows;
  for (size_t i = 0; i < all.size(); ++i) {
    const Series& series = all[i];
    double sum = 0.0;
    double largest = 0.0;
    for (const double r : series.residual) {
      sum += r * r;
      largest = std::max(largest, std::abs(r));
    }
    rows.push_back({series.label, std::to_string(series.time.size()),
                    CompactNumber(std::sqrt(sum / static_cast<double>(series.time.size())), 4),
                    CompactNumber(largest, 4)});
    if (i >= kMostPlots) {
      continue;
    }
    html += PlotSvg({.title = series.label,
                     .x_label = "time (s)",
                     .y_label = std::string(series.unit),
                     .height = 240},
                    {{"observed", series.time, series.observed, PlotStyle::kPoints, {}},
                     {"fitted", series.time, series.fitted, PlotStyle::kLine, {}}});
    html += PlotSvg({.title = series.label + ": fitted − observed",
                     .x_label = "time (s)",
                     .y_label = "sigma",
                     .height = 220},
                    {{"", series.time, series.residual, PlotStyle::kPoints, {}}});
  }
  if (all.size() > kMostPlots) {
    html += "<p>The first " + std::to_string(kMostPlots) + " of " + std::to_string(all.size()) +
            " measured coordinates are drawn.</p>\n";
  }
  return "<h2>Residuals</h2>\n" +
         HtmlTable({"coordinate", "measured", "rms (sigma)", "largest (sigma)"}, rows) + html;
}

std::string StepTable(const RolloutResiduals& residuals, const DiscretisationCheck* check) {
  if (check == nullptr || check->bias.size() == 0) {
    return "";
  }
  std::vector<std::vector<std::string>> rows;
  for (Eigen::Index k = 0; k < check->bias.size(); ++k) {
    rows.push_back({residuals.scene().entries()[k].name,
                    CompactNumber(check->estimate_half_step[k], 8),
                    CompactNumber(check->difference[k], 3), CompactNumber(check->bias[k], 3),
                    CompactNumber(check->extrapolated[k], 8)});
  }
  return "<h2>Bias of the step</h2>\n<p>The same fit with half the step, dt / 2 = " +
         CompactNumber(0.5 * check->dt) + " s.</p>\n" +
         HtmlTable({"parameter", "estimate at dt / 2", "difference", "bias to first order",
                    "extrapolated"},
                   rows);
}

std::string StartTable(const FitResult& result) {
  if (result.starts.size() < 2) {
    return "";
  }
  std::vector<std::vector<std::string>> rows;
  for (const FitStart& start : result.starts) {
    std::string initial;
    for (const double x : start.initial) {
      initial += (initial.empty() ? "" : ", ") + CompactNumber(x, 4);
    }
    rows.push_back({"(" + initial + ")", start.status, CompactNumber(start.cost),
                    std::to_string(start.iterations)});
  }
  return "<h2>Starts</h2>\n" + HtmlTable({"initial", "status", "cost", "iterations"}, rows);
}

}  // namespace

std::string FitReport(const std::string& title, const RolloutResiduals& residuals,
                      const FitResult& result, const DiscretisationCheck* check) {
  const std::string heading = "Fit: " + title;
  return HtmlPage(heading, "<h1>" + HtmlEscape(heading) + "</h1>\n<h2>Estimates</h2>\n" +
                               EstimateTable(residuals, result) + Warnings(result.uncertainty) +
                               CombinationTable(result.uncertainty) + SummaryTable(result) +
                               CorrelationTable(residuals, result) + StepTable(residuals, check) +
                               StartTable(result) + IterationPlots(residuals, result) +
                               SeriesPlots(CollectSeries(residuals, result)));
}

}  // namespace tangible
