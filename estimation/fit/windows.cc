// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/windows.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "tangible/estimation/fit/linearisation.h"
#include "tangible/estimation/fit/minimise.h"
#include "tangible/estimation/fit/tolerances.h"
#include "tangible/estimation/problem/problem_with_priors.h"
#include "tangible/estimation/uncertainty/residual_quality.h"

namespace tangible {
namespace {

// A window only has to lead to the next one, which limits its iterations.
constexpr int kIterationsPerWindow = 100;

long NumRows(const LeastSquaresProblem& problem) {
  long rows = 0;
  for (int block = 0; block < problem.num_blocks(); ++block) {
    rows += problem.num_observation_rows(block);
  }
  return rows;
}

/// Root mean square of a problem's observations at p, in sigma; infinite where a run fails.
double RmsAt(const FitOptions& options, const Eigen::VectorXd& p, LeastSquaresProblem* problem) {
  Linearizer linearizer(problem, options.derivatives, options.threads, nullptr);
  std::vector<BlockEvaluation> blocks;
  return linearizer.Rows(p, BlockDerivatives::kSkip, &blocks)
             ? JudgeResiduals(*problem, blocks, 0).residual_rms
             : HUGE_VAL;
}

/// The state of growing windows.
class Windows {
 public:
  Windows(const FitOptions& options, const Eigen::VectorXd& start, LeastSquaresProblem* problem,
          EvaluationLog* log)
      : options_(options), problem_(problem), log_(log), result_{start} {
    options_.max_iterations = kIterationsPerWindow;
  }

  FitApproachResult Run() {
    const long all = NumRows(*problem_);
    const auto enough = static_cast<long>(problem_->entries().size());
    std::unique_ptr<LeastSquaresProblem> window = problem_->Window(part_);
    while (window != nullptr && part_ < 1.0) {
      const long rows = NumRows(*window);
      if (rows >= enough && rows < all && !MinimiseIn(window.get())) {
        return result_;
      }
      window = Next(rows);
    }
    return result_;
  }

 private:
  /// Parameters that a window does not determine must not drift: each has a prior around its
  /// estimate from the last window, unless it has a prior of its own.
  std::vector<std::optional<Prior>> Anchors() const {
    const std::vector<ParameterEntry>& entries = problem_->entries();
    std::vector<std::optional<Prior>> anchors(entries.size());
    for (size_t k = 0; k < entries.size(); ++k) {
      if (!entries[k].prior) {
        anchors[k] = {entries[k].logarithmic ? PriorKind::kLogNormal : PriorKind::kGaussian,
                      result_.parameters[static_cast<Eigen::Index>(k)],
                      kWindowPrior * (entries[k].logarithmic ? 1.0 : entries[k].scale)};
      }
    }
    return anchors;
  }

  bool MinimiseIn(LeastSquaresProblem* observations) {
    ProblemWithPriors anchored(observations, Anchors(), {});
    LeastSquaresProblem* const window = &anchored;
    const Minimum minimum = Minimise(
        options_, result_.parameters, [] { return 0.0; }, {}, window, log_);
    result_.rollouts += minimum.rollouts;
    if (minimum.status == FitStatus::kFailed) {
      return false;
    }
    result_.parameters = minimum.parameters;
    result_.iterations += std::max(0, static_cast<int>(minimum.iterations.size()) - 1);
    return true;
  }

  /// The window after one with the given number of rows.
  std::unique_ptr<LeastSquaresProblem> Next(long rows) {
    const double allowed =
        kFarOff * std::max(1.0, RmsAt(options_, result_.parameters, problem_->Window(part_).get()));
    std::unique_ptr<LeastSquaresProblem> next;
    double grown = part_;
    for (const double growth : kWindowGrowth) {
      grown = part_ * growth;
      next = problem_->Window(std::min(1.0, grown));
      if (NumRows(*next) == rows || RmsAt(options_, result_.parameters, next.get()) <= allowed) {
        break;
      }
    }
    part_ = grown;
    return next;
  }

  FitOptions options_;
  LeastSquaresProblem* problem_;
  EvaluationLog* log_;
  FitApproachResult result_;
  double part_ = kFirstPart;
};

}  // namespace

FitApproachResult GrowWindows(const FitOptions& options, const Eigen::VectorXd& start,
                              LeastSquaresProblem* problem, EvaluationLog* log) {
  return Windows(options, start, problem, log).Run();
}

}  // namespace tangible
