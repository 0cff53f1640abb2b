// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The fits of the recordings of real pendulums (recording.h) by data/fits/recording_*.json: their
// residuals beside the noise, the parameters and derived quantities, and, for the single pendulum,
// the error of its prediction for the time after the fitted part.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/experiments/derived.h"
#include "tangible/estimation/experiments/recording.h"
#include "tangible/estimation/fit/discretisation.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

struct PendulumJob {
  std::string name;            ///< "recording_double_pendulum_0": of the fit file, without .json
  std::string recording;       ///< file
  RecordingOptions window;     ///< what is fitted
  double prediction_to = 0.0;  ///< s: end of what is predicted; 0: nothing is
};

/// The jobs for the single pendulum and for two recordings of the double pendulum, in a folder with
/// `multiarm_pendulum/` and `ibm_double_pendulum/`.
std::vector<PendulumJob> PendulumJobs(const std::string& recordings);

struct PredictionError {
  double seconds = 0.0;  ///< after the part that was fitted
  double error = 0.0;    ///< rad: largest within them
};

struct PendulumResult {
  std::string name;
  Recording recording;
  std::vector<ParameterizedScene::Entry> parameters;
  FitResult fit;
  DiscretisationCheck check;
  double residual_rms = 0.0;  ///< m or rad
  std::vector<DerivedQuantity> derived;
  std::vector<double> derived_bias;  ///< of the step, as DiscretisationCheck has it
  std::vector<PredictionError> predictions;
};

/// Reads the recording, writes its observations to `out` (where the fit file expects them), and
/// fits them. Returns false, with one line, where something fails.
bool RunPendulum(const PendulumJob& job, const std::string& fits, const std::string& out,
                 PendulumResult* result, std::string* error);

OrderedJson PendulumToJson(const PendulumResult& result);

}  // namespace tangible
