// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Fit files, and the result of a fit as JSON (README.md of this folder describes every key).
//
// Every mistake in a file is one line "file: /json/pointer: what, expected, got", the first one
// found.

#include <limits>
#include <string>
#include <vector>

#include "tangible/estimation/fit/discretisation.h"
#include "tangible/estimation/fit/fit.h"
#include "tangible/estimation/fit/sensor_noise.h"
#include "tangible/estimation/results/prediction.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

/// A fit file, read and checked.
struct FitFile {
  std::string path;
  FitProblem problem;
};

/// Reads a fit file, its scene and its observations; their paths are relative to the fit file's
/// folder.
bool LoadFit(const std::string& file, FitFile* fit, std::string* error);

/// The same from text.
bool ParseFit(const std::string& text, const std::string& file, FitFile* fit, std::string* error);

/// The part of a recording that is used: observations from `start`, the run's time 0, to `end`; s.
struct RecordingPart {
  double start = 0.0;
  double end = std::numeric_limits<double>::infinity();
};

/// The same from JSON, with that part of the observations. `name` begins its messages; files are
/// looked for in `folder`.
bool FitFromJson(const nlohmann::json& json, const std::string& name, const std::string& folder,
                 const RecordingPart& part, FitFile* fit, std::string* error);

/// The residuals of a problem. On failure sets one line with the JSON pointer of what is wrong with
/// a parameter.
bool MakeResiduals(const FitProblem& problem, const std::string& file,
                   std::vector<RolloutResiduals>* residuals, std::string* error);

/// The result as the program writes it; `check` and `prediction` may be null.
OrderedJson ResultToJson(const RolloutResiduals& residuals, const FitResult& result,
                         const DiscretisationCheck* check,
                         const PredictionScore* prediction = nullptr);

/// The estimated noise of sensors.
OrderedJson NoiseToJson(const std::vector<SensorNoise>& noise);

}  // namespace tangible
