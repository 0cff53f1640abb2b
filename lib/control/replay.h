// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A plan is a claim about a motion. It is replayed by event stepping, whatever steps it was made
// with: fixed steps are a map of their own, whose plans may fail in the motion, and errors of
// integration grow where a motion is sensitive. Each step of the plan is four of the
// replay.

#include <limits>
#include <string>
#include <vector>

#include "tangible/control/cost.h"
#include "tangible/scene/scene.h"

namespace tangible {

struct Replay {
  bool done = false;
  std::string message;  ///< empty, or one line: why the replay failed
  double cost = std::numeric_limits<double>::quiet_NaN();
  RowMatrixXd
      states;  ///< (steps + 1) x num_states, as EngineStep orders them; NaN beyond a failure
};

/// What a replay runs.
struct ReplayRun {
  Scene scene;           ///< stepped by events, for the duration of the controls
  int parts = 0;         ///< its steps in each step of the plan
  RowMatrixXd controls;  ///< of each of its steps
};
/// The replay of a plan's controls (steps x m).
ReplayRun MakeReplay(const Scene& scene, const RowMatrixXd& controls);

/// Plays controls (steps x m, of these paths, each held over a step of the scene's dt) from the
/// scene's initial state by event stepping. A scene that is stepped by events keeps its settings.
Replay ReplayByEvents(const Scene& scene, const std::vector<std::string>& paths, const Cost& cost,
                      const RowMatrixXd& controls);

/// Whether a plan does not hold in the motion: its replay failed, or cost more than planned by more
/// than kMotionShare of the plan's cost and kNothingShare of the cost of doing nothing, which is
/// left out where it is not finite. A replay that meets its targets holds: one that costs at most
/// kMovesToTarget of `units`, the cost with every residual as large as its target
/// (Cost::ValueOfUnits).
bool DiffersFromMotion(double planned, const Replay& replay, double cost_of_nothing, double units);

}  // namespace tangible
