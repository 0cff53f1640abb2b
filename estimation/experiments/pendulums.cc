// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/experiments/pendulums.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>

#include "tangible/estimation/experiments/tolerances.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/scene/scene_json.h"

namespace tangible {
namespace {

constexpr double kSingleSeconds = 3.0;
constexpr double kDoubleSeconds = 0.5;
constexpr double kPredictedSeconds = 3.0;

bool WriteObservations(const Recording& recording, const std::string& file, std::string* error) {
  std::error_code failure;
  std::filesystem::create_directories(std::filesystem::path(file).parent_path(), failure);
  // The file is either the old one or the complete new one.
  const std::string temporary = file + ".tmp";
  std::ofstream stream(temporary);
  stream << ObservationCsv(recording);
  stream.close();
  if (stream) {
    std::filesystem::rename(temporary, file, failure);
  }
  if (!stream || failure) {
    *error = file + ": cannot be written";
    std::filesystem::remove(temporary, failure);
    return false;
  }
  return true;
}

double ResidualRms(const std::vector<Observation>& observations, const Eigen::VectorXd& residuals) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < residuals.size(); ++i) {
    const double difference = residuals[i] * observations[i].sigma;
    sum += difference * difference;
  }
  return std::sqrt(sum / static_cast<double>(residuals.size()));
}

/// Runs the scene at the estimate over the next seconds of the recording, which were not fitted.
bool Predict(const PendulumJob& job, const FitProblem& problem, PendulumResult* result,
             std::string* error) {
  RecordingOptions whole = job.window;
  whole.to = job.prediction_to;
  Recording recording;
  FitProblem next = problem;
  next.observations.clear();
  if (!ReadRecording(job.recording, whole, &recording, error) ||
      !ParseObservations(ObservationCsv(recording), job.recording, problem.scene, problem.points,
                         ObservationSigma(), &next.observations, error)) {
    return false;
  }
  const std::unique_ptr<RecordingsProblem> made =
      MakeProblem({job.name, InputOf(std::move(next)), {}}, error);
  if (made == nullptr) {
    return false;
  }
  RolloutResiduals& run = *made->run(0);
  Eigen::VectorXd errors;
  if (!run.Evaluate(result->fit.estimate, problem.options.derivatives, &errors, nullptr)) {
    *error = job.name + ": " + run.message();
    return false;
  }
  const double fitted = job.window.to - job.window.from;
  for (int seconds = 1; seconds <= static_cast<int>(kPredictedSeconds); ++seconds) {
    PredictionError prediction{static_cast<double>(seconds), 0.0};
    for (Eigen::Index i = 0; i < errors.size(); ++i) {
      const double time = run.observations()[i].time;
      if (time > fitted && time <= fitted + seconds + kWindowRounding) {
        prediction.error = std::max(prediction.error, std::abs(errors[i]));
      }
    }
    result->predictions.push_back(prediction);
  }
  return true;
}

bool DeriveAll(const PendulumJob& job, const FitProblem& problem, PendulumResult* result,
               std::string* error) {
  ParameterizedScene scene;
  ParameterError fault;
  if (!scene.Create(problem.scene, problem.points, problem.parameters, &fault)) {
    *error = job.name + ": " + fault.what;
    return false;
  }
  const auto functions = job.window.kind == RecordingKind::kIbmDoublePendulum
                             ? DoublePendulumQuantities()
                             : SinglePendulumQuantities();
  const RowMatrixXd& covariance = result->fit.uncertainty.covariance;
  result->derived = Derive(functions, result->fit.estimate, covariance, &scene);
  const auto fine = Derive(functions, result->check.estimate_half_step, covariance, &scene);
  for (size_t i = 0; i < fine.size(); ++i) {
    result->derived_bias.push_back(BiasFactor(result->check.order) *
                                   (result->derived[i].estimate - fine[i].estimate));
  }
  return true;
}

OrderedJson Interval(double estimate, double deviation, double low, double high, double bias) {
  return {{"estimate", estimate},
          {"standard_deviation", deviation},
          {"confidence_95", {low, high}},
          {"bias_of_step", bias}};
}

}  // namespace

std::vector<PendulumJob> PendulumJobs(const std::string& recordings) {
  const auto window = [](RecordingKind kind, double to) {
    RecordingOptions options;
    options.kind = kind;
    options.to = to;
    return options;
  };
  const RecordingOptions markers = window(RecordingKind::kIbmDoublePendulum, kDoubleSeconds);
  return {
      {"recording_single_pendulum", recordings + "/multiarm_pendulum/single_freeswing_200Hz.csv",
       window(RecordingKind::kMultiarmSingle, kSingleSeconds), kSingleSeconds + kPredictedSeconds},
      {"recording_double_pendulum_0", recordings + "/ibm_double_pendulum/0.csv", markers, 0.0},
      {"recording_double_pendulum_5", recordings + "/ibm_double_pendulum/5.csv", markers, 0.0}};
}

bool RunPendulum(const PendulumJob& job, const std::string& fits, const std::string& out,
                 PendulumResult* result, std::string* error) {
  *result = PendulumResult();
  result->name = job.name;
  FitFile file;
  const std::string fit_file = fits + "/" + job.name + ".json";
  if (!ReadRecording(job.recording, job.window, &result->recording, error) ||
      !WriteObservations(result->recording, out + "/" + job.name + ".csv", error) ||
      !LoadFit(fit_file, &file, error)) {
    return false;
  }
  const std::unique_ptr<RecordingsProblem> made = MakeProblem(file, error);
  if (made == nullptr) {
    return false;
  }
  result->parameters = made->entries();
  result->fit = Fit(file.input.options(), made.get(), {});
  if (result->fit.status != FitStatus::kConverged) {
    *error = fit_file + ": " + NameOf(result->fit.status) + ": " + result->fit.message;
    return false;
  }
  result->check = CheckDiscretisation(file.input, {}, result->fit);
  if (result->check.status != FitStatus::kConverged) {
    *error = fit_file + ": the fit at dt / 2: " + result->check.message;
    return false;
  }
  result->residual_rms = ResidualRms(made->run(0)->observations(), result->fit.residuals);
  return DeriveAll(job, file.run(), result, error) &&
         (job.prediction_to == 0.0 || Predict(job, file.run(), result, error));
}

OrderedJson PendulumToJson(const PendulumResult& result) {
  OrderedJson json = {{"name", result.name}, {"frames", result.recording.times.size()}};
  const double scale = result.recording.metres_per_pixel;
  json["noise"] = result.recording.noise;
  json["residual_rms"] = result.residual_rms;
  if (scale > 0.0) {
    json["metres_per_pixel"] = scale;
    json["noise_pixels"] = result.recording.noise / scale;
    json["residual_rms_pixels"] = result.residual_rms / scale;
  }
  json["dt"] = result.check.dt;
  json["parameters"] = OrderedJson::object();
  for (Eigen::Index k = 0; k < result.fit.estimate.size(); ++k) {
    const auto& interval = result.fit.uncertainty.confidence_95[k];
    json["parameters"][result.parameters[k].name] =
        interval ? Interval(result.fit.estimate[k], result.fit.uncertainty.standard_deviation[k],
                            interval->first, interval->second, result.check.bias[k])
                 : OrderedJson({{"estimate", result.fit.estimate[k]},
                                {"message", result.fit.uncertainty.messages[k]}});
  }
  json["derived"] = OrderedJson::object();
  for (size_t i = 0; i < result.derived.size(); ++i) {
    const DerivedQuantity& derived = result.derived[i];
    json["derived"][derived.name] = Interval(derived.estimate, derived.standard_deviation,
                                             derived.low, derived.high, result.derived_bias[i]);
  }
  for (const PredictionError& prediction : result.predictions) {
    json["prediction_errors"].push_back(
        {{"within_seconds", prediction.seconds}, {"largest_error", prediction.error}});
  }
  json["iterations"] = result.fit.iterations.size() - 1;
  return json;
}

}  // namespace tangible
