// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What tangible-control does, and the Python package with it: plans of a control problem, judged by
// their replay by events, and runs of a plant under plans over a receding horizon.

#include <functional>
#include <string>
#include <vector>

#include "tangible/app/control_problem.h"
#include "tangible/control/replay.h"
#include "tangible/scene/json_writer.h"

namespace tangible {

struct ControlRunOptions {
  int threads = 0;      ///< of starts and sampling; 0: one a core
  double budget = 0.0;  ///< of each plan over a receding horizon, s; 0: a number of iterations
  /// Of a plan, as IlqrOptions has it.
  IlqrProgress progress{};
  /// Of a run over a receding horizon: after each of its steps, with the cost so far.
  std::function<void(long step, long steps, double cost)> step_done{};
};

/// A plan's status and message: the optimiser's own, or why the plan does not hold.
struct PlanVerdict {
  std::string status, message;
  bool holds = true;
};

struct ControlRun {
  OrderedJson result;  ///< as tangible-control writes it
  Scene scene;         ///< that was played, for as long: the problem's, or the plant
  /// Planned, or played by the plant: (steps + 1) x n as EngineStep orders them, and steps x m.
  RowMatrixXd states, controls;
  double cost = 0.0;
  std::vector<std::string> warnings;  ///< a line each, without the name of the problem
  // Of a plan alone:
  PlanVerdict verdict;
  Replay replay;
  /// Planned numbers beside those of the replay: the cost, then the final state. Empty: no plan.
  std::vector<std::vector<std::string>> beside_motion;
  std::vector<IlqrIteration> iterations;
};

/// Plans and replays a problem, which messages name `name`. Empty, or why there is no plan, one
/// line. A plan that does not hold in the motion is a plan, with its verdict.
std::string MakePlan(const std::string& name, const ControlFile& file,
                     const ControlRunOptions& options, ControlRun* run);

/// Empty, or why a scene cannot be the problem's plant, one line that begins with `name`.
std::string CheckPlant(const ControlFile& file, const Scene& plant, const std::string& name);

/// Controls a plant, which CheckPlant has found right, with a plan in each step. Empty, or why
/// there is no result, one line.
std::string RunPredictive(const std::string& name, const ControlFile& file, const Scene& plant,
                          const std::string& plant_name, const ControlRunOptions& options,
                          ControlRun* run);

}  // namespace tangible
