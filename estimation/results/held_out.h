// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Recordings that are kept back: they identify nothing. With the parameters found from the others
// the start of each is fitted to its observations up to a time T, and those after T are predicted,
// which shows what the parameters are worth in a run that they have not seen. Where the model does
// not explain the observations up to T, the last of them may give a better start (state_window.h).

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/fit/sensor_noise.h"
#include "tangible/estimation/results/prediction.h"
#include "tangible/estimation/results/state_window.h"

namespace tangible {

/// A recording with the role `predict`.
struct HeldOutRecording {
  RecordingInput recording;        ///< with the observations up to T
  std::vector<Observation> later;  ///< those after T
  double state_from = 0.0;         ///< T, s
  bool from_observations = false;  ///< whether the fit of its start begins at what is observed
  int place = 0;                   ///< in the list of all recordings
};

/// Which parameters of a recording are fitted to its first part: those that it has for itself and
/// that set nothing but poses and twists at its start.
std::vector<bool> OwnStates(const FitProblem& problem, const std::vector<ParameterScope>& scopes);

/// What was found of one.
struct HeldOutRun {
  std::string name;
  double state_from = 0.0;
  int place = 0;
  FitStatus status = FitStatus::kConverged;  ///< of the start's fit
  std::string message;                       ///< what is wrong, or empty
  std::vector<ParameterEntry> entries;       ///< of its parameters
  std::vector<int> fitted;                   ///< indices of those of the start
  Eigen::VectorXd parameters;                ///< all; empty where the fit of the start failed
  Eigen::VectorXd deviations;                ///< standard deviations of those of the start
  double begins = 0.0;              ///< s: the run begins here, with the state that was fitted
  std::vector<Observation> unused;  ///< those before
  std::vector<Observation> used;    ///< those of the first part, from `begins` on
  std::optional<RolloutResiduals> first_part;  ///< times from `begins` on
  Eigen::VectorXd residuals;  ///< of the first part, in multiples of sigma; empty where it failed
  double residual_rms = NAN;
  LaterObservations later;
};

struct HeldOutRuns {
  std::vector<HeldOutRun> runs;
  StateWindow window;
  PredictionScore score;  ///< of all, each from its own T on
};

/// Fits the starts and predicts. Shared parameters are those of `estimate`, what varies has the
/// value around which it is spread, and other parameters that a recording has for itself keep their
/// initial values. `noise`: the sigma that were found of sensors.
HeldOutRuns PredictHeldOut(const FitInput& input, const RecordingsProblem& problem,
                           const Eigen::VectorXd& estimate, const std::vector<SensorNoise>& noise,
                           std::vector<HeldOutRecording> recordings);

/// One of them, by a state that is fitted with these options to the last `seconds` before T (0: to
/// all).
HeldOutRun PredictOne(const FitInput& input, const FitOptions& options,
                      const RecordingsProblem& problem, const Eigen::VectorXd& estimate,
                      HeldOutRecording of, double seconds);

/// A line a recording, one of all, and one of the window where one was looked for.
std::string Describe(const HeldOutRuns& held_out);

/// What is wrong with the first that failed, after its name; or empty.
std::string FirstFailure(const HeldOutRuns& held_out);

}  // namespace tangible
