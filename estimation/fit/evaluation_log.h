// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The evaluations of a fit in their order, so that an interrupted fit can repeat them without the
// runs.
//
// A minimiser's state (its trust region, the points tried) cannot be set from outside, but it
// follows from the evaluations alone: given the same residuals and Jacobians, bit for bit, it
// evaluates the same points in the same order. Therefore the evaluations are kept, and a fit that
// starts again reads them one after the other; after the last one it continues to compute. The
// result is that of a fit that was never interrupted, bit for bit.

#include <Eigen/Core>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tangible/math/scalar.h"

namespace tangible {

/// Thrown through the minimiser, which would otherwise try other points: the log belongs to another
/// fit.
struct EvaluationMismatch : std::runtime_error {
  EvaluationMismatch() : std::runtime_error("the checkpoint is of another fit") {}
};

/// The point of an evaluation and its result.
struct Evaluation {
  Eigen::VectorXd at;
  bool with_jacobian = false;
  bool done = false;
  std::string message;  ///< why it failed
  long rollouts = 0;    ///< number of runs
  Eigen::VectorXd residuals;
  RowMatrixXd jacobian;
};

class EvaluationLog {
 public:
  /// Maximum number of values that a log keeps: 64 MB, or 128 MB of text. Further evaluations are
  /// not kept.
  static constexpr long kMaxNumbers = 8'000'000;

  using Function = std::function<bool(Eigen::VectorXd* residuals, RowMatrixXd* jacobian)>;

  /// Returns the next evaluation of the log, which must be at this point, or else evaluates
  /// `function` and keeps the result. `jacobian` may be null; `rollouts` is increased by the runs,
  /// `message` says why false is returned. Throws EvaluationMismatch.
  bool Evaluate(const Eigen::VectorXd& at, const Function& function, Eigen::VectorXd* residuals,
                RowMatrixXd* jacobian, long* rollouts, std::string* message);

  /// If not 0, this evaluation, counted from 1, was at another point than that in the log.
  long mismatch() const { return mismatch_; }

  const std::vector<Evaluation>& evaluations() const { return evaluations_; }
  /// Replays these evaluations, beginning with the first.
  void Restore(std::vector<Evaluation> evaluations);
  void Clear() { Restore({}); }

  /// Sets a function that is called after each kept evaluation with a Jacobian, that is, after each
  /// accepted iteration.
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
