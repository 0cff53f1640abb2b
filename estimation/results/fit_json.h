// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Fit files, of one run or several recordings, and the results of fits (README.md of estimation has
// the keys). Errors of reading are one line "file: /json/pointer: what, expected, got", or "file:
// recording 'name': /json/pointer: ..."; the first one found.

#include <memory>
#include <string>
#include <vector>

#include "tangible/estimation/fit/discretisation.h"
#include "tangible/estimation/fit/variance_components.h"
#include "tangible/estimation/results/held_out.h"
#include "tangible/estimation/results/prediction.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

/// A fit file, read and checked.
struct FitFile {
  std::string path;
  FitInput input;                          ///< a file without `recordings` has one of no name
  std::vector<HeldOutRecording> held_out;  ///< those of the role `predict`, in their order

  /// The run of a file without `recordings`.
  FitProblem& run() { return input.recordings.front().problem; }
  const FitProblem& run() const { return input.recordings.front().problem; }
};

/// Reads a fit file, its scenes and its observations; their paths are relative to the fit file's
/// folder.
bool LoadFit(const std::string& file, FitFile* fit, std::string* error);

/// The same from text.
bool ParseFit(const std::string& text, const std::string& file, FitFile* fit, std::string* error);

/// The residuals of a file; null on failure, with one line that has the JSON pointer of what is
/// wrong with a parameter.
std::unique_ptr<RecordingsProblem> MakeProblem(const FitFile& fit, std::string* error);

struct Design;         // design.h
struct MissingResult;  // missing.h
struct MotionCheck;    // motion_check.h
struct Posterior;      // posterior.h

/// What was found beside the estimates; each may be null.
struct FitFindings {
  const VarianceComponents* components = nullptr;
  const DiscretisationCheck* check = nullptr;
  const PredictedRecordings* later = nullptr;
  const Posterior* posterior = nullptr;
  const HeldOutRuns* held_out = nullptr;
  const Design* design = nullptr;
  const MissingResult* missing = nullptr;
};

/// How far the derivatives at an estimate are from those of the motion.
OrderedJson MotionToJson(const std::vector<ParameterEntry>& entries, const MotionCheck& check);

/// The result as the program writes it.
OrderedJson ResultToJson(const RecordingsProblem& problem, const FitResult& result,
                         const FitFindings& findings = {});

}  // namespace tangible
