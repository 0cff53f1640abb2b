// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Residuals by series (one coordinate of one body or point from one file): their size, and single
// outliers.
//
// An outlier is a residual that is large for its series: |r| > 5 s with s = 1.4826 median |r|,
// where s is at least 1, so that residuals within sigma are never outliers. With Gaussian noise one
// in 1.7 million is as large.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tangible/estimation/problem/recordings.h"

namespace tangible {

struct SeriesSummary {
  std::string recording;    ///< empty: the only one
  std::string file;         ///< empty where the observations are of no file
  std::string target;       ///< body, point, joint, contact or event
  std::string kind;         ///< "body", "point", "joint", "contact" or "event"
  std::string relative_to;  ///< empty: to the world
  std::string sensor;       ///< empty: none
  std::string unit;         ///< of rms and mean
  Coordinate coordinate = Coordinate::kX;
  long count = 0;
  double rms = 0.0;               ///< in `unit`
  double mean = 0.0;              ///< of fitted − observed, in `unit`
  double rms_in_sigma = 0.0;      ///< in multiples of sigma
  double largest_in_sigma = 0.0;  ///< absolute
  double largest_time = 0.0;      ///< s, when
  long outliers = 0;

  /// "ball x", with the file where there are several, after the recording's name.
  std::string label;
};

/// An outlier.
struct Outlier {
  int series = 0;
  double time = 0.0;      ///< s
  double residual = 0.0;  ///< in multiples of sigma, fitted − observed
};

/// At most this many outliers are listed.
inline constexpr size_t kMostOutliers = 50;

struct ResidualSummary {
  std::vector<SeriesSummary> series;  ///< in the order of appearance
  std::vector<Outlier> outliers;      ///< the largest, at most kMostOutliers; largest first
  long num_outliers = 0;              ///< the number of all outliers
};

/// `values`: a residual for each of the observations, in multiples of sigma.
ResidualSummary SummarizeResiduals(const RecordingsProblem& problem, const Eigen::VectorXd& values);

/// Root mean square of the residuals of a recording, in multiples of sigma; NaN without any.
double RmsOfRecording(const RecordingsProblem& problem, const Eigen::VectorXd& values,
                      int recording);

/// The file of an observation, as the fit file names it; empty where there is none.
std::string FileOf(const RolloutResiduals& residuals, const Observation& observation);

/// The sensor's name, empty where there is none.
std::string SensorOf(const RolloutResiduals& residuals, const Observation& observation);
/// The observation's unit; for lengths through a camera "camera units".
std::string UnitOf(const RolloutResiduals& residuals, const Observation& observation);

/// The name of a series: "ball x", "ball x (take.csv)" where there are several files.
std::string SeriesLabel(const RolloutResiduals& residuals, const Observation& observation);

}  // namespace tangible
