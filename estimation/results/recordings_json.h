// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Fit files with several recordings (README.md of estimation has the keys), and their results.

#include <string>
#include <vector>

#include "tangible/estimation/problem/recordings.h"
#include "tangible/estimation/results/fit_json.h"

namespace tangible {

struct RecordingEntry {
  std::string name;
  double weight = 1.0;
  FitFile fit;  ///< what the recording would be alone; options are those of the file
};

struct RecordingsFile {
  std::string path;
  std::vector<RecordingEntry> recordings;
  std::vector<bool> own;  ///< of each parameter: "per": "recording"
};

/// Whether a fit file has the key `recordings`; a file that cannot be read has not.
bool HasRecordings(const std::string& file);

/// Reads the file, its scenes and observations. On failure sets one line that names the recording.
bool LoadRecordings(const std::string& file, RecordingsFile* recordings, std::string* error);

/// The problem of all recordings; the same on failure.
bool MakeRecordingsProblem(const RecordingsFile& file, std::vector<RecordedRun>* recordings,
                           std::string* error);

/// The result as the program writes it.
OrderedJson RecordingsResultToJson(const RecordingsProblem& problem, const FitResult& result);

/// Root mean square of the residuals of a recording, in multiples of sigma.
double RmsOfRecording(const RecordingsProblem& problem, const FitResult& result, int recording);

}  // namespace tangible
