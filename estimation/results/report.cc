// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/report.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "tangible/estimation/fit/profile.h"
#include "tangible/estimation/results/design_output.h"
#include "tangible/estimation/results/missing_output.h"
#include "tangible/estimation/results/noise_output.h"
#include "tangible/estimation/results/posterior_output.h"
#include "tangible/estimation/results/report_motion.h"
#include "tangible/estimation/results/residual_summary.h"
#include "tangible/estimation/results/residual_tests.h"
#include "tangible/render/html.h"
#include "tangible/render/plot.h"

namespace tangible {
namespace {

// More coordinates, or parameters, than this are listed but not drawn.
constexpr size_t kMostPlots = 24;
// A plot is about twice this many pixels wide. Of more points only the extremes of each bucket are
// drawn.
constexpr int kBuckets = 360;
// Rows of a table of series or recordings: more are in the result as JSON.
constexpr size_t kMostRows = 500;
// A table of the correlations of more parameters is too large to be read.
constexpr size_t kMostCorrelations = 60;

/// One series of observations with its fitted values.
struct Series {
  std::string label;
  std::string unit;
  std::vector<double> time, observed, fitted, residual;
};

/// The first series of a recording, at most `most`; `values` are its residuals.
std::vector<Series> CollectSeries(const RecordedRun& recording, const Eigen::VectorXd& values,
                                  size_t most) {
  const RolloutResiduals& residuals = recording.residuals;
  const std::vector<Observation>& observations = residuals.observations();
  const ObservationSeries index = IndexSeries(observations);
  std::vector<std::vector<int>> members(std::min<size_t>(index.first.size(), most));
  for (int i = 0; i < residuals.num_residuals(); ++i) {
    if (static_cast<size_t>(index.of[i]) < members.size()) {
      members[index.of[i]].push_back(i);
    }
  }
  std::vector<Series> all;
  for (std::vector<int>& indices : members) {
    std::stable_sort(indices.begin(), indices.end(),
                     [&](int a, int b) { return observations[a].time < observations[b].time; });
    const Observation& first = observations[indices.front()];
    Series series;
    series.label =
        (recording.name.empty() ? "" : recording.name + ": ") + SeriesLabel(residuals, first);
    series.unit = UnitOf(residuals, first);
    for (const int i : indices) {
      const Observation& observation = observations[i];
      const double residual = values[i];
      series.time.push_back(observation.time);
      series.observed.push_back(observation.value);
      series.fitted.push_back(observation.value + residual * observation.sigma);
      series.residual.push_back(residual);
    }
    all.push_back(std::move(series));
  }
  return all;
}

/// The first series of all recordings, at most kMostPlots.
std::vector<Series> CollectSeries(const RecordingsProblem& problem, const FitResult& result) {
  std::vector<Series> all;
  Eigen::Index first = 0;
  for (const RecordedRun& recording : problem.recordings()) {
    const Eigen::Index rows = recording.residuals.num_residuals();
    if (all.size() < kMostPlots) {
      for (Series& series : CollectSeries(recording, result.residuals.segment(first, rows),
                                          kMostPlots - all.size())) {
        all.push_back(std::move(series));
      }
    }
    first += rows;
  }
  return all;
}

std::string EstimateTable(const std::vector<ParameterEntry>& entries, const FitResult& result) {
  const auto number = [](double x) {
    return std::isfinite(x) ? CompactNumber(x, 3) : std::string();
  };
  std::vector<std::vector<std::string>> rows;
  const Uncertainty& uncertainty = result.uncertainty;
  for (size_t k = 0; k < entries.size(); ++k) {
    const Eigen::Index i = static_cast<Eigen::Index>(k);
    const FinalInterval interval =
        k < result.intervals.size() ? result.intervals[k] : FinalInterval();
    const double robust = uncertainty.standard_deviation_robust[i];
    rows.push_back({entries[k].name, CompactNumber(result.starts.front().initial[k], 6),
                    CompactNumber(result.estimate[i], 9),
                    number(std::isfinite(robust) ? robust : uncertainty.standard_deviation[i]),
                    interval.exists ? Describe(interval) : "", interval.method,
                    number(uncertainty.degrees_of_freedom[i]),
                    uncertainty.prior_share[i] > 0.0
                        ? CompactNumber(100.0 * uncertainty.prior_share[i], 2) + " %"
                        : "",
                    uncertainty.messages[k]});
  }
  return HtmlTable({"parameter", "initial", "estimate", "standard deviation", "95 % interval",
                    "method", "degrees of freedom", "by priors", ""},
                   rows) +
         "<p>" + HtmlEscape(DescribeRobust(uncertainty)) + ".</p>\n";
}

/// The cost by the value of each parameter that has a profile, up to some rises above the minimum.
std::string ProfilePlots(const std::vector<ParameterEntry>& entries, const FitResult& result) {
  std::string html;
  for (const Profile& profile : result.profiles) {
    constexpr double kHighest = 6.0;  // of the rise: higher costs would flatten the rest
    std::vector<double> values, costs;
    for (const ProfilePoint& point : profile.points) {
      if (point.cost <= result.final_cost + kHighest * profile.rise) {
        values.push_back(point.value);
        costs.push_back(point.cost);
      }
    }
    if (values.size() < 2) {
      continue;
    }
    const double limit = result.final_cost + profile.rise;
    const std::string& name = entries[static_cast<size_t>(profile.parameter)].name;
    html +=
        PlotSvg({.title = name + " (" + profile.why + ")",
                 .x_label = name,
                 .y_label = "cost",
                 .height = 260},
                {{"profile", values, costs, PlotStyle::kLineAndPoints, {}},
                 {"95 %", {values.front(), values.back()}, {limit, limit}, PlotStyle::kLine, {}}});
  }
  return html.empty() ? "" : "<h2>Profiles</h2>\n" + html;
}

/// The combinations that are determined of parameters that are not determined individually.
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
  const std::string& verdict = result.certificate.verdict;
  std::vector<std::vector<std::string>> rows = {
      {"status", NameOf(result.status)},
      {"message", result.message},
      {"measured coordinates", std::to_string(result.residuals.size())},
      {"cost at the initial values", CompactNumber(result.initial_cost)},
      {"cost at the estimate", CompactNumber(result.final_cost)},
      {"residual rms (sigma)", CompactNumber(uncertainty.residual_rms, 4)},
      {"reduced chi-square", CompactNumber(uncertainty.reduced_chi_square, 4)},
      {"condition of the Jacobian", CompactNumber(uncertainty.condition, 3)},
      {"derivatives at the estimate", verdict.empty() ? "not examined" : verdict},
      {"iterations", std::to_string(result.iterations.size() - 1)},
      {"rollouts", std::to_string(result.rollouts)},
      {"seconds", CompactNumber(result.seconds, 3)}};
  const std::string advice = AdviceOf(result.certificate);
  if (!advice.empty()) rows.push_back({"advice", advice});
  return HtmlTable({"", ""}, rows);
}

/// How far each parameter may be changed until a contact, an event or its order changes.
std::string RadiusTable(const Certificate& certificate) {
  std::vector<std::vector<std::string>> rows;
  const auto side = [](double distance) {
    return std::isfinite(distance) ? CompactNumber(distance, 3) : "none in its range";
  };
  for (const ValidityRadius& radius : certificate.radius) {
    rows.push_back(
        {radius.parameter, side(radius.down), radius.down_where, side(radius.up), radius.up_where});
  }
  if (rows.empty()) return "";
  std::string html =
      "<h2>Where the derivatives hold</h2>\n<p>A parameter may be changed by so much, "
      "to first order, until another discrete choice is made.";
  if (std::isfinite(certificate.growth)) {
    html += " The run multiplies small changes of its start by at most " +
            CompactNumber(certificate.growth, 3) + ".";
  }
  return html + "</p>\n" +
         HtmlTable({"parameter", "down", "what changes", "up", "what changes"}, rows);
}

std::string Warnings(const Uncertainty& uncertainty) {
  std::string html;
  for (const std::string& warning : uncertainty.warnings) {
    html += "<p><strong>Warning:</strong> " + HtmlEscape(warning) + "</p>\n";
  }
  return html;
}

std::string CorrelationTable(const std::vector<ParameterEntry>& entries, const FitResult& result) {
  if (entries.size() < 2) {
    return "";
  }
  if (entries.size() > kMostCorrelations) {
    return "<p>Correlations of more than " + std::to_string(kMostCorrelations) +
           " parameters are left out; the result as JSON has the covariance.</p>\n";
  }
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
  return "<h2>Correlation</h2>\n" + HtmlTable(header, rows);
}

std::string IterationPlots(const std::vector<ParameterEntry>& entries, const FitResult& result) {
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
  if (entries.size() > kMostPlots) {
    html += "<p>The first " + std::to_string(kMostPlots) + " of " + std::to_string(entries.size()) +
            " parameters are drawn.</p>\n";
  }
  for (size_t k = 0; k < std::min(entries.size(), kMostPlots); ++k) {
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

std::string FirstOf(size_t shown, size_t all) {
  return shown < all ? "<p>The first " + std::to_string(shown) + " of " + std::to_string(all) +
                           " are listed; the result as JSON has all.</p>\n"
                     : "";
}

std::string ResidualTable(const ResidualSummary& summary) {
  std::vector<std::vector<std::string>> rows;
  for (const SeriesSummary& series : summary.series) {
    if (rows.size() == kMostRows) {
      break;
    }
    const std::string unit = " " + series.unit;
    rows.push_back({series.recording, series.target, series.relative_to, NameOf(series.coordinate),
                    series.file, series.sensor, std::to_string(series.count),
                    CompactNumber(series.rms_in_sigma, 4), CompactNumber(series.rms, 4) + unit,
                    CompactNumber(series.mean, 3) + unit, CompactNumber(series.largest_in_sigma, 4),
                    CompactNumber(series.largest_time, 6), std::to_string(series.outliers)});
  }
  return "<h2>Residuals</h2>\n" + FirstOf(rows.size(), summary.series.size()) +
         HtmlTable({"recording", "body or point", "relative to", "coordinate", "file", "sensor",
                    "measured", "rms (sigma)", "rms", "mean of fitted − observed",
                    "largest (sigma)", "at (s)", "outliers"},
                   rows);
}

std::string OutlierTable(const ResidualSummary& summary) {
  if (summary.num_outliers == 0) {
    return "";
  }
  std::vector<std::vector<std::string>> rows;
  for (const Outlier& outlier : summary.outliers) {
    rows.push_back({summary.series[outlier.series].label, CompactNumber(outlier.time, 8),
                    CompactNumber(outlier.residual, 4)});
  }
  return "<h2>Outliers</h2>\n<p>" + std::to_string(summary.num_outliers) +
         " residuals are larger than five times what is usual in their series" +
         (rows.size() < static_cast<size_t>(summary.num_outliers)
              ? "; the largest " + std::to_string(rows.size())
              : "") +
         ":</p>\n" + HtmlTable({"coordinate", "time (s)", "fitted − observed (sigma)"}, rows);
}

std::string SeriesPlots(const std::vector<Series>& all, size_t num_series) {
  std::string html = "<h2>Observed and fitted</h2>\n";
  bool thinned = false;
  const auto thin = [&thinned](const PlotSeries& series) {
    PlotSeries thin = Thinned(series, kBuckets);
    thinned = thinned || thin.x.size() < series.x.size();
    return thin;
  };
  std::string plots;
  for (const Series& series : all) {
    plots += PlotSvg(
        {.title = series.label, .x_label = "time (s)", .y_label = series.unit, .height = 240},
        {thin({"observed", series.time, series.observed, PlotStyle::kPoints, {}}),
         thin({"fitted", series.time, series.fitted, PlotStyle::kLine, {}})});
    plots += PlotSvg({.title = series.label + ": fitted − observed",
                      .x_label = "time (s)",
                      .y_label = "sigma",
                      .height = 220},
                     {thin({"", series.time, series.residual, PlotStyle::kPoints, {}})});
  }
  if (all.size() < num_series) {
    html += "<p>The first " + std::to_string(all.size()) + " of " + std::to_string(num_series) +
            " measured coordinates are drawn.</p>\n";
  }
  if (thinned) {
    html += "<p>The plots are thinned: of each of " + std::to_string(kBuckets) +
            " equal parts of the time the smallest and the largest value are drawn.</p>\n";
  }
  return html + plots;
}

/// The error of observations that were not fitted, over the horizon of the prediction.
std::string PredictionPart(const std::string& title, const PredictionScore* score) {
  if (score == nullptr) {
    return "";
  }
  std::string html = "<h2>" + title + "</h2>\n<p>Fitted to observations up to " +
                     (std::isfinite(score->from) ? CompactNumber(score->from) + " s."
                                                 : "a time of each recording's own.");
  if (!score->message.empty()) {
    return html + " <strong>The run beyond fails:</strong> " + HtmlEscape(score->message) +
           "</p>\n";
  }
  const auto text = [](double x) { return std::isfinite(x) ? CompactNumber(x, 4) : ""; };
  html += " Beyond, " + std::to_string(score->all.count) +
          " measured coordinates are predicted with an rms of " +
          CompactNumber(score->all.rms_in_sigma, 4) + " sigma.</p>\n";
  std::vector<std::vector<std::string>> rows;
  std::vector<double> horizon, length, max_length, angle, max_angle;
  for (const HorizonError& error : score->horizons) {
    rows.push_back({CompactNumber(error.from, 4), CompactNumber(error.to, 4),
                    std::to_string(error.count), text(error.rms_in_sigma), text(error.rms_length),
                    text(error.max_length), text(error.rms_angle), text(error.max_angle)});
    horizon.push_back(0.5 * (error.from + error.to));
    length.push_back(error.rms_length);
    max_length.push_back(error.max_length);
    angle.push_back(error.rms_angle);
    max_angle.push_back(error.max_angle);
  }
  const auto plot = [&](const char* unit, const std::vector<double>& rms,
                        const std::vector<double>& max) {
    const bool any = std::any_of(rms.begin(), rms.end(), [](double x) { return std::isfinite(x); });
    return any ? PlotSvg({.title = "error of predictions",
                          .x_label = "time after " + CompactNumber(score->from) + " s (s)",
                          .y_label = unit,
                          .y_scale = AxisScale::kLogarithmic,
                          .height = 280},
                         {{"rms", horizon, rms, PlotStyle::kLineAndPoints, {}},
                          {"largest", horizon, max, PlotStyle::kLineAndPoints, {}}})
               : std::string();
  };
  return html + plot("m", length, max_length) + plot("rad", angle, max_angle) +
         HtmlTable({"from (s after)", "to", "measured", "rms (sigma)", "rms (m)", "largest (m)",
                    "rms (rad)", "largest (rad)"},
                   rows);
}

std::string StepTable(const std::vector<ParameterEntry>& entries,
                      const DiscretisationCheck* check) {
  if (check == nullptr || check->bias.size() == 0) {
    return "";
  }
  std::vector<std::vector<std::string>> rows;
  for (Eigen::Index k = 0; k < check->bias.size(); ++k) {
    rows.push_back({entries[k].name, CompactNumber(check->estimate_half_step[k], 8),
                    CompactNumber(check->difference[k], 3), CompactNumber(check->bias[k], 3),
                    CompactNumber(check->extrapolated[k], 8)});
  }
  return "<h2>Bias of the step</h2>\n<p>The same fit with half the step, dt / 2 = " +
         CompactNumber(0.5 * check->dt) + " s. The step is of " + OrderName(check->order) +
         " order, so that the bias is " + CompactNumber(BiasFactor(check->order), 4) +
         " times the difference.</p>\n" +
         HtmlTable({"parameter", "estimate at dt / 2", "difference", "bias", "extrapolated"}, rows);
}

std::string StartTable(const FitResult& result) {
  const bool one = result.starts.size() == 1;
  if (result.starts.empty() ||
      (one && result.starts[0].approach == "plain" && result.starts[0].tried.empty())) {
    return "";
  }
  std::vector<std::vector<std::string>> rows;
  for (const FitStart& start : result.starts) {
    std::string initial;
    for (const double x : start.initial) {
      initial += (initial.empty() ? "" : ", ") + CompactNumber(x, 4);
    }
    rows.push_back({"(" + initial + ")", start.approach, start.status, CompactNumber(start.cost),
                    CompactNumber(start.plain_cost), std::to_string(start.iterations), start.tried,
                    start.tried.empty() ? "" : CompactNumber(start.tried_cost), start.message});
  }
  std::vector<double> rank, cost;
  for (const FitStart& start : result.starts) {
    if (std::isfinite(start.cost)) {
      cost.push_back(start.cost);
      rank.push_back(static_cast<double>(cost.size()));
    }
  }
  std::sort(cost.begin(), cost.end());
  const std::string waterfall = cost.size() < 2
                                    ? ""
                                    : PlotSvg({.title = "costs of the starts, in their order",
                                               .x_label = "rank",
                                               .y_label = "cost",
                                               .y_scale = AxisScale::kLogarithmic,
                                               .height = 260},
                                              {{"", rank, cost, PlotStyle::kLineAndPoints, {}}});
  const std::string agreement =
      result.agreement.empty() ? "" : "<p>" + HtmlEscape(result.agreement) + ".</p>\n";
  return "<h2>Starts</h2>\n" + agreement + waterfall +
         HtmlTable({"initial", "approach", "status", "cost", "cost of the plain fit", "iterations",
                    "also tried", "its cost", ""},
                   rows);
}

std::string SpreadTable(const VarianceComponents* components) {
  if (components == nullptr || components->spreads.empty()) {
    return "";
  }
  std::vector<std::vector<std::string>> rows;
  rows.reserve(components->spreads.size());
  for (const SpreadEstimate& spread : components->spreads) {
    rows.push_back({spread.name, spread.kind == PriorKind::kGaussian ? "gaussian" : "log_normal",
                    CompactNumber(spread.spread, 5),
                    spread.interval ? CompactNumber(spread.interval->first, 4) : "",
                    spread.interval ? CompactNumber(spread.interval->second, 4) : "",
                    spread.estimated ? "" : "given", std::to_string(spread.recordings)});
  }
  return "<h2>What varies from recording to recording</h2>\n" +
         HtmlTable({"parameter", "distribution", "spread", "95 % from", "to", "", "recordings"},
                   rows);
}

std::string NoiseTable(const VarianceComponents* components) {
  if (components == nullptr || components->noise.empty()) {
    return "";
  }
  std::vector<std::vector<std::string>> rows;
  rows.reserve(components->noise.size());
  for (const SensorNoise& noise : components->noise) {
    rows.push_back({noise.name, CompactNumber(noise.factor, 5), CompactNumber(noise.deviation, 2),
                    std::to_string(noise.count)});
  }
  return "<h2>Noise of sensors</h2>\n" +
         HtmlTable({"sensor", "sigma, in multiples of what was given", "standard deviation",
                    "observations"},
                   rows);
}

std::string RecordingTable(const RecordingsProblem& problem, const FitResult& result) {
  if (!problem.IsNamed()) {
    return "";
  }
  std::vector<std::vector<std::string>> rows;
  const size_t all = problem.recordings().size();
  rows.reserve(std::min(all, kMostRows));
  for (int b = 0; b < static_cast<int>(std::min(all, kMostRows)); ++b) {
    rows.push_back({problem.recordings()[b].name, std::to_string(problem.num_observation_rows(b)),
                    CompactNumber(problem.weight(b)),
                    CompactNumber(RmsOfRecording(problem, result.residuals, b), 4)});
  }
  return "<h2>Recordings</h2>\n" + FirstOf(rows.size(), all) +
         HtmlTable({"recording", "observations", "weight", "residual rms (sigma)"}, rows);
}

std::string HeldOutPart(const HeldOutRuns* held_out) {
  if (held_out == nullptr) {
    return "";
  }
  const auto text = [](double x) { return std::isfinite(x) ? CompactNumber(x, 4) : ""; };
  std::vector<std::vector<std::string>> rows;
  const size_t all = held_out->runs.size();
  for (size_t i = 0; i < std::min(all, kMostRows); ++i) {
    const HeldOutRun& run = held_out->runs[i];
    const HorizonError& error = run.later.score.all;
    rows.push_back({run.name, CompactNumber(run.begins, 4), CompactNumber(run.state_from, 4),
                    std::to_string(run.residuals.size()), text(run.residual_rms),
                    std::to_string(error.count), text(error.rms_in_sigma), text(error.rms_length),
                    text(error.max_length), text(error.rms_angle), text(error.max_angle),
                    run.message});
  }
  return PredictionPart("Held-out recordings", &held_out->score) + FirstOf(rows.size(), all) +
         HtmlTable({"recording", "start at (s)", "from observations up to (s)", "observations",
                    "rms (sigma)", "predicted", "rms (sigma)", "rms (m)", "largest (m)",
                    "rms (rad)", "largest (rad)", ""},
                   rows);
}

/// A part under its heading, which shows the rest where it is clicked.
std::string Folded(const std::string& part) {
  const std::string end = "</h2>\n";
  const size_t at = part.find(end);
  if (at == std::string::npos) return part;
  return "<details>\n<summary>" + part.substr(0, at) + "</h2></summary>\n" +
         part.substr(at + end.size()) + "</details>\n";
}

/// What was found, and whether to believe it.
std::string Verdict(const RecordingsProblem& problem, const FitResult& result,
                    const FitFindings& findings) {
  const Uncertainty& uncertainty = result.uncertainty;
  const std::vector<ParameterEntry>& entries = problem.entries();
  const std::string rms = CompactNumber(uncertainty.residual_rms, 3) + " sigma";
  std::vector<std::string> doubts;
  if (result.status != FitStatus::kConverged) {
    doubts.push_back("the fit has not converged (" + result.message + ")");
  }
  if (!uncertainty.warnings.empty()) doubts.push_back(uncertainty.warnings.front());
  const Certificate& certificate = result.certificate;
  if (doubts.empty() && !certificate.verdict.empty() && !IsTrustworthyMap(certificate)) {
    doubts.push_back("the derivatives at the estimate are not trustworthy: " + certificate.verdict);
  }
  std::string text = std::to_string(entries.size()) +
                     (entries.size() == 1 ? " parameter was" : " parameters were") +
                     " found from " + std::to_string(result.residuals.size()) +
                     " measured coordinates, which the fitted motion meets with an rms of " + rms +
                     ". ";
  if (doubts.empty()) {
    text +=
        "Estimates and intervals can be believed: the fit has converged, and its residuals show "
        "nothing that the model misses.";
  } else {
    text += "Take the intervals with care: " + doubts.front() + ".";
  }
  if (findings.missing != nullptr && findings.missing->message.empty()) {
    text += " What would explain the residuals: " + Conclusion(*findings.missing) + ".";
  }
  return "<p class=\"verdict\">" + HtmlEscape(text) + "</p>\n";
}

/// The player of one recording.
std::string MotionPart(const RecordingsProblem& problem, const FitResult& result) {
  const int recording = WorstRecording(problem, result);
  const std::optional<ViewData> motion = ObservedMotion(problem, result, recording);
  if (!motion) return "";
  const ViewOptions small{.max_frames = 1200, .max_entries = 50000};
  return "<h2>Fitted and observed motion</h2>\n" +
         (problem.IsNamed()
              ? "<p>Recording " + HtmlEscape(problem.recordings()[recording].name) +
                    (problem.num_blocks() > 1 ? ", whose residuals are the largest.</p>\n"
                                              : ".</p>\n")
              : std::string()) +
         ViewPart(*motion, small);
}

}  // namespace

std::string FitReport(const std::string& title, const RecordingsProblem& problem,
                      const FitResult& result, const FitFindings& findings) {
  const std::string heading = "Fit: " + title;
  const std::vector<ParameterEntry>& entries = problem.entries();
  const ResidualSummary summary = SummarizeResiduals(problem, result.residuals);
  const PredictionScore* const score = findings.later == nullptr ? nullptr : &findings.later->score;
  std::string body = "<h1>" + HtmlEscape(heading) + "</h1>\n" + Verdict(problem, result, findings) +
                     MotionPart(problem, result) + "<h2>Estimates</h2>\n" +
                     EstimateTable(entries, result) + Warnings(result.uncertainty) +
                     ProfilePlots(entries, result);
  if (findings.posterior != nullptr) body += PosteriorPart(entries, *findings.posterior);
  body += CombinationTable(result.uncertainty) + CorrelationTable(entries, result);
  if (findings.missing != nullptr) body += MissingPart(*findings.missing);
  body += ProcessNoisePart(findings.components) + SpreadTable(findings.components) +
          NoiseTable(findings.components) + PredictionPart("Prediction", score) +
          HeldOutPart(findings.held_out) + RecordingTable(problem, result);
  if (findings.design != nullptr) body += DesignPart(entries, *findings.design);
  body += ResidualTestsPart(problem, result) +
          SeriesPlots(CollectSeries(problem, result), summary.series.size()) +
          Folded(ResidualTable(summary)) + Folded(OutlierTable(summary)) +
          Folded(RadiusTable(result.certificate)) + StepTable(entries, findings.check) +
          StartTable(result) + Folded("<h2>Of the fit</h2>\n" + SummaryTable(result)) +
          Folded(IterationPlots(entries, result));
  return HtmlPage(heading, body);
}

}  // namespace tangible
