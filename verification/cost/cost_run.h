// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The cost of the gradient of a rollout's loss by each method, measured in a separate process: CPU
// time, as a multiple of one rollout of the same run, and peak memory.
//
// Every gradient is compared with the adjoint's before it is timed.

#include <functional>
#include <string>
#include <vector>

#include "tangible/scene/scene.h"
#include "tangible/verification/cost/child.h"

namespace tangible::cost {

enum class CostMethod {
  kRollout,  ///< no derivative
  kAdjoint,
  kAdjointWithCheckpoints,
  kTangent,
  kImplicitJets,
  kUnrolledJets,
  kDifferences,
  kTape,  ///< ADOL-C through the unrolled solver
};
inline constexpr int kNumCostMethods = 8;

/// Bytes, in which memory is shown and limited.
inline constexpr double kMebibyte = 1048576.0;

/// "adjoint", "implicit Jets", ...
const char* NameOf(CostMethod method);

struct CostOptions {
  Stepping stepping = Stepping::kFixed;
  std::vector<int> parameters;  ///< ascending
  std::vector<long> steps;      ///< ascending
  Budget budget;
  size_t tape_budget = 48u << 20;  ///< of the adjoint with checkpoints, bytes
  double repeat_seconds = 0.2;     ///< of CPU time that repeats of a cell may take, about
  int most_repeats = 25;
};

struct CostCell {
  CostMethod method = CostMethod::kRollout;
  int parameters = 0;
  long steps = 0;
  /// Empty: measured. Otherwise the text of the cell: "over 5 s", "over 1 GiB", "not built", or the
  /// failure.
  std::string instead;
  bool failed = false;                           ///< `instead` is a failure
  std::vector<double> seconds, rollout_seconds;  ///< CPU time of each repeat
  size_t peak_bytes = 0;                         ///< resident, of the process
  size_t tape_bytes = 0;                         ///< of the adjoint's records
  double runs_again = 0.0;                       ///< extra rollouts of the adjoint
  double difference = 0.0;  ///< from the adjoint's gradient, see GradientDifference

  bool measured() const { return instead.empty(); }
  /// Least time as a multiple of the least of a rollout; and the same of medians.
  double ratio() const;
  double median_ratio() const;
};

/// Fills all cells, in the order of steps, methods, parameters. Where one is over its budget, those
/// with more parameters are over it too and are not run.
std::vector<CostCell> RunCosts(const CostOptions& options,
                               const std::function<void(long done)>& progress);
long NumCells(const CostOptions& options);

/// One cell; `reference`: the adjoint's gradient, empty if there is none; `gradient` gets the
/// cell's.
CostCell MeasureCell(const CostOptions& options, CostMethod method, int parameters, long steps,
                     const std::vector<double>& reference, std::vector<double>* gradient);

/// The largest |a − b| over the largest |b|, both times the parameters' scales; infinite where a
/// number is not finite.
double GradientDifference(const std::vector<double>& a, const std::vector<double>& b,
                          const std::vector<double>& scales);

/// The widest Jet that was built, 0 for none.
int WidestJetBuilt();

double Least(const std::vector<double>& values);

}  // namespace tangible::cost
