// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The profile of a parameter: the cost with the parameter held at a value and the others minimised,
//
//   c_k(v) = min { cost(p) : p_k = v },    interval = { v : c_k(v) − cost(p̂) ≤ rise }   (1)
//   rise = 1/2 z²,    z = 1.959964            where the model fits     (2)
//   rise = 1/2 (t_ν s_k / σ_k)²               where it does not        (3)
//
// (1) is the interval of the likelihood ratio. It needs no derivative by the parameter and holds
// through kinks, at bounds, and where the cost is flat on one side: then it has no end there. (3)
// scales the ratio by that of the robust deviation s_k (Student's t) to the one that trusts sigma,
// so that the interval is the robust one where the cost is a parabola.
//
// The values are those at 1, 2, 3, 5, 8, ... deviations in the minimiser's coordinate q, on both
// sides, each begun from the nearest one; they go on beyond the first end, as far as a finite bound
// or else some steps, so that further branches are found, if they are wider than the distance of
// two values. Ends between two values are bisected. A minimum that costs less than the estimate
// ends the search: the fit goes on from there.
//
// References: D. J. Venzon and S. H. Moolgavkar, Applied Statistics 37 (1988) 87 (intervals by
// profiles); J. T. Kent, Biometrika 69 (1982) 19 (the ratio where the model is wrong).

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tangible/estimation/fit/fit.h"

namespace tangible {

/// Why a profile is made that the options name.
inline constexpr char kAskedFor[] = "asked for";

/// A problem with one parameter held at a value; its parameters are the others.
class ProblemWithHeld : public LeastSquaresProblem {
 public:
  /// `problem` must outlive this object.
  ProblemWithHeld(int parameter, double value, LeastSquaresProblem* problem);

  /// All parameters from those that are left.
  Eigen::VectorXd All(const Eigen::VectorXd& left) const;
  /// Those that are left of all.
  Eigen::VectorXd Left(const Eigen::VectorXd& all) const;

  const std::vector<ParameterEntry>& entries() const override { return entries_; }
  int num_shared() const override;
  int num_blocks() const override { return problem_->num_blocks(); }
  int num_own(int block) const override;
  int num_rows(int block) const override { return problem_->num_rows(block); }
  int num_observation_rows(int block) const override {
    return problem_->num_observation_rows(block);
  }
  int num_noise_rows(int block) const override { return problem_->num_noise_rows(block); }
  int num_slope_rows(int block) const override { return problem_->num_slope_rows(block); }
  void SetHuber(double huber) override { problem_->SetHuber(huber); }
  double weight(int block) const override { return problem_->weight(block); }
  std::vector<RowPlace> Places(int block) const override { return problem_->Places(block); }
  bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override;
  std::string BlockName(int block) const override { return problem_->BlockName(block); }
  std::unique_ptr<LeastSquaresProblem> Window(double part) const override;

 private:
  /// Of a problem that it owns.
  ProblemWithHeld(int parameter, double value, std::unique_ptr<LeastSquaresProblem> problem);
  /// The held parameter's index in [shared | own] of a block; −1: it is another block's.
  int LocalIndex(int block) const;

  int parameter_;
  double value_;
  std::unique_ptr<LeastSquaresProblem> owned_;  ///< or null
  LeastSquaresProblem* problem_;
  BlockLayout layout_;
  std::vector<ParameterEntry> entries_;
};

/// The rise of the cost at the ends of the interval of parameter k, (2) or (3).
double ProfileRise(const Uncertainty& uncertainty, int parameter);

/// The profile of a parameter around a minimum of this cost. `better` becomes the lowest point
/// where one costs less than the estimate by more than rounding; else it is empty. `rollouts` grows
/// by the runs; a profile that needs more than `budget` ends without branches.
Profile MakeProfile(const FitOptions& options, const FitResult& result, int parameter, long budget,
                    LeastSquaresProblem* problem, Eigen::VectorXd* better, long* rollouts);

/// Which parameters need a profile, with the reason: those that `options` name, then, unless they
/// are skipped, the first few whose certificate names a kink, that are at a bound or whose interval
/// meets one, and across whose interval the cost is no parabola.
std::vector<std::pair<int, std::string>> NeedProfiles(const FitOptions& options,
                                                      const FitResult& result,
                                                      LeastSquaresProblem* problem, long* rollouts);

/// The intervals to be printed: the robust ones, or where these are missing those from sigma,
/// within the range of their parameters; of profiles where there are any.
std::vector<FinalInterval> FinalIntervals(const std::vector<ParameterEntry>& entries,
                                          const FitResult& result);

/// "1 to 2", "1 to unbounded above".
std::string Describe(const FinalInterval& interval);

}  // namespace tangible
