// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/tradeoff/tradeoff_run.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <utility>

#include "tangible/lcp/contact/worker_pool.h"
#include "tangible/math/median.h"

namespace tangible::tradeoff {
namespace {

constexpr double kReferenceJointTolerance = 1e-12;
constexpr double kMostReferenceSteps = 4e6;
constexpr double kFirstReferenceFactor = 4.0;  // of the scene's dt
constexpr int kMostFailedLevels = 6;
// Smaller differences are rounding and do not rank runs.
constexpr double kRounding = 1e-13;
// Cells that differ only by a solver have the same errors up to rounding, and the same times up to
// chance: one of them is enough, the one whose settings are nearer to the scene's.
constexpr double kBetter = 0.9;
constexpr double kSameTime = 1.1;

double CostOf(const SampledRun& run) {
  return UpperMedian(run.run_seconds) + UpperMedian(run.both_seconds);
}

// Halves the step as the header says. False, with the last run's message, where no two successive
// runs succeeded.
bool Halve(const Scene& scene, const std::vector<ParameterPath>& parameters,
           const TradeoffOptions& options, Reference* best) {
  Scene copy = scene;
  SimulationSettings& settings = copy.simulation;
  settings.dt = StepLengths(scene.simulation, options.samples, {kFirstReferenceFactor})[0];
  bool found = false;
  double seconds = 0.0;
  SampledRun last;
  last.message = "none";
  for (int level = 0; level < 2 || settings.duration / settings.dt <= kMostReferenceSteps;
       ++level) {
    SampledRun run = RunSampled(copy, parameters, GradientMethod::kTangent, {options.samples});
    if (!run.done()) {
      if (!found) best->note = run.message;
      if (found || level >= kMostFailedLevels) break;
    } else if (last.done()) {
      const ErrorScale scale = ScaleOf(scene, parameters, run);
      const double trajectory = TrajectoryError(scale, last, run);
      const double gradient = GradientError(scale, last, run);
      // Where nothing depends on the parameters the gradient's error is NaN, and never the larger.
      if (found && (trajectory > best->trajectory_error || gradient > best->gradient_error) &&
          std::max(trajectory, gradient) > options.reference_error) {
        break;
      }
      *best = {run, settings, trajectory, gradient, ""};
      found = true;
      if (trajectory <= options.reference_error && !(gradient > options.reference_error)) break;
    }
    if (run.done()) seconds += CostOf(run);
    // Half the step takes twice the time.
    if (found && seconds + 2.0 * CostOf(run) > options.reference_seconds) break;
    last = std::move(run);
    settings.dt *= 0.5;
  }
  return found;
}

// Computes the reference; returns a message or empty.
std::string MakeReference(const Scene& scene, const std::vector<ParameterPath>& parameters,
                          const TradeoffOptions& options, Reference* reference) {
  Scene copy = scene;
  SimulationSettings& settings = copy.simulation;
  settings.stepping = Stepping::kEvent;
  settings.integrator = Integrator::kRungeKutta4;
  settings.joint_correction = JointCorrection::kProjection;
  settings.joint_tolerance = std::min(settings.joint_tolerance, kReferenceJointTolerance);
  settings.lcp_tolerance = std::min(settings.lcp_tolerance, SimulationSettings().lcp_tolerance);
  std::string note;
  if (!Halve(copy, parameters, options, reference)) {
    note = "fixed stepping, as event stepping does not run: " + reference->note;
    settings.stepping = Stepping::kFixed;
    settings.integrator = Integrator::kSemiImplicitEuler;
    if (!Halve(copy, parameters, options, reference)) {
      return "no reference: " + reference->note;
    }
  }
  if (reference->trajectory_error > options.reference_error ||
      reference->gradient_error > options.reference_error) {
    note += note.empty() ? "" : "; ";
    note += "did not come within its bound";
  }
  reference->note = note;
  reference->trajectory_error = std::max(reference->trajectory_error, kRounding);
  // NaN, where nothing depends on the parameters, stays.
  if (reference->gradient_error < kRounding) reference->gradient_error = kRounding;
  return "";
}

// Runs the cells of one setting, beginning with the longest step.
void RunGroup(const Scene& scene, const std::vector<ParameterPath>& parameters,
              const TradeoffOptions& options, const Tradeoff& tradeoff, Cell* cells, size_t count,
              const std::function<void()>& done) {
  const SampleOptions sampling{options.samples, options.repeat_seconds};
  double predicted = 0.0;  // s, of the next cell
  Scene copy = scene;
  for (size_t i = 0; i < count; ++i) {
    Cell& cell = cells[i];
    if (i > 0) predicted *= cells[i - 1].settings.dt / cell.settings.dt;
    if (predicted > options.budget_seconds) {
      char text[48];
      std::snprintf(text, sizeof(text), "over %g s", options.budget_seconds);
      cell.instead = text;
    } else {
      copy.simulation = cell.settings;
      const SampledRun run = RunSampled(copy, parameters, GradientMethod::kAdjoint, sampling);
      cell.instead = run.message;
      cell.failed = !run.done();
      if (run.done()) {
        cell.trajectory_error = TrajectoryError(tradeoff.scale, run, tradeoff.reference.run);
        cell.gradient_error = GradientError(tradeoff.scale, run, tradeoff.reference.run);
        cell.run_seconds = UpperMedian(run.run_seconds);
        cell.both_seconds = UpperMedian(run.both_seconds);
        cell.repeats = static_cast<int>(run.both_seconds.size());
        cell.steps = run.steps;
        predicted = cell.both_seconds;
      }
    }
    done();
  }
}

void RunCells(const Scene& scene, const std::vector<ParameterPath>& parameters,
              const TradeoffOptions& options, size_t group,
              const std::function<void(long done, long total)>& progress, Tradeoff* tradeoff) {
  std::mutex mutex;
  long done = 0;
  const auto total = static_cast<long>(tradeoff->cells.size());
  const auto one_more = [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (progress) progress(done, total);
  };
  const size_t groups = group > 0 ? tradeoff->cells.size() / group : 0;
  WorkerPool pool(options.threads);
  pool.Run(groups, options.threads, [&](size_t i, int /*thread*/) {
    RunGroup(scene, parameters, options, *tradeoff, &tradeoff->cells[i * group], group, one_more);
  });
}

// Marks the cells that are better than all cheaper ones by more than the variation of times.
void MarkFront(std::vector<Cell>* cells, double own_error, double Cell::*error,
               double Cell::*seconds, bool Cell::*front) {
  std::vector<Cell*> order;
  for (Cell& cell : *cells) {
    cell.*front = false;
    if (cell.measured() && std::isfinite(cell.*error)) order.push_back(&cell);
  }
  const auto known = [&](const Cell* cell) { return std::max(cell->*error, own_error); };
  std::stable_sort(order.begin(), order.end(), [&](const Cell* a, const Cell* b) {
    return std::pair(a->*seconds, known(a)) < std::pair(b->*seconds, known(b));
  });
  double least = HUGE_VAL;
  for (Cell* cell : order) {
    if (!(known(cell) < kBetter * least)) continue;
    least = known(cell);
    const double most = kSameTime * cell->*seconds;
    const auto plainest = std::find_if(cells->begin(), cells->end(), [&](const Cell& other) {
      return other.measured() && known(&other) <= least / kBetter && other.*seconds <= most;
    });
    *plainest.*front = true;
  }
}

}  // namespace

void MarkFronts(Tradeoff* tradeoff) {
  MarkFront(&tradeoff->cells, tradeoff->reference.trajectory_error, &Cell::trajectory_error,
            &Cell::run_seconds, &Cell::trajectory_front);
  MarkFront(&tradeoff->cells, tradeoff->reference.gradient_error, &Cell::gradient_error,
            &Cell::both_seconds, &Cell::gradient_front);
}

Tradeoff RunTradeoff(const Scene& scene, const std::vector<ParameterPath>& parameters,
                     const TradeoffOptions& options,
                     const std::function<void(long done, long total)>& progress) {
  Tradeoff tradeoff;
  tradeoff.scene = scene.name.empty() ? scene.path : scene.name;
  tradeoff.own = scene.simulation;
  for (const ParameterPath& parameter : parameters) tradeoff.parameters.push_back(parameter.path);
  tradeoff.message = MakeReference(scene, parameters, options, &tradeoff.reference);
  if (!tradeoff.message.empty()) return tradeoff;
  tradeoff.scale = ScaleOf(scene, parameters, tradeoff.reference.run);
  Sweep sweep = MakeSweep(scene, options.sweep);
  tradeoff.left_out = std::move(sweep.left_out);
  const std::vector<double> lengths =
      StepLengths(scene.simulation, options.samples, options.dt_factors);
  for (const SimulationSettings& settings : sweep.settings) {
    for (const double dt : lengths) {
      Cell cell;
      cell.settings = settings;
      cell.settings.dt = dt;
      tradeoff.cells.push_back(std::move(cell));
    }
  }
  RunCells(scene, parameters, options, lengths.size(), progress, &tradeoff);
  MarkFronts(&tradeoff);
  return tradeoff;
}

const Cell* Cheapest(const Tradeoff& tradeoff, Target target, double error) {
  const Reference& reference = tradeoff.reference;
  const auto seconds = [&](const Cell& cell) {
    return target == Target::kTrajectory ? cell.run_seconds : cell.both_seconds;
  };
  const bool no_gradient = std::isnan(reference.gradient_error);
  const auto meets = [&](const Cell& cell) {
    const bool trajectory = (target == Target::kGradient && !no_gradient) ||
                            cell.trajectory_error + reference.trajectory_error <= error;
    const bool gradient = target == Target::kTrajectory || no_gradient ||
                          cell.gradient_error + reference.gradient_error <= error;
    return cell.measured() && trajectory && gradient;
  };
  double least = HUGE_VAL;
  for (const Cell& cell : tradeoff.cells) {
    if (meets(cell)) least = std::min(least, seconds(cell));
  }
  const auto plainest = std::find_if(
      tradeoff.cells.begin(), tradeoff.cells.end(),
      [&](const Cell& cell) { return meets(cell) && seconds(cell) <= kSameTime * least; });
  return plainest == tradeoff.cells.end() ? nullptr : &*plainest;
}

}  // namespace tangible::tradeoff
