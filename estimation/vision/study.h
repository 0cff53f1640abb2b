// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The trainings of the study. Each is a cell of its tables: a model, its data, and the measures
// after the training, as JSON.

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
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

/// The cells: SimB at 100, 25, 10 and 2 % of the labels; billiards with the engine, the perceptron
/// and the interaction network at each of these, and ablations with the engine; parameters without
/// labels. Each cell has one seed; at 10 % of the labels, and for the parameters, there are three.
std::vector<StudyCell> StudyCells();

/// The sequences for training, and others for testing.
struct StudyData {
  DiscData train, test;
  SimbScore floor;  ///< of SimB: the engine from the true states of `test`
};
StudyData MakeStudyData(DiscKind kind, std::uint64_t seed);

/// The interface of a training to the program.
struct CellHooks {
  std::optional<std::string> checkpoint{};  ///< bytes to go on from; none: from the start
  std::function<void(long iteration, const std::string& bytes)> save{};
  long save_every = 200;
  std::function<void(long iteration)> progress{};
};

struct CellResult {
  nlohmann::ordered_json json;
  /// For billiards, pictures of one test sequence, true and predicted.
  std::vector<std::string> truth, predicted;
};

/// Trains and measures. `error` is empty, or one line about the checkpoint.
CellResult RunCell(const StudyCell& cell, const StudyData& data, const CellHooks& hooks,
                   std::string* error);

/// The CPU time (s) of the physics layer, forward and backward, for batch 32 over 10 frames, and of
/// a training iteration of that batch, on one thread: medians of several repetitions.
nlohmann::ordered_json TimePhysics();

/// A small training for continuous integration: writes a line for each check, and returns whether
/// all hold.
bool QuickCheck(std::string* lines);

}  // namespace tangible
