// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/variance_components.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "tangible/estimation/fit/fit_checkpoint.h"
#include "tangible/estimation/fit/noise_slope.h"
#include "tangible/estimation/fit/tolerances.h"

namespace tangible {
namespace {

constexpr int kMostFits = 20;

/// `next` as the continuation of `result`.
void Append(FitResult next, FitResult* result) {
  std::vector<FitIteration> iterations = std::move(result->iterations);
  for (FitIteration& iteration : next.iterations) {
    iteration.seconds += result->seconds;
    iterations.push_back(std::move(iteration));
  }
  next.iterations = std::move(iterations);
  next.starts = std::move(result->starts);
  next.initial_cost = result->initial_cost;
  next.rollouts += result->rollouts;
  next.seconds += result->seconds;
  *result = std::move(next);
}

std::vector<SpreadEstimate> SpreadsOf(const RecordingsProblem& problem) {
  std::vector<SpreadEstimate> spreads;
  for (size_t e = 0; e < problem.effects().size(); ++e) {
    const RandomEffect& effect = problem.effects()[e];
    spreads.push_back({effect.name, effect.kind, effect.spread, std::nullopt,
                       problem.EstimatesSpread(static_cast<int>(e)), problem.num_blocks()});
  }
  return spreads;
}

bool Update(const FitOptions& options, RecordingsProblem* problem, FitResult* result,
            VarianceComponents* components, double* largest) {
  const bool spreads = std::any_of(components->spreads.begin(), components->spreads.end(),
                                   [](const SpreadEstimate& one) { return one.estimated; });
  const bool forces = std::any_of(components->forces.begin(), components->forces.end(),
                                  [](const NoiseIntensity& one) { return one.estimated; });
  if (forces && !UpdateIntensities(options, *result, problem, &components->forces, largest,
                                   &result->message)) {
    return false;
  }
  components->rough.clear();
  if (!components->forces.empty() &&
      !UpdateSlopes(options, *result, problem, largest, &components->rough, &result->message)) {
    return false;
  }
  return (components->noise.empty() ||
          UpdateNoise(options, *result, problem, &components->noise, largest, &result->message)) &&
         (!spreads || UpdateSpreads(options, *result, problem, &components->spreads, largest,
                                    &result->message));
}

/// Random forces follow what poor initial values miss, and there their likelihood may have a mode
/// of its own, or none that is found: where a fit that begins without them has a larger one, it
/// becomes the result.
void TryWithoutForces(const FitOptions& options, const std::function<FitResult()>& fit,
                      RecordingsProblem* problem, FitResult* result,
                      std::vector<NoiseIntensity>* forces) {
  constexpr double kLarger = 1.0;  // nats: both are found to less
  std::vector<NoiseIntensity> follow = *forces, without = *forces;
  double unused = 0.0, of_follow = HUGE_VAL, of_without = 0.0;
  std::string none;
  if (result->status == FitStatus::kConverged &&
      !UpdateIntensities(options, *result, problem, &follow, &unused, &none, &of_follow)) {
    return;
  }
  BeginWithoutForces(problem);
  without = IntensitiesOf(*problem);
  FitResult other = fit();
  const bool is_better =
      other.status == FitStatus::kConverged &&
      UpdateIntensities(options, other, problem, &without, &unused, &none, &of_without) &&
      of_without < of_follow - kLarger;
  SetIntensities(is_better ? without : *forces, problem);
  if (!is_better) {
    result->rollouts += other.rollouts;
    result->seconds += other.seconds;
    return;
  }
  *forces = without;
  Append(std::move(other), result);
}

/// What is said of the random forces, and their course, of a result that is the last one.
void ConcludeForces(const FitOptions& options, RecordingsProblem* problem, FitResult* result,
                    VarianceComponents* components) {
  for (NoiseIntensity& one : components->forces) {
    if (!one.estimated) continue;
    if (result->status != FitStatus::kConverged) one.interval.reset();
    if (one.seen) continue;
    result->uncertainty.warnings.push_back(
        "the observations show no random force of " + NameOf(one.term) +
        ", whose intensity has no interval: the model explains them without it");
  }
  for (const std::string& name : components->rough) {
    result->uncertainty.warnings.push_back(
        "the random forces are not integrated out along '" + name +
        "', where their determinant is not smooth: it is the mode beside the forces");
  }
  if (components->forces.empty() || result->estimate.size() == 0) return;
  std::string message;
  components->smoothed = SmoothedRuns(options, result->estimate, problem, &message);
  if (!message.empty()) result->uncertainty.warnings.push_back("no smoothed states: " + message);
}

/// Intervals of spreads, and the certificate, of a result that is the last one.
void Conclude(const FitOptions& options, RecordingsProblem* problem, FitResult* result,
              std::vector<SpreadEstimate>* spreads) {
  const bool converged = result->status == FitStatus::kConverged;
  for (SpreadEstimate& one : *spreads) {
    if (!one.estimated || (converged && one.limited)) {
      continue;
    }
    one.interval.reset();
    result->uncertainty.warnings.push_back(
        one.limited ? "the spread of '" + one.name +
                          "' has no interval, for the fits that look for it did not converge"
                    : "the observations do not limit the spread of '" + one.name +
                          "' from above, and it has no interval");
  }
  const bool certified = !result->certificate.verdict.empty();
  if (!certified && result->estimate.size() > 0 && options.certificate == CertificatePass::kRun) {
    Certify(problem, result);
  }
}

}  // namespace

FitOptions OptionsFor(FitOptions options, const RecordingsProblem& problem) {
  if (!problem.HasNoise()) return options;
  options.approach = FitApproach::kPlain;
  options.starts = std::max(1, options.starts);
  options.certificate = CertificatePass::kSkip;
  options.held_test = HeldTest::kSkip;
  options.profile_pass = ProfilePass::kSkip;
  return options;
}

FitResult FitWithComponents(const FitOptions& asked, RecordingsProblem* problem,
                            const FitProgress& progress, VarianceComponents* components,
                            const NextLog& next_log) {
  const FitOptions options = OptionsFor(asked, *problem);
  if (problem->HasNoise()) BeginIntensities(problem);
  *components = {SensorsToEstimate(*problem), SpreadsOf(*problem), IntensitiesOf(*problem), {}, {}};
  const auto fit = [&](const FitOptions& how, const FitProgress& told, bool* same) {
    FitLog* const log = next_log ? next_log() : nullptr;
    FitResult result = Fit(how, problem, told, log);
    RemoveSlopeOffset(*problem, &result);
    *same = log == nullptr || log->mismatch() == 0;
    return result;
  };
  bool same = true;
  const bool estimates = !components->noise.empty() || !components->forces.empty() ||
                         std::any_of(components->spreads.begin(), components->spreads.end(),
                                     [](const SpreadEstimate& one) { return one.estimated; });
  if (!estimates) {
    return fit(options, progress, &same);
  }
  const bool estimates_forces =
      std::any_of(components->forces.begin(), components->forces.end(),
                  [](const NoiseIntensity& one) { return one.estimated; });
  if (estimates_forces) SettleIntensities(options, problem, &components->forces);
  // The tests that judge the estimate are made once, with the final components.
  FitOptions search = options;
  search.certificate = CertificatePass::kSkip;
  search.held_test = HeldTest::kSkip;
  search.profile_pass = ProfilePass::kSkip;
  search.profiles.clear();
  search.leverages = components->noise.empty() ? Leverages::kSkip : Leverages::kCompute;
  FitResult result = fit(search, progress, &same);
  if (estimates_forces && same) {
    const auto again = [&] { return fit(search, {}, &same); };
    TryWithoutForces(options, again, problem, &result, &components->forces);
  }
  search.starts = 1;
  search.approach = FitApproach::kPlain;
  for (int fits = 1; same && result.status == FitStatus::kConverged; ++fits) {
    double largest = 0.0;
    if (!Update(options, problem, &result, components, &largest)) {
      result.status = FitStatus::kNotConverged;
      break;
    }
    problem->SetInitial(result.estimate);
    const bool settled = largest < kSettledChange;
    if (settled) {
      search.certificate = options.certificate;
      search.held_test = options.held_test;
      search.profile_pass = options.profile_pass;
      search.profiles = options.profiles;
    }
    FitResult next = fit(search, {}, &same);
    if (next.estimate.size() == 0 && same) {
      result.status = FitStatus::kNotConverged;
      result.message =
          "with the sigma of sensors and spread of parameters that were found: " + next.message;
      break;
    }
    Append(std::move(next), &result);
    if (settled) {
      break;
    }
    if (fits == kMostFits) {
      result.status = FitStatus::kNotConverged;
      result.message =
          "the sigma of sensors, the spread of parameters or the intensity of random forces did "
          "not settle in " +
          std::to_string(fits) + " fits";
    }
  }
  Conclude(options, problem, &result, &components->spreads);
  ConcludeForces(options, problem, &result, components);
  return result;
}

}  // namespace tangible
