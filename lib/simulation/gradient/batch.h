// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Batches: rollouts of one scene for many vectors of parameters, on several threads.
//
//   row r   p = values(r, :)  →  final state x(p),   and on request dx/dp, or ℓ(x) and dℓ/dp
//
// Rows are rollouts of one function (rollout_function.h). Each row is computed separately, so that
// its bits depend neither on the number of threads nor on the other rows, and are those of a single
// run. A row that fails reports why and does not stop the others.

#include <functional>
#include <string>
#include <vector>

#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

enum class BatchDerivative {
  kNone,
  kTangent,  ///< a column for each parameter
  kAdjoint,  ///< a column for each output; one for a loss
  kAuto,     ///< tangent or adjoint, by MethodOf of gradient.h
};

struct BatchOptions {
  int threads = 0;  ///< 0: one for each core; at most one for each row is used
  BatchDerivative derivative = BatchDerivative::kNone;
  /// If not empty: ℓ = Σ weight (output − target)², and its gradient instead of the Jacobian.
  std::vector<LossTerm> loss{};
};

struct BatchRow {
  RolloutStatus status = RolloutStatus::kDone;
  std::string message;   ///< empty unless it failed: when, where, what
  RolloutReport report;  ///< of the run
  State<double> final;   ///< the last good state; that of the start where nothing was run
  /// For a completed row: warnings about joints, coordinates and energy (run_warnings.h).
  std::vector<std::string> warnings;
  RowMatrixXd jacobian;  ///< outputs (OutputNames) x parameters; empty unless asked for and done
  double loss = std::numeric_limits<double>::quiet_NaN();
  VectorX<double> gradient;  ///< of the loss, by parameter; empty unless asked for and done
};

struct BatchResult {
  BatchDerivative derivative = BatchDerivative::kNone;  ///< that was computed: never kAuto
  /// Empty, or one line about an error that concerns all rows, of which none was run: settings that
  /// the engine does not support, a number that two parameters set, an output that does not exist,
  /// a wrong number of columns.
  std::string message;
  std::vector<BatchRow> rows;
};

/// Runs all rows of `values` (rows x parameters). `progress` is called with the number of rows
/// done, by one thread at a time.
BatchResult RunBatch(const Scene& scene, const std::vector<ParameterPath>& parameters,
                     const RowMatrixXd& values, const BatchOptions& options,
                     const std::function<void(long done)>& progress = {});

}  // namespace tangible
