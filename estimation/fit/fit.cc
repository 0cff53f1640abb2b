// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "tangible/estimation/fit/fit_checkpoint.h"
#include "tangible/estimation/fit/fit_parts.h"
#include "tangible/estimation/fit/held_refit.h"
#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/fit/minimise.h"
#include "tangible/estimation/fit/parameter_effects.h"
#include "tangible/estimation/fit/profile.h"
#include "tangible/estimation/fit/shooting.h"
#include "tangible/estimation/fit/starts.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/fit/windows.h"
#include "tangible/estimation/problem/problem_with_priors.h"
#include "tangible/estimation/uncertainty/residual_quality.h"
#include "tangible/estimation/uncertainty/tolerances.h"
#include "tangible/render/html.h"

namespace tangible {
namespace {

// Further starts are made by default of fits with at most so many recordings.
constexpr int kMostBlocksOfStarts = 30;
// Profiles that nobody asked for take twice as many runs as the fit, or each this many of each
// recording.
constexpr long kLeastProfileRuns = 400;
// Profiles may find a better minimum, from which everything is judged anew, so many times.
constexpr int kMostBetter = 3;

// Far from the minimum the first iterations of a fit that gets there gain the most.
constexpr int kTrialIterations = 5;

FitStart Describe(const Eigen::VectorXd& initial, const Minimum& minimum) {
  FitStart start;
  start.initial.assign(initial.data(), initial.data() + initial.size());
  start.status = NameOf(minimum.status);
  start.approach = NameOf(minimum.approach);
  start.approach_iterations = minimum.approach_iterations;
  start.message = minimum.approach_message;
  start.iterations = std::max(0, static_cast<int>(minimum.iterations.size()) - 1);
  if (minimum.status != FitStatus::kFailed) {
    start.estimate.assign(minimum.parameters.data(),
                          minimum.parameters.data() + minimum.parameters.size());
  }
  start.cost = minimum.status == FitStatus::kFailed ? std::numeric_limits<double>::quiet_NaN()
                                                    : minimum.cost;
  return start;
}

/// Whether a minimum is refuted by one that costs far less, by more than noise makes it.
bool IsFarAbove(double cost, double other) { return cost > kFarAbove * other + 1.0; }

/// Converged before not converged before failed, then the smaller cost. What has not converged is
/// better than a local minimum that costs far more.
bool IsBetter(const Minimum& a, const Minimum& b) {
  if (a.status == b.status) {
    return a.cost < b.cost;
  }
  if (a.status == FitStatus::kFailed || b.status == FitStatus::kFailed) {
    return b.status == FitStatus::kFailed;
  }
  return a.status < b.status ? !IsFarAbove(a.cost, b.cost) : IsFarAbove(b.cost, a.cost);
}

/// Where the starts begin.
struct FirstPoint {
  Eigen::VectorXd parameters;
  double gradient_norm = 0.0;  ///< at the initial values
  long rollouts = 0;           ///< of fits without a parameter
};

/// A point near the initial one at which each parameter changes a residual: the initial point
/// itself unless a parameter has no effect there; else beside it, or where the others lead without
/// it. Returns false, with the reason in the result, where there is none.
bool FindStart(const FitOptions& options, LeastSquaresProblem* problem, Linearizer* linearizer,
               FirstPoint* first, FitResult* result) {
  const std::vector<ParameterEntry>& entries = problem->entries();
  const HuberBounds huber{options.huber, options.huber};
  Linearisation model;
  Linearisation target;
  Eigen::VectorXd p = InitialOf(entries);
  first->parameters = p;
  if (!linearizer->Linearise(ToInternal(entries, p), huber, &model, &target)) {
    result->message = "the run at the initial values fails: " + linearizer->message();
    return options.starts > 1;
  }
  result->initial_cost = target.cost;
  first->gradient_norm = target.gradient.norm();
  const auto effect_at = [&](const Eigen::VectorXd& at) {
    Eigen::VectorXd effect = EffectsOf(linearizer->layout(), model);
    LeaveOutRounding(at, entries, linearizer, &effect);
    return effect;
  };
  Eigen::VectorXd effect = effect_at(p);
  double cost = target.cost;
  bool jumps = false;  // the cost changes with the parameter although its derivative is 0
  for (size_t round = 0; round <= entries.size(); ++round) {
    const int parameter = FindNoEffect(effect);
    if (parameter < 0) {
      first->parameters = p;
      return true;
    }
    bool found = false;
    for (size_t i = 0; i < std::size(kNudges) && !found && round < entries.size(); ++i) {
      const Eigen::VectorXd nudged = Nudged(entries[parameter], parameter, kNudges[i], p);
      if (linearizer->Linearise(ToInternal(entries, nudged), huber, &model, &target)) {
        effect = effect_at(nudged);
        found = effect[parameter] > kNoEffect;
        jumps = jumps || (!found && std::abs(target.cost - cost) > kJumpsBy * (1.0 + cost));
      }
      if (found) {
        p = nudged;
        cost = target.cost;
        jumps = false;
      }
    }
    for (const bool by_windows : {false, true}) {
      if (found || round == entries.size()) break;
      const Eigen::VectorXd moved =
          WithoutParameter(options, parameter, by_windows, p, problem, &first->rollouts);
      found = moved.size() > 0 &&
              linearizer->Linearise(ToInternal(entries, moved), huber, &model, &target);
      if (found) effect = effect_at(moved);
      found = found && effect[parameter] > kNoEffect;
      if (found) {
        p = moved;
        cost = target.cost;
        jumps = false;
      }
    }
    if (!found) {
      result->parameter = parameter;
      break;
    }
  }
  result->status = FitStatus::kNoEffect;
  const std::string name = "parameter \"" + entries[result->parameter].name + "\" has no ";
  result->message =
      jumps ? name +
                  "derivative: the residuals change with it by jumps alone, as accelerations "
                  "do with the time at which a body stops; other observations, or another "
                  "initial value, may have one"
            : name + "effect on any residual" +
                  (entries.size() > 1 ? ", neither at the initial values nor where the others lead"
                                      : "");
  for (const std::string& line : problem->FindInconsistencies(p)) result->message += "; " + line;
  return false;
}

/// The residuals of all observations, block by block.
Eigen::VectorXd ObservationResiduals(const LeastSquaresProblem& problem,
                                     const std::vector<BlockEvaluation>& blocks) {
  Eigen::VectorXd residuals(0);
  for (int b = 0; b < problem.num_blocks(); ++b) {
    const Eigen::Index before = residuals.size();
    const Eigen::Index rows = problem.num_observation_rows(b);
    residuals.conservativeResize(before + rows);
    residuals.tail(rows) = blocks[b].residuals.head(rows);
  }
  return residuals;
}

/// Seconds from now on.
std::function<double()> Stopwatch() {
  using Clock = std::chrono::steady_clock;
  return [began = Clock::now()] {
    return std::chrono::duration<double>(Clock::now() - began).count();
  };
}

/// The state of one fit.
struct FitRun {
  const FitOptions& options;
  const FitProgress& progress;
  const FitShooting& shooting;
  std::function<double()> elapsed;
  LeastSquaresProblem* problem;
  FitLog* log;
  bool logged;
  int start = 0;  ///< the number of the one under way
  long rollouts = 0;

  /// What the log has of the start under way has become a result of its own.
  void EndPart() const {
    log->start.Clear();
    log->rollouts = rollouts;
    if (log->on_end && log->mismatch() == 0) {
      log->on_end();
    }
  }
  EvaluationLog* LogOfStart() const { return logged ? &log->start : nullptr; }
};

/// The minimum that this approach leads to; none where the whole run is the first window.
std::optional<Minimum> Reach(const Eigen::VectorXd& start, FitApproach approach, FitRun* run) {
  FitLog* const log = run->log;
  const bool trial = approach == FitApproach::kTrial;
  const bool led = !trial && approach != FitApproach::kPlain;
  if (led && !log->shot) {
    log->shot = approach == FitApproach::kSegments
                    ? run->shooting(start, run->LogOfStart())
                    : GrowWindows(run->options, start, run->problem, run->LogOfStart());
    run->rollouts += log->shot->rollouts;
    run->EndPart();
  }
  if (approach == FitApproach::kWindows && log->shot->iterations == 0) {
    log->shot.reset();
    return std::nullopt;
  }
  const std::function<void(int, const FitIteration&)> report = [run](int iteration,
                                                                     const FitIteration& values) {
    if (run->progress) {
      run->progress(run->start, iteration, values);
    }
  };
  Minimum minimum = Minimise(run->options, led ? log->shot->parameters : start, run->elapsed,
                             report, run->problem, run->LogOfStart(),
                             trial ? Patience{kTrialIterations, kNoProgress} : Patience());
  run->rollouts += minimum.rollouts;
  minimum.approach = trial && !minimum.gave_up ? FitApproach::kPlain : approach;
  minimum.approach_iterations = led ? log->shot->iterations : 0;
  minimum.approach_message = led ? log->shot->message : "";
  log->shot.reset();
  return minimum;
}

/// Whether another approach may reach a better minimum.
bool MayBeLocal(const Minimum& minimum, FitRun* run) {
  if (minimum.status != FitStatus::kConverged) {
    return true;
  }
  Linearizer linearizer(run->problem, run->options.derivatives, run->options.threads, nullptr);
  std::vector<BlockEvaluation> blocks;
  if (!linearizer.Rows(minimum.parameters, BlockDerivatives::kSkip, &blocks)) {
    return true;
  }
  run->rollouts += linearizer.rollouts();
  const std::vector<ParameterEntry>& entries = run->problem->entries();
  int num_free = 0;
  for (size_t k = 0; k < entries.size(); ++k) {
    num_free += IsAtBound(entries[k], minimum.parameters[static_cast<Eigen::Index>(k)]) ? 0 : 1;
  }
  return JudgeResiduals(*run->problem, blocks, num_free).MayBeLocal();
}

/// The approaches to one minimum, each made where those before it may have led to another one. The
/// plain fit is always among them, so that none ends worse; where its first iterations show no
/// progress it comes last, and is not made at all where windows explain the observations.
std::vector<FitApproach> ApproachesOf(FitApproach asked) {
  switch (asked) {
    case FitApproach::kAuto:
      return {FitApproach::kTrial, FitApproach::kWindows, FitApproach::kPlain};
    case FitApproach::kPlain:
      return {FitApproach::kPlain};
    case FitApproach::kWindows:
      return {FitApproach::kWindows, FitApproach::kPlain};
    case FitApproach::kSegments:
      return {FitApproach::kSegments, FitApproach::kPlain, FitApproach::kWindows};
    case FitApproach::kTrial:
      return {FitApproach::kTrial};
  }
  return {};
}

/// The best of what a start's approaches reached, the earlier one where they end at the same
/// minimum.
size_t BestOf(const std::vector<Minimum>& reached) {
  size_t best = 0;
  for (size_t i = 1; i < reached.size(); ++i) {
    const bool same = reached[i].status == reached[best].status &&
                      reached[i].cost >= reached[best].cost * (1.0 - kSameCost);
    best = !same && IsBetter(reached[i], reached[best]) ? i : best;
  }
  return best;
}

/// What was made of a start: the best minimum, and what `told` says of the others.
Minimum BestFrom(const Eigen::VectorXd& start, FitApproach approach, FitRun* run, FitStart* told) {
  std::vector<Minimum>& reached = run->log->reached;
  const std::vector<FitApproach> approaches = ApproachesOf(approach);
  const auto is_plain = [](const Minimum& one) { return one.approach == FitApproach::kPlain; };
  // Those up to the last one that is kept were made, or had nothing to do, before an interruption.
  auto next = approaches.begin();
  if (!reached.empty()) {
    const bool trial = reached.size() == 1 && approaches.front() == FitApproach::kTrial;
    next = trial ? next + 1 : std::find(next, approaches.end(), reached.back().approach) + 1;
  }
  for (; next != approaches.end(); ++next) {
    // A trial that did not give up was the plain fit.
    if (*next == FitApproach::kPlain && std::any_of(reached.begin(), reached.end(), is_plain)) {
      continue;
    }
    // Where an approach has led somewhere this was asked before an interruption.
    const bool decided = reached.empty() || run->log->shot;
    if (!decided && !MayBeLocal(reached[BestOf(reached)], run)) break;
    std::optional<Minimum> minimum = Reach(start, *next, run);
    if (minimum) {
      reached.push_back(std::move(*minimum));
      run->EndPart();
    }
  }
  const auto cost_of = [](const Minimum& minimum) {
    return minimum.status == FitStatus::kFailed ? std::numeric_limits<double>::quiet_NaN()
                                                : minimum.cost;
  };
  const size_t best = BestOf(reached);
  for (size_t i = 0; i < reached.size(); ++i) {
    const double cost = cost_of(reached[i]);
    if (reached[i].approach == FitApproach::kPlain) {
      told->plain_cost = cost;
    } else if (i != best && reached[i].approach != FitApproach::kTrial &&
               !(cost > told->tried_cost)) {
      told->tried = NameOf(reached[i].approach);
      told->tried_cost = cost;
      told->message = reached[i].approach_message;
    }
  }
  Minimum result = reached[best];
  if (result.approach == FitApproach::kTrial) {  // no other approach has led anywhere
    result.approach = FitApproach::kPlain;
  }
  return result;
}

/// A start was moved to where each parameter has an effect and led to a minimum that costs more
/// than the initial values: the plain fit from these is taken, in which some parameter stays.
void KeepInitial(const Eigen::VectorXd& initial, FitRun* run, Minimum* minimum) {
  const Minimum other =
      Minimise(run->options, initial, run->elapsed, {}, run->problem, run->LogOfStart());
  run->rollouts += other.rollouts;
  if (IsBetter(other, *minimum)) {
    *minimum = other;
  }
}

/// Minimises from `start`. The first start also describes the initial values where it begins
/// elsewhere.
FinishedStart MakeStart(int number, const Eigen::VectorXd& start, FitApproach approach,
                        const FirstPoint& first, double initial_cost, FitRun* run) {
  const bool is_first = number == 0;
  const long before = run->rollouts;
  run->start = number;
  FitStart told;
  FinishedStart done;
  Minimum& minimum = done.minimum = BestFrom(start, approach, run, &told);
  const Eigen::VectorXd initial = InitialOf(run->problem->entries());
  if (is_first && start != initial && minimum.cost > initial_cost) {
    KeepInitial(initial, run, &minimum);
  }
  // Not before: what goes on after an interruption within KeepInitial begins behind them.
  run->log->reached.clear();
  const bool elsewhere = start != initial || minimum.approach != FitApproach::kPlain;
  if (is_first && elsewhere && !minimum.iterations.empty() && std::isfinite(initial_cost)) {
    minimum.iterations.insert(
        minimum.iterations.begin(),
        {initial_cost, first.gradient_norm,
         std::vector<double>(initial.data(), initial.data() + initial.size()), 0.0});
  }
  done.told = Describe(is_first ? initial : start, minimum);
  done.told.plain_cost = told.plain_cost;
  done.told.tried = told.tried;
  done.told.tried_cost = told.tried_cost;
  if (!told.message.empty()) {
    done.told.message = told.message;
  }
  done.rollouts = run->rollouts - before;
  return done;
}

/// Makes a start, or takes it over from elsewhere, and keeps in the log how it ended.
void RunStart(const Eigen::VectorXd& start, FitApproach approach, const FirstPoint& first,
              double initial_cost, FitRun* run) {
  FitLog* const log = run->log;
  const int number = static_cast<int>(log->starts.size());
  FinishedStart done;
  if (log->parts != nullptr && log->parts->starts.count(number) > 0) {
    done = log->parts->starts.at(number);
    run->rollouts += done.rollouts;
    for (const SaidIteration& said : done.said) {
      if (run->progress) run->progress(number, said.number, said.values);
    }
  } else {
    done = MakeStart(number, start, approach, first, initial_cost, run);
  }
  log->starts.push_back(std::move(done.told));
  // Of starts that end at the same minimum the first one is told of.
  const Minimum& minimum = done.minimum;
  const bool same = number > 0 && minimum.status == log->best.status &&
                    minimum.cost >= log->best.cost * (1.0 - kSameCost);
  if (number == 0 || (!same && IsBetter(minimum, log->best))) {
    log->best = std::move(done.minimum);
  }
  run->EndPart();
}

std::string DescribeApproach(const Minimum& minimum) {
  return std::string(minimum.approach == FitApproach::kWindows ? "growing windows"
                                                               : "multiple shooting") +
         " led to this minimum in " + std::to_string(minimum.approach_iterations) + " iterations";
}

/// Residuals, intervals and warnings of a minimum.
void Finish(const Minimum& best, FitRun* run, FitResult* result) {
  result->status = best.status;
  result->message = best.message;
  if (best.status == FitStatus::kFailed) {
    return;
  }
  Linearizer linearizer(run->problem, run->options.derivatives, run->options.threads, nullptr);
  std::vector<BlockEvaluation> blocks;
  if (!linearizer.Rows(best.parameters, BlockDerivatives::kCompute, &blocks)) {
    result->status = FitStatus::kFailed;
    result->message = "the run at the estimate fails: " + linearizer.message();
    return;
  }
  run->rollouts += linearizer.rollouts();
  const Eigen::VectorXd residuals = ObservationResiduals(*run->problem, blocks);
  if (!std::isfinite(residuals.squaredNorm())) {  // Huber's loss may be finite all the same
    result->status = FitStatus::kFailed;
    result->message =
        "the squares of the residuals are not finite: an observation or a sigma is beyond all "
        "bounds";
    return;
  }
  result->estimate = best.parameters;
  result->iterations = best.iterations;
  if (!std::isfinite(result->initial_cost)) {
    result->initial_cost = best.iterations.front().cost;
  }
  result->final_cost = best.cost;
  if (best.approach != FitApproach::kPlain) {
    result->message += std::string(result->message.empty() ? "" : "; ") + DescribeApproach(best);
  }
  result->residuals = residuals;
  UncertaintyOptions uncertainty;
  uncertainty.leverages = run->options.leverages;
  uncertainty.huber = run->options.huber;
  uncertainty.rank_tolerance = run->options.derivatives == GradientMethod::kFiniteDifference
                                   ? kDifferencesRank
                                   : kJacobianRank;
  result->uncertainty = EstimateUncertainty(*run->problem, best.parameters, blocks, uncertainty);
}

/// Whether the cost may have several minima: through impacts, where something sticks, and with a
/// robust loss. Fits of many recordings, which take long, have few: recordings average them out.
bool MayHaveOthers(FitRun* run) {
  const Minimum& best = run->log->best;
  if (best.status == FitStatus::kFailed || run->problem->num_blocks() > kMostBlocksOfStarts) {
    return false;
  }
  if (run->options.huber > 0.0) {
    return true;
  }
  const std::optional<Certificate> certificate = run->problem->Certify(best.parameters);
  run->rollouts += run->problem->num_blocks();
  return certificate && (certificate->events > 0 || certificate->mode_switches > 0 ||
                         !certificate->discrete_map.empty());
}

/// All starts, with the log's evaluations if there is one.
void RunStarts(FitRun* run, FitResult* result) {
  FitLog* const log = run->log;
  const std::vector<ParameterEntry>& entries = run->problem->entries();
  Linearizer search(run->problem, run->options.derivatives, run->options.threads,
                    run->logged ? &log->search : nullptr);
  FirstPoint first;
  const bool found = FindStart(run->options, run->problem, &search, &first, result);
  run->rollouts = search.rollouts() + first.rollouts;
  if (!found) {
    return;
  }
  if (!log->starts.empty() || log->shot || !log->reached.empty()) {
    run->rollouts = log->rollouts;
  }
  std::mt19937 random(run->options.seed);
  const auto is_done = [log](int i) {  // before an interruption
    return i < static_cast<int>(log->starts.size());
  };
  for (int i = 0; i < std::max(1, run->options.starts); ++i) {
    const Eigen::VectorXd start = i == 0 ? first.parameters : DrawStart(entries, &random);
    if (!is_done(i)) {
      RunStart(start, run->options.approach, first, result->initial_cost, run);
    }
  }
  // Where a second start was begun before an interruption, this was asked and its runs counted.
  const bool others = log->starts.size() > 1 || log->shot || !log->reached.empty();
  if (run->options.starts == 0 && (others || MayHaveOthers(run))) {
    for (const double side : {1.0, -1.0}) {
      if (!is_done(side > 0.0 ? 1 : 2)) {
        // It is one more look, and no search: without progress it ends at once.
        RunStart(Shifted(entries, log->starts.front().estimate, side), FitApproach::kTrial, first,
                 result->initial_cost, run);
      }
    }
  }
  result->starts = log->starts;
  result->agreement = DescribeAgreement(log->starts, log->best.cost);
  Finish(log->best, run, result);
}

// Where the model does not fit, or a parameter is at its bound, the cause may be a held parameter
// of the scene.
void TestHeld(const FitOptions& options, LeastSquaresProblem* problem, FitResult* result) {
  Uncertainty& uncertainty = result->uncertainty;
  bool suspicious = uncertainty.DoesNotFit();
  for (size_t k = 0; k < problem->entries().size(); ++k) {
    suspicious = suspicious ||
                 IsAtBound(problem->entries()[k], result->estimate[static_cast<Eigen::Index>(k)]);
  }
  // A prior that is contradicted is a cause of misfit already.
  suspicious = suspicious && !uncertainty.contradicts_prior;
  // This is NaN where residuals are rounding.
  if (!suspicious || !std::isfinite(uncertainty.whiteness.correlation)) {
    return;
  }
  HeldOptions held;
  held.derivatives = options.derivatives;
  result->held = ConfirmHeld(options, held, FindHeldParameters(result->estimate, held, problem),
                             problem, result);
  for (const HeldParameter& parameter : result->held) {
    uncertainty.warnings.push_back(Describe(parameter));
  }
}

void CheckBodies(LeastSquaresProblem* problem, FitResult* result) {
  for (const std::string& body : problem->FindInconsistencies(result->estimate)) {
    result->uncertainty.warnings.push_back(body);
  }
}

}  // namespace

const char* NameOf(FitApproach approach) {
  switch (approach) {
    case FitApproach::kAuto:
      return "auto";
    case FitApproach::kPlain:
      return "plain";
    case FitApproach::kWindows:
      return "windows";
    case FitApproach::kSegments:
      return "segments";
    case FitApproach::kTrial:
      return "trial";
  }
  return "";
}

const char* NameOf(FitStatus status) {
  switch (status) {
    case FitStatus::kConverged:
      return "converged";
    case FitStatus::kNotConverged:
      return "not_converged";
    case FitStatus::kFailed:
      return "failed";
    case FitStatus::kNoEffect:
      return "no_effect";
  }
  return "";
}

void Certify(LeastSquaresProblem* problem, FitResult* result) {
  const std::optional<Certificate> certificate = problem->Certify(result->estimate);
  if (!certificate) {
    return;
  }
  result->certificate = *certificate;
  problem->AddRadii(result->estimate, &result->certificate);
  const std::string& impact = result->certificate.discrete_impact;
  const std::string instead = impact.empty() ? "" : std::string("; ") + kMotionInstead;
  if (IsTrustworthyMap(result->certificate) && !impact.empty()) {
    result->uncertainty.warnings.push_back(
        "the derivatives at the estimate, and with them the intervals, are those of the discrete "
        "map and may be far from the motion's: " +
        impact + instead);
  }
  if (!IsTrustworthyMap(result->certificate)) {
    const std::string warning =
        "the derivatives at the estimate, and with them the intervals, are not trustworthy: " +
        result->certificate.verdict + instead;
    result->uncertainty.warnings.push_back(warning);
    result->message += (result->message.empty() ? "" : "; ") + warning;
  }
}

namespace {

/// A profile, made or taken over from elsewhere.
FinishedProfile ProfileOf(const FitRun& run, const FitResult& result, int parameter, long budget) {
  if (run.log->parts != nullptr) {
    const auto& known = run.log->parts->profiles;
    const auto found = known.find(run.problem->entries()[static_cast<size_t>(parameter)].name);
    if (found != known.end() && found->second.estimate == result.estimate) return found->second;
  }
  FinishedProfile done;
  done.estimate = result.estimate;
  done.profile = MakeProfile(run.options, result, parameter, budget, run.problem, &done.better,
                             &done.rollouts);
  return done;
}

/// The profiles that are asked for or needed; the lowest point of one where that costs less than
/// the estimate, else empty.
Eigen::VectorXd MakeProfiles(FitRun* run, FitResult* result) {
  result->profiles.clear();
  Eigen::VectorXd better;
  const auto needed = NeedProfiles(run->options, *result, run->problem, &result->rollouts);
  const long least = kLeastProfileRuns * run->problem->num_blocks();
  const long most = std::max(least * static_cast<long>(needed.size()), 2 * result->rollouts);
  long end = result->rollouts + most;
  FitParts* const parts = run->log->parts;
  const bool part = parts != nullptr && parts->is_wanted;  // others make the rest
  for (const auto& [parameter, why] : needed) {
    const std::string& name = run->problem->entries()[static_cast<size_t>(parameter)].name;
    if (part && !parts->is_wanted(name)) continue;
    const bool asked = why == kAskedFor;
    const long budget = asked ? std::numeric_limits<long>::max() : end - result->rollouts;
    FinishedProfile done = ProfileOf(*run, *result, parameter, budget);
    result->rollouts += done.rollouts;
    if (asked) end += done.rollouts;  // what is asked for is not counted
    if (part) {
      parts->made[name] = std::move(done);
      continue;
    }
    better = done.better;
    Profile& profile = done.profile;
    if (better.size() > 0) break;
    if (profile.branches.empty()) {
      std::string text = "the interval of '";
      text.append(name).append("' may be wrong (").append(why);
      text.append("): its profile takes long; --profile makes it");
      result->uncertainty.warnings.push_back(std::move(text));
      continue;
    }
    profile.why = why;
    result->profiles.push_back(std::move(profile));
  }
  return better;
}

/// What is said of an estimate beside its intervals by derivatives. Where a profile finds a better
/// minimum it becomes the estimate.
void Judge(FitRun* run, FitResult* result) {
  const FitOptions& options = run->options;
  for (int round = 0;; ++round) {
    CheckBodies(run->problem, result);
    if (options.held_test == HeldTest::kRun) {
      TestHeld(options, run->problem, result);
    }
    if (options.certificate == CertificatePass::kRun) {
      Certify(run->problem, result);
    }
    const Eigen::VectorXd better = MakeProfiles(run, result);
    if (better.size() == 0 || round == kMostBetter) {
      break;
    }
    Minimum minimum = Minimise(options, better, run->elapsed, {}, run->problem);
    result->rollouts += minimum.rollouts;
    if (minimum.status == FitStatus::kFailed || !(minimum.cost < result->final_cost)) {
      break;
    }
    minimum.iterations.insert(minimum.iterations.begin(), result->iterations.begin(),
                              result->iterations.end());
    const std::string told = "a profile found a minimum of cost " + CompactNumber(minimum.cost, 6) +
                             " beside one of " + CompactNumber(result->final_cost, 6);
    Finish(minimum, run, result);
    result->message += (result->message.empty() ? "" : "; ") + told;
    if (result->estimate.size() == 0) return;
  }
  result->intervals = FinalIntervals(run->problem->entries(), *result);
  // What has an interval by its profile is not said to have none.
  for (const Profile& profile : result->profiles) {
    std::string& message = result->uncertainty.messages[static_cast<size_t>(profile.parameter)];
    const size_t at = message.rfind(": no interval");
    if (at == std::string::npos || profile.branches.empty()) continue;
    for (std::string& warning : result->uncertainty.warnings) {
      if (warning.size() > message.size() &&
          warning.compare(warning.size() - message.size(), message.size(), message) == 0) {
        warning.erase(warning.rfind(": no interval"));
        break;
      }
    }
    message.erase(at);
  }
}

}  // namespace

FitResult Fit(const FitOptions& options, LeastSquaresProblem* problem, const FitProgress& progress,
              FitLog* log, const FitShooting& shooting) {
  FitLog own;
  FitRun run{options,
             progress,
             shooting,
             Stopwatch(),
             problem,
             log == nullptr ? &own : log,
             log != nullptr && log->parts == nullptr};
  FitResult result;
  try {
    RunStarts(&run, &result);
  } catch (const EvaluationMismatch& mismatch) {
    result.message = mismatch.what();
  }
  result.rollouts = run.rollouts;
  result.seconds = run.elapsed();
  if (result.estimate.size() > 0) {
    Judge(&run, &result);
  }
  return result;
}

namespace {

/// Calls a function with the problem that has the rows of priors too, and its multiple shooting.
template <typename Function>
auto WithPriors(const FitOptions& options, RecordingsProblem* problem, const Function& function) {
  const FitShooting shooting = [&options, problem](const Eigen::VectorXd& start,
                                                   EvaluationLog* evaluations) {
    return Shoot(options, start, problem, evaluations);
  };
  ProblemWithPriors with_priors(problem, problem->effects());
  LeastSquaresProblem* const whole =
      with_priors.HasRows() ? static_cast<LeastSquaresProblem*>(&with_priors) : problem;
  return function(whole, shooting);
}

}  // namespace

FitResult Fit(const FitOptions& options, RecordingsProblem* problem, const FitProgress& progress,
              FitLog* log) {
  FitResult result =
      WithPriors(options, problem, [&](LeastSquaresProblem* whole, const FitShooting& shooting) {
        return Fit(options, whole, progress, log, shooting);
      });
  for (const RandomEffect& effect : problem->effects()) {
    // A shared value is determined only through the values of the recordings, or by a prior.
    if (result.estimate.size() > 0 && !problem->entries()[effect.mean].prior) {
      result.uncertainty.prior_share[effect.mean] = 0.0;
    }
  }
  return result;
}

std::vector<std::optional<FinishedStart>> MakeStarts(const FitOptions& options,
                                                     RecordingsProblem* problem,
                                                     const std::vector<int>& numbers) {
  std::vector<std::optional<FinishedStart>> starts(numbers.size());
  std::vector<SaidIteration> said;
  const FitProgress keep = [&said](int, int iteration, const FitIteration& values) {
    said.push_back({iteration, values});
  };
  WithPriors(options, problem, [&](LeastSquaresProblem* whole, const FitShooting& shooting) {
    FitLog log;
    FitRun run{options, keep, shooting, Stopwatch(), whole, &log, false};
    Linearizer search(whole, options.derivatives, options.threads, nullptr);
    FirstPoint first;
    FitResult result;
    if (!FindStart(options, whole, &search, &first, &result)) return;
    std::mt19937 random(options.seed);
    for (int number = 0; number < NumStarts(options); ++number) {
      const Eigen::VectorXd start =
          number == 0 ? first.parameters : DrawStart(whole->entries(), &random);
      const auto wanted = std::find(numbers.begin(), numbers.end(), number);
      if (wanted == numbers.end()) continue;
      said.clear();
      FinishedStart& done = starts[static_cast<size_t>(wanted - numbers.begin())].emplace(
          MakeStart(number, start, options.approach, first, result.initial_cost, &run));
      done.said = said;
    }
  });
  return starts;
}

FitResult Fit(const FitOptions& options, RolloutResiduals* residuals, const FitProgress& progress,
              FitLog* log) {
  RecordingsProblem problem(std::move(*residuals));
  FitResult result = Fit(options, &problem, progress, log);
  *residuals = std::move(*problem.run(0));
  return result;
}

}  // namespace tangible
