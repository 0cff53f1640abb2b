// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Errors and times of a scene with every setting of a sweep, compared with a reference; the cells
// on the fronts; and the cheapest settings for a target.
//
// Reference: event stepping with runge_kutta_4, all joints projected to 1e-12, at a step that is
// four times the scene's at first and is halved until a further halving changes it by less than a
// bound, or by more than it did before (rounding, chaos), or until its time is up; where event
// stepping does not run, fixed stepping in the same way. Its own error is the change by the last
// halving, at least 1e-13 (rounding). Its Jacobian is the tangent's, those of the cells are the
// adjoint's.

#include <functional>
#include <string>
#include <vector>

#include "tangible/verification/tradeoff/sampled_run.h"
#include "tangible/verification/tradeoff/sweep.h"

namespace tangible::tradeoff {

struct TradeoffOptions {
  std::vector<double> dt_factors = {8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125};  ///< of the scene's dt
  SweepKind sweep = SweepKind::kStar;
  int samples = 20;
  double repeat_seconds = 0.1;  ///< CPU time of a cell's repeats, about
  double budget_seconds = 2.0;  ///< CPU time of one rollout with its Jacobian
  double reference_error = 1e-10;
  double reference_seconds = 20.0;
  int threads = 1;  ///< of the cells; simultaneous runs disturb times
};

struct Reference {
  SampledRun run;
  SimulationSettings settings;
  double trajectory_error = 0.0, gradient_error = 0.0;  ///< its own
  std::string note;  ///< empty, or one line: why it is not event stepping, or not within the bound
};

struct Cell {
  SimulationSettings settings;
  /// Empty: measured. Otherwise "over 2 s", or the failure.
  std::string instead;
  bool failed = false;  ///< `instead` is a failure
  double trajectory_error = 0.0, gradient_error = 0.0;
  double run_seconds = 0.0, both_seconds = 0.0;  ///< medians: a rollout; one with its Jacobian
  int repeats = 0;
  long steps = 0;
  bool trajectory_front =
      false;                    ///< every cheaper cell (a rollout) has a ninth more error at least
  bool gradient_front = false;  ///< alike, of gradients

  bool measured() const { return instead.empty(); }
};

struct Tradeoff {
  std::string message;  ///< empty, or one line: why there is none
  std::string scene;    ///< its name
  SimulationSettings own;
  std::vector<std::string> parameters;
  ErrorScale scale;
  Reference reference;
  std::vector<Cell> cells;  ///< in the order of the sweep, steps descending
  std::vector<std::string> left_out;

  /// Whether the error is below the reference's own, so that its value has no further meaning.
  bool TrajectoryBelowReference(const Cell& cell) const {
    return cell.trajectory_error <= reference.trajectory_error;
  }
  bool GradientBelowReference(const Cell& cell) const {
    return cell.gradient_error <= reference.gradient_error;
  }
};

/// Runs the whole sweep. `progress`: cells done of `total`.
Tradeoff RunTradeoff(const Scene& scene, const std::vector<ParameterPath>& parameters,
                     const TradeoffOptions& options,
                     const std::function<void(long done, long total)>& progress);

/// Sets the cells' front flags. An error counts as at least the reference's own. Among cells whose
/// times and errors agree to a tenth the first in the sweep, with the scene's own solver, is
/// chosen.
void MarkFronts(Tradeoff* tradeoff);

enum class Target { kTrajectory, kGradient, kBoth };

/// The cheapest cell (to a tenth; of several the first in the sweep) whose errors, those of the
/// target, plus the reference's own are at most `error`; by the time of a rollout for the
/// trajectory alone, else with its Jacobian. Where nothing depends on the parameters the
/// trajectory's error is the only one. nullptr: there is none.
const Cell* Cheapest(const Tradeoff& tradeoff, Target target, double error);

}  // namespace tangible::tradeoff
