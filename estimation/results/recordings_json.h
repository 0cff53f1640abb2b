// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Fit files with several recordings (README.md of estimation has the keys), and their results.

#include <string>
#include <vector>

#include "tangible/estimation/problem/recordings.h"
#include "tangible/estimation/results/fit_json.h"
#include "tangible/estimation/results/prediction.h"

namespace tangible {

struct RecordingEntry {
  std::string name;
  double weight = 1.0;
  FitFile fit;  ///< the fit of this recording alone; options are those of the file
};

struct RecordingsFile {
  std::string path;
  std::vector<RecordingEntry> recordings;
  std::vector<bool> own;  ///< whether each parameter has "per": "recording"
};

/// Whether the text of a fit file has the key `recordings`; false if it is not JSON.
bool HasRecordings(const std::string& text);

/// Reads a fit file's text, and its scenes and observations, whose names are relative to `file`. On
/// failure sets one line that names the recording.
bool ParseRecordings(const std::string& text, const std::string& file, RecordingsFile* recordings,
                     std::string* error);

/// The problem of all recordings; on failure sets the same kind of message.
bool MakeRecordingsProblem(const RecordingsFile& file, std::vector<RecordedRun>* recordings,
                           std::string* error);

/// The predictions of the fitted scenes for observations that were held back, for each recording.
struct LaterOfRecordings {
  std::vector<LaterObservations> runs;
  PredictionScore score;  ///< of all recordings together
};
LaterOfRecordings PredictLater(const RecordingsFile& file, const RecordingsProblem& problem,
                               const Eigen::VectorXd& estimate, double from,
                               std::vector<std::vector<Observation>> later);

/// The result as the program writes it; `later` may be null.
OrderedJson RecordingsResultToJson(const RecordingsProblem& problem, const FitResult& result,
                                   const LaterOfRecordings* later = nullptr);

/// Root mean square of the residuals of a recording, in multiples of sigma.
double RmsOfRecording(const RecordingsProblem& problem, const FitResult& result, int recording);

}  // namespace tangible
