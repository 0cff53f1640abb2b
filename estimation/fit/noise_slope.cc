// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/noise_slope.h"

#include <algorithm>
#include <cmath>

#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/fit/tolerances.h"

namespace tangible {
namespace {

/// The slope of one recording, and what is said of it.
struct BlockSlope {
  Eigen::VectorXd at, slope;
  std::vector<int> rough;  ///< parameters
  std::string message;     ///< empty: done
};

/// D at p; NaN where no run is possible.
double DeterminantAt(const Eigen::VectorXd& p, RolloutResiduals* run) {
  BlockEvaluation evaluation;
  if (!run->EvaluateBlock(0, p, GradientMethod::kTangent, BlockDerivatives::kSkip, &evaluation)) {
    return std::nan("");
  }
  return run->noise()->LogDeterminant();
}

/// Of the recording's parameters p; those of `held` have the slope 0.
BlockSlope SlopeAt(const Eigen::VectorXd& p, const std::vector<bool>& held, RolloutResiduals* run) {
  BlockSlope found{p, Eigen::VectorXd::Zero(p.size()), {}, ""};
  BlockEvaluation here;
  if (!run->EvaluateBlock(0, p, GradientMethod::kTangent, BlockDerivatives::kCompute, &here)) {
    found.message = here.message.empty() ? "no run is possible" : here.message;
    return found;
  }
  const double middle = run->noise()->LogDeterminant();
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    const double length = here.jacobian.col(i).norm();
    if (held[static_cast<size_t>(i)] || !(length > 0.0)) continue;
    const ParameterEntry& entry = run->entries()[static_cast<size_t>(i)];
    const double distance = kSlopeDistance / length;
    Eigen::VectorXd ends[] = {p, p};
    ends[0][i] = std::max(p[i] - distance, entry.lower);
    ends[1][i] = std::min(p[i] + distance, entry.upper);
    double below = DeterminantAt(ends[0], run);
    double above = DeterminantAt(ends[1], run);
    if (!std::isfinite(below)) {
      below = middle;
      ends[0] = p;
    }
    if (!std::isfinite(above)) {
      above = middle;
      ends[1] = p;
    }
    const double width = ends[1][i] - ends[0][i];
    const double slope = (above - below) / width;
    // What D has beside its slope, at a distance where the cost has kSlopeDistance² / 2.
    const double bend = std::abs(above - middle - slope * (ends[1][i] - p[i]));
    if (!std::isfinite(slope) || bend > kSlopeBend * kSlopeDistance * kSlopeDistance) {
      found.rough.push_back(static_cast<int>(i));
      continue;
    }
    found.slope[i] = slope;
  }
  // The fit goes on from here.
  DeterminantAt(p, run);
  return found;
}

}  // namespace

bool UpdateSlopes(const FitOptions& options, const FitResult& result, RecordingsProblem* problem,
                  double* largest, std::vector<std::string>* rough, std::string* message) {
  const std::vector<ParameterEntry>& entries = problem->entries();
  std::vector<BlockSlope> slopes(static_cast<size_t>(problem->num_blocks()));
  ForEachOnThreads(options.threads, problem->num_blocks(), [&](int b) {
    RolloutResiduals* const run = problem->run(b);
    Eigen::VectorXd p(run->num_parameters());
    std::vector<bool> held(static_cast<size_t>(p.size()));
    for (int i = 0; i < run->num_parameters(); ++i) {
      const int k = problem->ParameterOf(b, i);
      p[i] = result.estimate[k];
      held[static_cast<size_t>(i)] = IsAtBound(entries[static_cast<size_t>(k)], p[i]);
    }
    slopes[static_cast<size_t>(b)] = SlopeAt(p, held, run);
  });
  Eigen::VectorXd change = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(entries.size()));
  for (int b = 0; b < problem->num_blocks(); ++b) {
    const BlockSlope& one = slopes[static_cast<size_t>(b)];
    if (!one.message.empty()) {
      *message = problem->BlockName(b) + "the random forces' determinant: " + one.message;
      return false;
    }
    ProcessNoise* const noise = problem->run(b)->noise();
    for (int i = 0; i < problem->run(b)->num_parameters(); ++i) {
      const double before =
          noise->num_slope_rows() > 0 ? noise->slope()[i] * problem->weight(b) : 0.0;
      change[problem->ParameterOf(b, i)] += one.slope[i] - before;
    }
    for (const int i : one.rough) {
      rough->push_back(entries[static_cast<size_t>(problem->ParameterOf(b, i))].name);
    }
    // The weight of a recording multiplies its rows, and D it does not.
    noise->SetSlope(one.at, one.slope / problem->weight(b));
  }
  const Eigen::VectorXd& deviation = result.uncertainty.standard_deviation;
  for (Eigen::Index k = 0; k < change.size(); ++k) {
    const double moved = std::abs(change[k]) * deviation[k];
    if (std::isfinite(moved)) *largest = std::max(*largest, moved);
  }
  return true;
}

void RemoveSlopeOffset(const RecordingsProblem& problem, FitResult* result) {
  double offset = 0.0;
  for (int b = 0; b < problem.num_blocks(); ++b) {
    offset += problem.weight(b) * kSlopeOffset * problem.num_slope_rows(b);
  }
  result->initial_cost -= offset;
  result->final_cost -= offset;
  for (FitIteration& iteration : result->iterations) iteration.cost -= offset;
}

}  // namespace tangible
