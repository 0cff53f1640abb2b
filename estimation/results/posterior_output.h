// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What is written of draws from the posterior of a fit: part of the result, of the report and of
// what the terminal shows; a table of draws; a scene for each of them; bands of predictions.

#include <functional>
#include <string>
#include <vector>

#include "tangible/estimation/fit/posterior.h"
#include "tangible/estimation/results/prediction.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

OrderedJson PosteriorToJson(const std::vector<ParameterEntry>& entries, const Posterior& posterior);

/// A row a draw: draw, chain, cost, and each parameter by its name.
std::string PosteriorCsv(const std::vector<ParameterEntry>& entries, const Posterior& posterior);

/// Of the report, in HTML.
std::string PosteriorPart(const std::vector<ParameterEntry>& entries, const Posterior& posterior);

/// Of the terminal: a line for all, and one for each of the first parameters.
std::string DescribePosterior(const std::vector<ParameterEntry>& entries,
                              const Posterior& posterior);

/// What keeps scenes from being written to a folder, or empty: its parent is missing, or a file has
/// its name.
std::string CheckSceneFolder(const std::string& folder);

/// Writes a file; returns what is wrong or empty.
using FileWriter = std::function<std::string(const std::string& path, const std::string& text)>;

/// Writes a scene for each draw to the folder, which is made if it is missing: scene_001.json, ...;
/// of several recordings scene_001_0.json, scene_001_1.json, ... Returns what is wrong or empty.
std::string WritePosteriorScenes(const std::string& folder, const FitInput& input,
                                 const RecordingsProblem& problem, const Posterior& posterior,
                                 const FileWriter& write);

/// Quantiles of predictions over at most kMostBands draws, a row an observation in the order of
/// the result's residuals, then, unless `later` is null, of those after the fit: recording (of
/// several), time, series ("ball x"), used (fit or prediction), sigma, observed, and the quantiles
/// low (2.5 %), median and high (97.5 %) of what the scene predicts, in the observation's unit,
/// without the noise of an observation. Draws whose run fails are left out.
std::string PosteriorBandsCsv(const FitInput& input, const Posterior& posterior,
                              const PredictedRecordings* later, RecordingsProblem* problem);
inline constexpr int kMostBands = 200;

}  // namespace tangible
