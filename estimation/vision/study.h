// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The study's trainings, each a cell of its tables: what is trained on which data, and what is
// measured afterwards, as JSON.

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tangible/estimation/vision/disc_data.h"
#include "tangible/estimation/vision/simb_score.h"
#include "tangible/estimation/vision/training_options.h"

namespace tangible {

struct StudyCell {
  std::string name;  ///< of its files: "billiards_engine_10_0"
  DiscKind kind = DiscKind::kBilliards;
  TrainingOptions training;
};

/// SimB at 100, 25, 10 and 2 % of the labels; billiards with the engine, the perceptron and the
/// interaction network at each, and with the engine the ablations; parameters without labels. One
/// seed a cell, three at 10 % and of the parameters.
std::vector<StudyCell> StudyCells();

/// Sequences that are trained on, and others that are tested on.
struct StudyData {
  DiscData train, test;
  SimbScore floor;  ///< of SimB: the engine from the true states of `test`
};
StudyData MakeStudyData(DiscKind kind, std::uint64_t seed);

/// What a training needs of its surroundings.
struct CellHooks {
  std::string checkpoint{};  ///< bytes to go on from; empty: from the start
  std::function<void(long iteration, const std::string& bytes)> save{};
  long save_every = 200;
  std::function<void(long iteration)> progress{};
};

struct CellResult {
  nlohmann::ordered_json json;
  /// Of billiards: pictures of one test sequence, true and predicted.
  std::vector<std::string> truth, predicted;
};

/// Trains and measures; empty `error`, or one line about the checkpoint.
CellResult RunCell(const StudyCell& cell, const StudyData& data, const CellHooks& hooks,
                   std::string* error);

/// CPU seconds of the physics layer, forward and backward, for batch 32 over 10 frames, and of a
/// training iteration of that batch, on one thread: medians of several.
nlohmann::ordered_json TimePhysics();

/// The small training of continuous integration: a line a check, and whether all hold.
bool QuickCheck(std::string* lines);

}  // namespace tangible
