// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/replay.h"

#include <cmath>

#include "tangible/control/tolerances.h"
#include "tangible/simulation/gradient/compare_motion.h"
#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {
namespace {

// Steps of a replay in each step of a plan: the errors of the default integrator, of fourth order,
// are 256 times smaller than the plan's.
constexpr int kReplayParts = 4;

}  // namespace

ReplayRun MakeReplay(const Scene& scene, const RowMatrixXd& controls) {
  ReplayRun run;
  run.scene = scene.simulation.stepping == Stepping::kEvent ? scene : ByEvents(scene);
  SimulationSettings& settings = run.scene.simulation;
  settings.duration = static_cast<double>(controls.rows()) * settings.dt;
  settings.dt /= kReplayParts;
  run.parts = kReplayParts;
  run.controls.resize(controls.rows() * kReplayParts, controls.cols());
  for (Eigen::Index k = 0; k < run.controls.rows(); ++k) {
    run.controls.row(k) = controls.row(k / kReplayParts);
  }
  return run;
}

Replay ReplayByEvents(const Scene& scene, const std::vector<std::string>& paths, const Cost& cost,
                      const RowMatrixXd& controls) {
  Replay replay;
  const Eigen::Index steps = controls.rows();
  const ReplayRun replayed = MakeReplay(scene, controls);
  std::vector<long> records;
  for (Eigen::Index k = 0; k <= steps; ++k) records.push_back(k * replayed.parts);
  RolloutFunction function;
  replay.message = function.Create(replayed.scene, {}, paths, records);
  if (!replay.message.empty()) return replay;
  const RolloutOutput run =
      RolloutWorker(function).Run({VectorX<double>(), VectorX<double>(), replayed.controls});
  replay.message = run.message;
  replay.states = run.states;
  if (run.status != RolloutStatus::kDone) return replay;
  replay.cost = cost.EndValue(replay.states.row(steps));
  for (Eigen::Index k = 0; k < steps; ++k) {
    replay.cost += cost.Value(replay.states.row(k), controls.row(k));
  }
  replay.done = std::isfinite(replay.cost);
  if (!replay.done) replay.message = "the cost of the motion is not finite";
  return replay;
}

bool DiffersFromMotion(double planned, const Replay& replay, double cost_of_nothing, double units) {
  if (!replay.done) return true;
  if (std::abs(replay.cost) <= kMovesToTarget * units) return false;
  const double excess = replay.cost - planned;
  const double least = std::isfinite(cost_of_nothing) ? kNothingShare * cost_of_nothing : 0.0;
  return excess > kMotionShare * std::abs(planned) && excess > least;
}

}  // namespace tangible
