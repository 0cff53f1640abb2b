// SPDX-License-Identifier: Apache-2.0
//
// The result of a fit as JSON.
#include <cmath>
#include <map>

#include "tangible/estimation/fit/motion_check.h"
#include "tangible/estimation/results/design_output.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/estimation/results/missing_output.h"
#include "tangible/estimation/results/noise_output.h"
#include "tangible/estimation/results/posterior_output.h"
#include "tangible/estimation/results/residual_summary.h"

namespace tangible {
namespace {

OrderedJson Number(double x) { return std::isfinite(x) ? OrderedJson(x) : OrderedJson(nullptr); }

OrderedJson Numbers(const Eigen::VectorXd& values) {
  OrderedJson array = OrderedJson::array();
  for (const double x : values) {
    array.push_back(Number(x));
  }
  return array;
}

OrderedJson IntervalToJson(const ConfidenceInterval& interval) {
  return interval ? OrderedJson{Number(interval->first), Number(interval->second)}
                  : OrderedJson(nullptr);
}

OrderedJson ParametersToJson(const RecordingsProblem& problem, const FitResult& result) {
  OrderedJson parameters = OrderedJson::array();
  const std::vector<ParameterEntry>& entries = problem.entries();
  for (Eigen::Index k = 0; k < result.estimate.size(); ++k) {
    const Uncertainty& uncertainty = result.uncertainty;
    OrderedJson parameter = {
        {"name", entries[k].name},
        {"estimate", Number(result.estimate[k])},
        {"standard_deviation_robust", Number(uncertainty.standard_deviation_robust[k])},
        {"confidence_95_robust", IntervalToJson(uncertainty.confidence_95_robust[k])},
        {"degrees_of_freedom", Number(uncertainty.degrees_of_freedom[k])},
        {"standard_deviation", Number(uncertainty.standard_deviation[k])},
        {"confidence_95", IntervalToJson(uncertainty.confidence_95[k])}};
    const FinalInterval interval = static_cast<size_t>(k) < result.intervals.size()
                                       ? result.intervals[static_cast<size_t>(k)]
                                       : FinalInterval();
    if (interval.exists) {
      parameter["interval_95"] = {
          interval.low ? OrderedJson(*interval.low) : OrderedJson(nullptr),
          interval.high ? OrderedJson(*interval.high) : OrderedJson(nullptr)};
      parameter["interval_method"] = interval.method;
    } else {
      parameter["interval_95"] = nullptr;
    }
    if (k < uncertainty.drift_p_value.size() && std::isfinite(uncertainty.drift_p_value[k])) {
      parameter["drift_p_value"] = uncertainty.drift_p_value[k];
    }
    if (uncertainty.prior_share[k] > 0.0) {
      parameter["prior_share"] = Number(uncertainty.prior_share[k]);
    }
    if (!result.uncertainty.messages[k].empty()) {
      parameter["message"] = result.uncertainty.messages[k];
    }
    const int recording = problem.RecordingOf(static_cast<int>(k));
    if (recording >= 0) {
      parameter["recording"] = problem.recordings()[recording].name;
    }
    parameters.push_back(parameter);
  }
  return parameters;
}

OrderedJson CovarianceToJson(const RowMatrixXd& covariance) {
  OrderedJson rows = OrderedJson::array();
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    rows.push_back(Numbers(covariance.row(i)));
  }
  return rows;
}

OrderedJson CombinationsToJson(const std::vector<ParameterEntry>& entries,
                               const Uncertainty& uncertainty) {
  OrderedJson all = OrderedJson::array();
  for (const DeterminedCombination& combination : uncertainty.combinations) {
    OrderedJson terms = OrderedJson::array();
    for (size_t i = 0; i < combination.parameters.size(); ++i) {
      terms.push_back({{"name", entries[combination.parameters[i]].name},
                       {"coefficient", Number(combination.coefficients[i])},
                       {"exponent", Number(combination.exponents[i])}});
    }
    all.push_back({{"sum", combination.sum},
                   {"product", combination.product.empty() ? OrderedJson(nullptr)
                                                           : OrderedJson(combination.product)},
                   {"terms", terms},
                   {"value", Number(combination.value)},
                   {"standard_deviation_robust", Number(combination.standard_deviation_robust)},
                   {"standard_deviation", Number(combination.standard_deviation)}});
  }
  return all;
}

OrderedJson HeldToJson(const FitResult& result) {
  OrderedJson all = OrderedJson::array();
  for (const HeldParameter& held : result.held) {
    all.push_back({{"path", held.path},
                   {"held_at", Number(held.value)},
                   {"change", Number(held.change)},
                   {"cost_share", Number(held.cost_share)},
                   {"refitted", held.refitted},
                   {"releases", held.releases}});
    if (held.refitted) {
      all.back()["refitted_value"] = Number(held.refitted_value);
      all.back()["refitted_cost_share"] = Number(held.refitted_share);
    }
  }
  return all;
}

/// How the robust intervals were computed.
OrderedJson RobustToJson(const Uncertainty& uncertainty) {
  return {{"method", NameOf(uncertainty.robust_method)},
          {"bandwidth", Number(uncertainty.bandwidth)},
          {"residual_correlation", Number(uncertainty.whiteness.correlation)},
          {"whiteness_p_value", Number(uncertainty.whiteness.p_value)}};
}

OrderedJson IterationsToJson(const FitResult& result) {
  OrderedJson iterations = OrderedJson::array();
  for (const FitIteration& iteration : result.iterations) {
    iterations.push_back({{"cost", Number(iteration.cost)},
                          {"gradient_norm", Number(iteration.gradient_norm)},
                          {"parameters", iteration.parameters},
                          {"seconds", iteration.seconds}});
  }
  return iterations;
}

OrderedJson StartsToJson(const FitResult& result) {
  OrderedJson starts = OrderedJson::array();
  for (const FitStart& start : result.starts) {
    starts.push_back({{"initial", start.initial},
                      {"status", start.status},
                      {"cost", Number(start.cost)},
                      {"iterations", start.iterations},
                      {"approach", start.approach},
                      {"approach_iterations", start.approach_iterations},
                      {"plain_cost", Number(start.plain_cost)},
                      {"estimate", start.estimate}});
    if (!start.tried.empty()) {
      starts.back().update({{"tried", start.tried}, {"tried_cost", Number(start.tried_cost)}});
    }
    if (!start.message.empty()) {
      starts.back()["message"] = start.message;
    }
  }
  return starts;
}

OrderedJson ProfilesToJson(const std::vector<ParameterEntry>& entries, const FitResult& result) {
  OrderedJson all = OrderedJson::array();
  for (const Profile& profile : result.profiles) {
    OrderedJson values = OrderedJson::array();
    OrderedJson costs = OrderedJson::array();
    for (const ProfilePoint& point : profile.points) {
      values.push_back(Number(point.value));
      costs.push_back(Number(point.cost));
    }
    OrderedJson branches = OrderedJson::array();
    for (const ProfileBranch& branch : profile.branches) {
      branches.push_back({branch.low ? OrderedJson(*branch.low) : OrderedJson(nullptr),
                          branch.high ? OrderedJson(*branch.high) : OrderedJson(nullptr)});
    }
    all.push_back({{"name", entries[static_cast<size_t>(profile.parameter)].name},
                   {"why", profile.why},
                   {"rise", Number(profile.rise)},
                   {"values", values},
                   {"costs", costs},
                   {"branches", branches}});
  }
  return all;
}

/// Root mean squares in m and rad.
OrderedJson RmsByCoordinate(const RecordingsProblem& problem, const FitResult& result) {
  std::map<std::string, std::pair<double, int>> sums;
  Eigen::Index i = 0;
  for (const RecordedRun& recording : problem.recordings()) {
    for (const Observation& observation : recording.residuals.observations()) {
      if (i == result.residuals.size()) {
        break;  // there is no estimate
      }
      const double difference = result.residuals[i++] * observation.sigma;
      auto& [sum, count] = sums[NameOf(observation.coordinate)];
      sum += difference * difference;
      ++count;
    }
  }
  OrderedJson json = OrderedJson::object();
  for (const auto& [name, sum] : sums) {
    json[name] = std::sqrt(sum.first / sum.second);
  }
  return json;
}

/// The observed body or point and coordinate, its reference, file and sensor.
OrderedJson NameToJson(const SeriesSummary& series) {
  OrderedJson json = {{series.kind, series.target}, {"coordinate", NameOf(series.coordinate)}};
  const auto add = [&json](const char* key, const std::string& name) {
    if (!name.empty()) {
      json[key] = name;
    }
  };
  add("recording", series.recording);
  add("relative_to", series.relative_to);
  add("file", series.file);
  add("sensor", series.sensor);
  return json;
}

OrderedJson SeriesToJson(const ResidualSummary& summary) {
  OrderedJson all = OrderedJson::array();
  for (const SeriesSummary& series : summary.series) {
    OrderedJson json = NameToJson(series);
    json.update({{"unit", series.unit},
                 {"count", series.count},
                 {"rms", Number(series.rms)},
                 {"mean", Number(series.mean)},
                 {"rms_in_sigma", Number(series.rms_in_sigma)},
                 {"largest_in_sigma", Number(series.largest_in_sigma)},
                 {"largest_time", Number(series.largest_time)},
                 {"outliers", series.outliers}});
    all.push_back(json);
  }
  return all;
}

OrderedJson OutliersToJson(const ResidualSummary& summary) {
  OrderedJson largest = OrderedJson::array();
  for (const Outlier& outlier : summary.outliers) {
    const SeriesSummary& series = summary.series[outlier.series];
    OrderedJson json = NameToJson(series);
    json["time"] = Number(outlier.time);
    json["residual_in_sigma"] = Number(outlier.residual);
    largest.push_back(json);
  }
  return {{"count", summary.num_outliers}, {"largest", largest}};
}

OrderedJson HorizonToJson(const HorizonError& error) {
  return {{"from", error.from},
          {"to", error.to},
          {"count", error.count},
          {"rms_in_sigma", Number(error.rms_in_sigma)},
          {"rms_length", Number(error.rms_length)},
          {"max_length", Number(error.max_length)},
          {"rms_angle", Number(error.rms_angle)},
          {"max_angle", Number(error.max_angle)}};
}

OrderedJson PredictionToJson(const PredictionScore& score) {
  OrderedJson horizons = OrderedJson::array();
  for (const HorizonError& error : score.horizons) {
    horizons.push_back(HorizonToJson(error));
  }
  return {{"from", Number(score.from)},
          {"message", score.message},
          {"all", HorizonToJson(score.all)},
          {"horizons", horizons}};
}

/// The errors of all held-out recordings, and the window of their states where one was looked for.
OrderedJson HeldOutToJson(const HeldOutRuns& held_out) {
  OrderedJson json = PredictionToJson(held_out.score);
  if (held_out.window.tried.empty()) return json;
  const auto seconds = [](double s) { return s > 0.0 ? OrderedJson(s) : OrderedJson(nullptr); };
  OrderedJson tried = OrderedJson::array();
  for (const WindowError& one : held_out.window.tried) {
    tried.push_back({{"seconds", seconds(one.seconds)}, {"rms_in_sigma", Number(one.error)}});
  }
  json["state_window"] = {{"seconds", seconds(held_out.window.seconds)}, {"tried", tried}};
  return json;
}

OrderedJson CheckToJson(const std::vector<ParameterEntry>& entries,
                        const DiscretisationCheck& check) {
  OrderedJson parameters = OrderedJson::array();
  for (Eigen::Index k = 0; k < check.bias.size(); ++k) {
    parameters.push_back({{"name", entries[k].name},
                          {"estimate_half_step", Number(check.estimate_half_step[k])},
                          {"difference", Number(check.difference[k])},
                          {"bias", Number(check.bias[k])},
                          {"extrapolated", Number(check.extrapolated[k])}});
  }
  return {
      {"dt", check.dt},           {"order", check.order},       {"status", NameOf(check.status)},
      {"parameters", parameters}, {"rollouts", check.rollouts}, {"seconds", check.seconds}};
}

/// What was found of the noise of sensors.
OrderedJson NoiseToJson(const std::vector<SensorNoise>& noise) {
  OrderedJson all = OrderedJson::array();
  for (const SensorNoise& sensor : noise) {
    all.push_back({{"sensor", sensor.name},
                   {"sigma_factor", Number(sensor.factor)},
                   {"standard_deviation", Number(sensor.deviation)},
                   {"observations", sensor.count},
                   {"redundancy", Number(sensor.redundancy)}});
  }
  return all;
}

/// How far parameters vary from recording to recording.
OrderedJson SpreadsToJson(const std::vector<SpreadEstimate>& spreads) {
  OrderedJson all = OrderedJson::array();
  for (const SpreadEstimate& spread : spreads) {
    const bool gaussian = spread.kind == PriorKind::kGaussian;
    all.push_back({{"name", spread.name},
                   {"distribution", gaussian ? "gaussian" : "log_normal"},
                   {"spread", Number(spread.spread)},
                   {"confidence_95", IntervalToJson(spread.interval)},
                   {"estimated", spread.estimated},
                   {"recordings", spread.recordings}});
  }
  return all;
}

/// The recordings with the role `predict`, beside those that identify.
OrderedJson HeldOutToJson(const HeldOutRun& run) {
  OrderedJson start = OrderedJson::array();
  for (size_t i = 0; i < run.fitted.size() && run.parameters.size() > 0; ++i) {
    start.push_back({{"name", run.entries[run.fitted[i]].name},
                     {"estimate", Number(run.parameters[run.fitted[i]])},
                     {"standard_deviation", Number(run.deviations[static_cast<Eigen::Index>(i)])}});
  }
  return {{"name", run.name},
          {"role", "predict"},
          {"state_from", run.state_from},
          {"status", NameOf(run.status)},
          {"message", run.message},
          {"state", start},
          {"state_time", run.begins},
          {"residuals", run.residuals.size()},
          {"residual_rms", Number(run.residual_rms)},
          {"prediction_rms", Number(run.later.score.all.rms_in_sigma)},
          {"prediction", PredictionToJson(run.later.score)}};
}

OrderedJson RecordingsToJson(const RecordingsProblem& problem, const FitResult& result,
                             const FitFindings& findings) {
  const PredictedRecordings* const later = findings.later;
  OrderedJson all = OrderedJson::array();
  for (int b = 0; b < problem.num_blocks(); ++b) {
    all.push_back({{"name", problem.recordings()[b].name},
                   {"residuals", problem.num_observation_rows(b)},
                   {"weight", problem.weight(b)},
                   {"residual_rms", Number(RmsOfRecording(problem, result.residuals, b))}});
    if (later != nullptr) {
      all.back()["prediction_rms"] = Number(later->runs[b].score.all.rms_in_sigma);
    }
    if (findings.held_out != nullptr) all.back()["role"] = "identify";
  }
  if (findings.held_out == nullptr) return all;
  for (const HeldOutRun& run : findings.held_out->runs) {
    all.insert(all.begin() + run.place, HeldOutToJson(run));
  }
  return all;
}

/// A matrix of many parameters of single recordings is larger than all else.
OrderedJson CovarianceOf(const RecordingsProblem& problem, const RowMatrixXd& covariance) {
  constexpr Eigen::Index kMostInMatrix = 100;
  const bool any_own = static_cast<int>(problem.entries().size()) > problem.num_shared();
  return any_own && covariance.rows() > kMostInMatrix ? OrderedJson(nullptr)
                                                      : CovarianceToJson(covariance);
}

OrderedJson EstimatesToJson(const RecordingsProblem& problem, const FitResult& result) {
  const Uncertainty& uncertainty = result.uncertainty;
  const bool estimated = result.estimate.size() > 0;
  const auto when = [estimated](double x) { return estimated ? Number(x) : OrderedJson(nullptr); };
  long residuals = 0;
  for (int block = 0; block < problem.num_blocks(); ++block) {
    residuals += problem.num_observation_rows(block);
  }
  return {{"status", NameOf(result.status)},
          {"parameters", ParametersToJson(problem, result)},
          {"robust", RobustToJson(uncertainty)},
          {"determined_combinations", CombinationsToJson(problem.entries(), uncertainty)},
          {"held_parameters", HeldToJson(result)},
          {"covariance", CovarianceOf(problem, uncertainty.covariance)},
          {"initial_cost", when(result.initial_cost)},
          {"final_cost", when(result.final_cost)},
          {"residual_rms", when(uncertainty.residual_rms)},
          {"reduced_chi_square", when(uncertainty.reduced_chi_square)},
          {"residuals", residuals},
          {"condition", when(uncertainty.condition)},
          {"iterations", IterationsToJson(result)},
          {"starts", StartsToJson(result)},
          {"agreement", result.agreement},
          {"profiles", ProfilesToJson(problem.entries(), result)},
          {"rollouts", result.rollouts},
          {"seconds", result.seconds},
          {"warnings", uncertainty.warnings},
          {"message", result.message}};
}

}  // namespace

OrderedJson MotionToJson(const std::vector<ParameterEntry>& entries, const MotionCheck& check) {
  if (!check.message.empty()) return {{"message", check.message}};
  OrderedJson differences = OrderedJson::array();
  for (size_t k = 0; k < entries.size(); ++k) {
    differences.push_back({{"parameter", entries[k].name},
                           {"difference", check.difference[static_cast<Eigen::Index>(k)]}});
  }
  return {{"differences", differences},
          {"difference_max", check.difference.size() == 0 ? 0.0 : check.difference.maxCoeff()},
          {"verdict", check.verdict}};
}

OrderedJson ResultToJson(const RecordingsProblem& problem, const FitResult& result,
                         const FitFindings& findings) {
  const ResidualSummary summary = SummarizeResiduals(problem, result.residuals);
  OrderedJson json = EstimatesToJson(problem, result);
  json["residual_rms_by_coordinate"] = RmsByCoordinate(problem, result);
  json["residuals_by_series"] = SeriesToJson(summary);
  json["outliers"] = OutliersToJson(summary);
  if (problem.IsNamed()) {
    json["recordings"] = RecordingsToJson(problem, result, findings);
  }
  if (findings.check != nullptr) {
    json["discretisation"] = CheckToJson(problem.entries(), *findings.check);
  }
  if (findings.later != nullptr) {
    json["prediction"] = PredictionToJson(findings.later->score);
  }
  if (findings.held_out != nullptr) {
    json["held_out"] = HeldOutToJson(*findings.held_out);
  }
  if (findings.posterior != nullptr) {
    json["posterior"] = PosteriorToJson(problem.entries(), *findings.posterior);
  }
  if (findings.design != nullptr) {
    json["design"] = DesignToJson(problem.entries(), *findings.design);
  }
  if (findings.missing != nullptr) {
    json["missing"] = MissingToJson(*findings.missing);
    json["missing_summary"] = MissingSummaryToJson(*findings.missing);
  }
  if (findings.components != nullptr && !findings.components->noise.empty()) {
    json["sensor_noise"] = NoiseToJson(findings.components->noise);
  }
  if (findings.components != nullptr && !findings.components->spreads.empty()) {
    json["spreads"] = SpreadsToJson(findings.components->spreads);
  }
  if (findings.components != nullptr && !findings.components->forces.empty()) {
    json["process_noise"] = ProcessNoiseToJson(*findings.components);
    json["smoothed_states"] = SmoothedStatesToJson(*findings.components);
  }
  return json;
}

}  // namespace tangible
