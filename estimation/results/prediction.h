// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The predictions of the fitted scene: a table of all observations beside their predictions, and
// the error of predictions after the time up to which the scene was fitted.
//
// The error of the observations from T on is stated by horizon, t − T, in bins of equal width.
// Every observation at a horizon in (0, t_last − T] is in one bin, and none is left out.

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/problem/recordings.h"

namespace tangible {

/// Errors of one unit within a range of horizons.
struct HorizonError {
  double from = 0.0;  ///< s after T, excluded
  double to = 0.0;    ///< s after T, included
  long count = 0;
  double rms_in_sigma = NAN;
  double rms_length = NAN;  ///< m, of observed positions; NaN: none in this range
  double max_length = NAN;
  double rms_angle = NAN;  ///< rad
  double max_angle = NAN;
};

/// How well a scene that was fitted up to a time predicts later observations.
struct PredictionScore {
  double from = 0.0;    ///< T, s; NaN: each run has its own
  std::string message;  ///< why the run after T failed, or empty
  HorizonError all;     ///< over all horizons
  std::vector<HorizonError> horizons;
};

/// Observations that come after the fit's, and how well the fitted scene predicts them.
struct LaterObservations {
  std::vector<Observation> observations;
  Eigen::VectorXd residuals;  ///< in multiples of sigma; empty where the run to them failed
  PredictionScore score;
};

/// Moves the observations after `from` out of `observations`; both lists keep their order.
std::vector<Observation> TakeLater(double from, std::vector<Observation>* observations);

/// Runs the problem's scene at `estimate` until the last of `later`, and scores it there. The
/// random forces that a run `before` has found, if it has any, act until its end.
LaterObservations PredictLater(const FitProblem& problem, const Eigen::VectorXd& estimate,
                               double from, std::vector<Observation> later,
                               const RolloutResiduals* before = nullptr);

/// The observations of a run after T, by channels (none: directly), and their residuals in
/// multiples of sigma.
struct PredictedRun {
  double from;  ///< T, s
  const std::vector<Observation>& observations;
  const std::vector<Channel>& channels;
  const Eigen::VectorXd& residuals;
};

/// The score of several runs together, the horizons of each from its own T on. `from` of the score
/// is NaN where the runs differ in it.
PredictionScore ScorePrediction(const std::vector<PredictedRun>& runs);

/// The later observations of each recording, and the score of all together.
struct PredictedRecordings {
  std::vector<LaterObservations> runs;
  PredictionScore score;
};
PredictedRecordings PredictLater(const FitInput& input, const RecordingsProblem& problem,
                                 const Eigen::VectorXd& estimate, double from,
                                 std::vector<std::vector<Observation>> later);

struct HeldOutRuns;  // held_out.h

/// A row an observation, by time: time, target (body or point), relative_to, coordinate, file,
/// sensor, used (fit, state or prediction), sigma, observed, predicted, residual (predicted −
/// observed, in the observation's unit) and residual_in_sigma; the last three are empty where there
/// is no run. Recordings follow each other, with their names, where they have any, in a first
/// column. `values` are the residuals of the fit, in multiples of sigma; `later` may be null, and
/// so may `held_out`, whose rows come last: `used` is `state` for those to which a start was
/// fitted, and `unused` for those before its window.
std::string PredictionCsv(const RecordingsProblem& problem, const Eigen::VectorXd& values,
                          const PredictedRecordings* later, const HeldOutRuns* held_out);

}  // namespace tangible
