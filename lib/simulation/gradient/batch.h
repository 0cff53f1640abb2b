// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Batches: rollouts of one scene for many vectors of parameters, on several threads.
//
//   row r   p = values(r, :)  →  final state x(p),   and on request dx/dp, or ℓ(x) and dℓ/dp
//
// Rows are rollouts of one function (rollout_function.h). A row is computed alone and stands at its
// place in the result, so its bits depend neither on the number of threads nor on the other rows,
// and are those of a single run. A row that fails says why and stops no other.

#include <functional>
#include <string>
#include <vector>

#include "tangible/simulation/gradient/rollout_function.h"

namespace tangible {

enum class BatchDerivative {
  kNone,
  kTangent,  ///< a column a parameter
  kAdjoint,  ///< a column an output; one for a loss
  kAuto,     ///< tangent or adjoint, by MethodOf of gradient.h
};

struct BatchOptions {
  int threads = 0;  ///< 0: one a core; at most one a row is used
  BatchDerivative derivative = BatchDerivative::kNone;
  /// Not empty: ℓ = Σ weight (output − target)², and its gradient in the place of the Jacobian.
  std::vector<LossTerm> loss{};
};

struct BatchRow {
  RolloutStatus status = RolloutStatus::kDone;
  std::string message;   ///< empty unless it failed: when, where, what
  RolloutReport report;  ///< of the run
  State<double> final;   ///< the last good state; that of the start where nothing was run
  /// Of a row that is done: what its end says of joints, coordinates, energy (run_warnings.h).
  std::vector<std::string> warnings;
  RowMatrixXd jacobian;  ///< outputs (OutputNames) x parameters; empty unless asked for and done
  double loss = std::numeric_limits<double>::quiet_NaN();
  VectorX<double> gradient;  ///< of the loss, a parameter; empty unless asked for and done
};

struct BatchResult {
  BatchDerivative derivative = BatchDerivative::kNone;  ///< that was computed: never kAuto
  /// Empty, or one line about what concerns all rows, of which none was run: settings that the
  /// engine lacks, a number that two parameters set, an output that is not there, a wrong number of
  /// columns.
  std::string message;
  std::vector<BatchRow> rows;
};

/// Runs all rows of `values` (rows x parameters). `progress` is called with the number of rows
/// done, by one thread at a time.
BatchResult RunBatch(const Scene& scene, const std::vector<ParameterPath>& parameters,
                     const RowMatrixXd& values, const BatchOptions& options,
                     const std::function<void(long done)>& progress = {});

}  // namespace tangible
