// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The evaluations of a fit in their order, so that one that was interrupted walks the same way
// again without the runs.
//
// A minimiser's state (its trust region, what it has tried) cannot be set from outside, but it
// follows from the evaluations alone: given the same residuals and Jacobians, bit for bit, it asks
// for the same points in the same order. So they are kept, and a fit that starts again is handed
// them one after the other; where they end it computes on. The result is that of a fit that was
// never interrupted, to the last bit.

#include <Eigen/Core>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

/// Thrown through the minimiser, which would otherwise try other points: the log is of another fit.
struct EvaluationMismatch : std::runtime_error {
  EvaluationMismatch() : std::runtime_error("the checkpoint is of another fit") {}
};

/// What was asked for and what it gave.
struct Evaluation {
  Eigen::VectorXd at;
  bool with_jacobian = false;
  bool done = false;
  std::string message;  ///< why not done
  long rollouts = 0;    ///< runs that it took
  Eigen::VectorXd residuals;
  RowMatrixXd jacobian;
};

class EvaluationLog {
 public:
  /// Numbers that a log keeps at most: 64 MB, or 128 MB of text. Evaluations beyond are not kept.
  static constexpr long kMaxNumbers = 8'000'000;

  using Function = std::function<bool(Eigen::VectorXd* residuals, RowMatrixXd* jacobian)>;

  /// The next evaluation of the log, which must be at this point, or else that of `function`, which
  /// is kept. `jacobian` may be null; `rollouts` counts, `message` says why false is returned.
  /// Throws EvaluationMismatch.
  bool Evaluate(const Eigen::VectorXd& at, const Function& function, Eigen::VectorXd* residuals,
                RowMatrixXd* jacobian, long* rollouts, std::string* message);

  /// Not 0: this evaluation, counted from 1, was at another point than the log's.
  long mismatch() const { return mismatch_; }

  const std::vector<Evaluation>& evaluations() const { return evaluations_; }
  /// Hands these out from the first on.
  void Restore(std::vector<Evaluation> evaluations);
  void Clear() { Restore({}); }

  /// Called after each evaluation with a Jacobian that is kept: an iteration was accepted.
  void OnIteration(std::function<void()> function) { on_iteration_ = std::move(function); }

 private:
  std::vector<Evaluation> evaluations_;
  size_t next_ = 0;
  long num_numbers_ = 0;
  bool full_ = false;
  long mismatch_ = 0;
  std::function<void()> on_iteration_;
};

}  // namespace tangible
