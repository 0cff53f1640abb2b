// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A least-squares problem and its linear model at a point, block by block in constant memory.
//
// The minimiser moves in q (parameter_entry.h). In it a block has residuals r and the Jacobian [A
// B], A of its own parameters and B of the shared ones. The robust loss ρ and the weight w of the
// block scale row i by sqrt(w ρ'_i); the rest of the cost is a constant,
//
//   w/2 Σ ρ(r_i²) = 1/2 ‖r'‖² + 1/2 remainder²       r'_i = sqrt(w ρ'_i) r_i        (1)
//   [A' B' r'] = Q F                                  F triangular                   (2)
//   ‖A' x + B' y + r'‖ = ‖F [x; y; 1]‖                for all steps x, y             (3)
//
// so that F, with own + shared + 1 rows, replaces any number of rows without squaring their
// condition; it is computed from some rows at a time. For Newton's method on Huber's loss the
// factor of the rows within its bound, which are the only ones with curvature, is kept too.
//
// Blocks are evaluated on several threads and combined in their order, so that the result has the
// same bits for any number of threads. Evaluations go through the log of a checkpoint
// (evaluation_log.h), which keeps the factors and not the rows.

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "tangible/estimation/fit/evaluation_log.h"
#include "tangible/estimation/problem/least_squares.h"

namespace tangible {

/// The factors that replace the rows of a block.
struct BlockFactor {
  RowMatrixXd factor;      ///< F; at most own + shared + 1 rows, as many columns
  RowMatrixXd curved;      ///< of [A B] of the rows that have curvature; with plain squares empty
  double remainder = 0.0;  ///< ≥ 0, of (1)

  Eigen::Index num_local() const { return factor.cols() - 1; }
  auto jacobian() const { return factor.leftCols(num_local()); }
  auto residuals() const { return factor.col(num_local()); }
};

struct Linearisation {
  double cost = 0.0;         ///< robust
  Eigen::VectorXd gradient;  ///< ∂cost/∂q, of all parameters
  std::vector<BlockFactor> blocks;
};

/// b of Huber's loss; 0 means plain squares. `target` is that of the fit, `current` that which the
/// iteration minimises; the cost and its gradient are computed for the target too.
struct HuberBounds {
  double current = 0.0;
  double target = 0.0;
};

/// ρ'(r²): 1, or b / |r| where Huber's loss is linear.
double RobustWeight(double residual, double huber);
/// 1/2 Σ ρ(r²).
double RobustCost(const Eigen::VectorXd& residuals, double huber);

/// F of a block from its evaluation, with `q_scale` = dp/dq of [shared | own].
BlockFactor Reduce(const BlockEvaluation& evaluation, const Eigen::VectorXd& q_scale, int num_own,
                   int num_observation_rows, double weight, double huber);

/// Calls `function` with 0 .. count − 1 on the given number of threads (0: one for each core). An
/// exception ends the work and is passed on.
void ForEachOnThreads(int threads, int count, const std::function<void(int)>& function);

/// Evaluates a problem at points q.
class Linearizer {
 public:
  /// `log` may be null. The problem and the log must outlive this object.
  Linearizer(LeastSquaresProblem* problem, GradientMethod method, int threads, EvaluationLog* log);

  const BlockLayout& layout() const { return layout_; }
  const std::vector<ParameterEntry>& entries() const { return problem_->entries(); }
  LeastSquaresProblem* problem() const { return problem_; }
  /// The number of runs in all evaluations so far.
  long rollouts() const { return rollouts_; }

  /// The rows of all blocks at p. False, with a message, where one fails.
  bool Rows(const Eigen::VectorXd& p, BlockDerivatives derivatives,
            std::vector<BlockEvaluation>* blocks);

  /// The cost of each block at q for `huber.current`, and of the whole for the target.
  bool Cost(const Eigen::VectorXd& q, const HuberBounds& huber, Eigen::VectorXd* current,
            double* target);
  /// The linear model for `huber.current`; `target` has cost and gradient of the fit's own loss,
  /// without factors.
  bool Linearise(const Eigen::VectorXd& q, const HuberBounds& huber, Linearisation* current,
                 Linearisation* target);
  const std::string& message() const { return message_; }

 private:
  bool Compute(const Eigen::VectorXd& q, const HuberBounds& huber, BlockDerivatives derivatives,
               Eigen::VectorXd* numbers);
  Eigen::VectorXd Numbers(int block, const BlockEvaluation& evaluation,
                          const Eigen::VectorXd& q_scale, const HuberBounds& huber,
                          BlockDerivatives derivatives) const;
  bool Logged(const Eigen::VectorXd& q, const HuberBounds& huber, BlockDerivatives derivatives,
              Eigen::VectorXd* numbers);
  /// What is made of the blocks' evaluations, and its numbers to and from other processes.
  struct BlockUse {
    std::function<void(int block, BlockEvaluation*)> take;
    std::function<Eigen::VectorXd(int block)> numbers;
    std::function<void(int block, const Eigen::VectorXd& numbers)> set;
  };
  /// Of the blocks, in their order; false and the message of the first that failed. Processes that
  /// run in step divide the blocks (math/shared_work.h).
  bool EvaluateBlocks(const Eigen::VectorXd& p, BlockDerivatives derivatives, const BlockUse& use);

  LeastSquaresProblem* problem_;
  BlockLayout layout_;
  GradientMethod method_;
  int threads_;
  EvaluationLog* log_;
  long rollouts_ = 0;
  std::string message_;
};

}  // namespace tangible
