// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>

#include "tangible/estimation/minimise.h"
#include "tangible/estimation/shooting.h"

namespace tangible {
namespace {

// A parameter that moves no residual by more than this many sigma, changed by its own magnitude,
// has no effect.
constexpr double kNoEffect = 1e-12;

// Differences carry an error of about 1e-9, the other methods one of about 1e-12.
constexpr double kRankTolerance = 1e-9;
constexpr double kRankToleranceOfDifferences = 1e-6;

/// A start drawn within the bounds, evenly in the minimiser's coordinates; where there is no bound,
/// within a factor of ten, or a typical magnitude, of the initial value.
Eigen::VectorXd DrawStart(const std::vector<ParameterizedScene::Entry>& entries,
                          std::mt19937* random) {
  Eigen::VectorXd p(static_cast<Eigen::Index>(entries.size()));
  for (size_t k = 0; k < entries.size(); ++k) {
    const ParameterizedScene::Entry& entry = entries[k];
    // mt19937 is the same everywhere; the library's distributions are not.
    const double part = ((*random)() + 0.5) / 4294967296.0;
    double low = entry.lower;
    double high = entry.upper;
    if (entry.logarithmic) {
      low = std::log(low > 0.0 ? low : std::min(0.1 * entry.initial, high));
      high = std::log(std::isfinite(high) ? high : std::max(10.0 * entry.initial, entry.lower));
    } else {
      low = std::isfinite(low) ? low : std::min(entry.initial - entry.scale, high);
      high = std::isfinite(high) ? high : std::max(entry.initial + entry.scale, low);
    }
    const double drawn = low + part * (high - low);
    p[static_cast<Eigen::Index>(k)] =
        std::clamp(entry.logarithmic ? std::exp(drawn) : drawn, entry.lower, entry.upper);
  }
  return p;
}

/// The first parameter whose column of J is zero; −1 if none is.
int FindNoEffect(const std::vector<ParameterizedScene::Entry>& entries,
                 const RowMatrixXd& jacobian) {
  for (size_t k = 0; k < entries.size(); ++k) {
    const auto column = jacobian.col(static_cast<Eigen::Index>(k));
    if (column.cwiseAbs().maxCoeff() * entries[k].scale <= kNoEffect) {
      return static_cast<int>(k);
    }
  }
  return -1;
}

FitStart Describe(const Eigen::VectorXd& initial, const Minimum& minimum) {
  FitStart start;
  start.initial.assign(initial.data(), initial.data() + initial.size());
  start.status = NameOf(minimum.status);
  start.iterations = std::max(0, static_cast<int>(minimum.iterations.size()) - 1);
  start.cost = minimum.status == FitStatus::kFailed ? std::numeric_limits<double>::quiet_NaN()
                                                    : minimum.cost;
  return start;
}

/// Converged before not converged before failed, then the smaller cost.
bool IsBetter(const Minimum& a, const Minimum& b) {
  return a.status != b.status ? a.status < b.status : a.cost < b.cost;
}

/// False, with the result saying why, where the initial point cannot be run or a parameter does
/// nothing there.
bool CheckInitial(const FitOptions& options, const Eigen::VectorXd& initial,
                  RolloutResiduals* residuals, FitResult* result) {
  Eigen::VectorXd values;
  RowMatrixXd jacobian;
  if (!residuals->Evaluate(initial, options.derivatives, &values, &jacobian)) {
    result->message = "the run at the initial values fails: " + residuals->message();
    return options.starts > 1;
  }
  result->initial_cost = RobustCost(values, options.huber);
  result->parameter = FindNoEffect(residuals->scene().entries(), jacobian);
  if (result->parameter < 0) {
    return true;
  }
  result->status = FitStatus::kNoEffect;
  result->message = "parameter \"" + residuals->scene().entries()[result->parameter].name +
                    "\" has no effect on any residual";
  return false;
}

void Finish(const FitOptions& options, const RolloutResiduals& residuals, const Minimum& best,
            FitResult* result) {
  result->status = best.status;
  result->message = best.message;
  if (best.status == FitStatus::kFailed) {
    return;
  }
  result->estimate = best.parameters;
  result->iterations = best.iterations;
  result->residuals = best.residuals;
  if (!std::isfinite(result->initial_cost)) {
    result->initial_cost = best.iterations.front().cost;
  }
  result->final_cost = best.cost;
  UncertaintyOptions uncertainty;
  uncertainty.huber = options.huber;
  uncertainty.rank_tolerance = options.derivatives == DerivativeMethod::kFiniteDifference
                                   ? kRankToleranceOfDifferences
                                   : kRankTolerance;
  result->uncertainty = EstimateUncertainty(residuals.scene().entries(), best.parameters,
                                            best.residuals, best.jacobian, uncertainty);
}

}  // namespace

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

FitResult Fit(const FitOptions& options, RolloutResiduals* residuals, const FitProgress& progress) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point began = Clock::now();
  const std::function<double()> elapsed = [began] {
    return std::chrono::duration<double>(Clock::now() - began).count();
  };
  FitResult result;
  const long rollouts_before = residuals->rollouts();
  const Eigen::VectorXd initial = residuals->scene().Initial();
  if (CheckInitial(options, initial, residuals, &result)) {
    std::mt19937 random(options.seed);
    Minimum best;
    for (int i = 0; i < options.starts; ++i) {
      const Eigen::VectorXd start =
          i == 0 ? initial : DrawStart(residuals->scene().entries(), &random);
      const std::function<void(int, const FitIteration&)> report =
          [&progress, i](int iteration, const FitIteration& values) {
            if (progress) {
              progress(i, iteration, values);
            }
          };
      ShootingResult shot;
      shot.parameters = start;
      if (options.segments > 1) {
        shot = Shoot(options, start, residuals);
      }
      Minimum minimum = Minimise(options, shot.parameters, elapsed, report, residuals);
      result.starts.push_back(Describe(start, minimum));
      result.starts.back().shooting_iterations = shot.iterations;
      if (i == 0 || IsBetter(minimum, best)) {
        best = std::move(minimum);
      }
    }
    Finish(options, *residuals, best, &result);
  }
  result.rollouts = residuals->rollouts() - rollouts_before;
  result.seconds = elapsed();
  return result;
}

}  // namespace tangible
