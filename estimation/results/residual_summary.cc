// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/results/residual_summary.h"

#include <algorithm>
#include <cmath>

#include "tangible/estimation/results/tolerances.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/math/median.h"

namespace tangible {
namespace {

/// The residuals of each series.
std::vector<std::vector<double>> BySeries(const ObservationSeries& index,
                                          const Eigen::VectorXd& values) {
  std::vector<std::vector<double>> all(index.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    all[index.of[i]].push_back(std::abs(values[i]));
  }
  return all;
}

/// The size above which a residual of a series is an outlier.
double OutlierBound(const std::vector<double>& sizes) {
  return kOutlierDeviations * std::max(1.0, kDeviationByMedian * UpperMedian(sizes));
}

}  // namespace

std::string FileOf(const RolloutResiduals& residuals, const Observation& observation) {
  const std::vector<std::string>& files = residuals.files();
  const int file = residuals.ChannelOf(observation).file;
  return file < static_cast<int>(files.size()) ? files[file] : "";
}

std::string SensorOf(const RolloutResiduals& residuals, const Observation& observation) {
  const int sensor = residuals.ChannelOf(observation).sensor;
  return sensor < 0 ? "" : residuals.scene().instruments().sensors[sensor].name;
}

std::string UnitOf(const RolloutResiduals& residuals, const Observation& observation) {
  const bool is_length = observation.coordinate != Coordinate::kAngle &&
                         observation.coordinate != Coordinate::kOmega &&
                         !IsForce(observation.coordinate) && observation.event < 0;
  const bool is_rate =
      observation.coordinate == Coordinate::kVx || observation.coordinate == Coordinate::kVy;
  if (residuals.ChannelOf(observation).camera >= 0 && is_length) {
    return is_rate ? "camera units/s" : "camera units";
  }
  return UnitOf(observation.coordinate);
}

std::string SeriesLabel(const RolloutResiduals& residuals, const Observation& observation) {
  const Scene& scene = residuals.scene().scene();
  const std::vector<BodyPoint>& points = residuals.scene().points();
  const std::string reference = ReferenceName(scene, points, residuals.ChannelOf(observation));
  const std::string sensor = SensorOf(residuals, observation);
  const std::string label =
      TargetName({scene, points, residuals.scene().instruments()}, observation) + " " +
      NameOf(observation.coordinate) + (reference.empty() ? "" : " relative to " + reference) +
      (sensor.empty() ? "" : " by " + sensor);
  return residuals.files().size() > 1 ? label + " (" + FileOf(residuals, observation) + ")" : label;
}

namespace {

SeriesSummary Describe(const RolloutResiduals& residuals, const std::string& recording,
                       const Observation& observation) {
  SeriesSummary series;
  const Scene& scene = residuals.scene().scene();
  series.recording = recording;
  series.file = FileOf(residuals, observation);
  series.target =
      TargetName({scene, residuals.scene().points(), residuals.scene().instruments()}, observation);
  series.kind = observation.event >= 0            ? "event"
                : observation.joint >= 0          ? "joint"
                : IsForce(observation.coordinate) ? "contact"
                : observation.point >= 0          ? "point"
                                                  : "body";
  series.relative_to =
      ReferenceName(scene, residuals.scene().points(), residuals.ChannelOf(observation));
  series.sensor = SensorOf(residuals, observation);
  series.unit = UnitOf(residuals, observation);
  series.coordinate = observation.coordinate;
  series.label = (recording.empty() ? "" : recording + ": ") + SeriesLabel(residuals, observation);
  return series;
}

/// Appends the series and outliers of a recording.
void Append(const RecordedRun& recording, const Eigen::VectorXd& values, ResidualSummary* summary) {
  const std::vector<Observation>& observations = recording.residuals.observations();
  const ObservationSeries index = IndexSeries(observations);
  const size_t before = summary->series.size();
  std::vector<double> bounds;
  for (std::vector<double>& sizes : BySeries(index, values)) {
    bounds.push_back(OutlierBound(sizes));
  }
  for (const int first : index.first) {
    summary->series.push_back(Describe(recording.residuals, recording.name, observations[first]));
  }
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const Observation& observation = observations[i];
    const size_t at = before + static_cast<size_t>(index.of[i]);
    SeriesSummary& series = summary->series[at];
    const double r = values[i];
    const double difference = r * observation.sigma;
    ++series.count;
    series.rms += difference * difference;
    series.mean += difference;
    series.rms_in_sigma += r * r;
    if (std::abs(r) > series.largest_in_sigma) {
      series.largest_in_sigma = std::abs(r);
      series.largest_time = observation.time;
    }
    if (std::abs(r) > bounds[index.of[i]]) {
      ++series.outliers;
      summary->outliers.push_back({static_cast<int>(at), observation.time, r});
    }
  }
}

}  // namespace

ResidualSummary SummarizeResiduals(const RecordingsProblem& problem,
                                   const Eigen::VectorXd& values) {
  ResidualSummary summary;
  if (values.size() == 0) {
    return summary;
  }
  Eigen::Index first = 0;
  for (const RecordedRun& recording : problem.recordings()) {
    const Eigen::Index rows = recording.residuals.num_residuals();
    Append(recording, values.segment(first, rows), &summary);
    first += rows;
  }
  for (SeriesSummary& series : summary.series) {
    const double count = static_cast<double>(series.count);
    series.rms = std::sqrt(series.rms / count);
    series.mean /= count;
    series.rms_in_sigma = std::sqrt(series.rms_in_sigma / count);
  }
  summary.num_outliers = static_cast<long>(summary.outliers.size());
  std::stable_sort(summary.outliers.begin(), summary.outliers.end(),
                   [](const Outlier& a, const Outlier& b) {
                     return std::abs(a.residual) > std::abs(b.residual);
                   });
  summary.outliers.resize(std::min(summary.outliers.size(), kMostOutliers));
  return summary;
}

double RmsOfRecording(const RecordingsProblem& problem, const Eigen::VectorXd& values,
                      int recording) {
  Eigen::Index first = 0;
  for (int block = 0; block < recording; ++block) first += problem.num_observation_rows(block);
  const Eigen::Index rows = problem.num_observation_rows(recording);
  if (values.size() < first + rows) return std::nan("");
  return std::sqrt(values.segment(first, rows).squaredNorm() / static_cast<double>(rows));
}

}  // namespace tangible
