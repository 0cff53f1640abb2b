// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Control problems as files (README.md of lib/control has the keys).

#include <string>
#include <vector>

#include "tangible/control/engine_step.h"
#include "tangible/control/ilqr.h"
#include "tangible/control/plan_search.h"
#include "tangible/control/state_filter.h"

namespace tangible {

struct ControlFile {
  Scene scene;  ///< its duration is the horizon's
  std::string scene_path;
  std::vector<std::string> paths;  ///< of the controls
  VectorX<double> low, high;
  VectorX<double> initial;    ///< of each control, in all steps
  RowMatrixXd initial_table;  ///< of each step, in place of `initial`; empty: none
  StartOptions starts;
  SamplingOptions sampling;
  std::vector<CostTerm> terms;
  std::vector<std::string> term_names;  ///< of each: its place in the file, and what it is of
  IlqrOptions options;
  /// Receding horizon: the duration of the plant's run, s, and of each plan, s.
  double run_duration = 0.0;
  double plan_horizon = 0.0;
  int plan_iterations = 5;
  /// What the plans are made from; without sensors the plant's state itself.
  FilterOptions filter;
  int observe_every = 1;  ///< steps from one observation to the next
  unsigned noise_seed = 0;

  /// The initial controls of so many steps; a table that ends before holds its last row.
  RowMatrixXd InitialControls(long steps) const;
};

/// What is wrong with the paths of controls in a scene, one line, and which path it is (-1: none,
/// it is the scene); empty where each is a force, torque or effort of its own.
std::string CheckControls(const Scene& scene, const std::vector<std::string>& paths, int* which);

/// Reads a problem and its scene, and resolves names. On failure sets a message of one line.
bool LoadControlFile(const std::string& file, ControlFile* problem, std::string* error);

/// The same from text; the scene's path is relative to the folder of `file`.
bool ParseControlFile(const std::string& text, const std::string& file, ControlFile* problem,
                      std::string* error);

}  // namespace tangible
