// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A least-squares problem with rows for prior knowledge about its parameters (prior.h) and for
// parameters that vary from recording to recording around a shared value:
//
//   r = (θ_b − μ) / τ        or (ln θ_b − ln μ) / τ           for each block b
//
// θ_b is an own parameter of block b, μ a shared one, τ the spread. The rows of own parameters
// follow the observations of their block; those of shared parameters form a separate block, the
// last.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tangible/estimation/problem/least_squares.h"

namespace tangible {

/// A parameter that varies from block to block.
struct RandomEffect {
  std::string name;
  PriorKind kind = PriorKind::kGaussian;
  int mean = -1;         ///< index of μ among the shared parameters
  std::vector<int> own;  ///< of each block the index of θ_b in p; −1: that block has none
  double spread = 1.0;   ///< τ > 0; in the parameter's unit, or of ln θ
};

class ProblemWithPriors : public LeastSquaresProblem {
 public:
  /// `priors` has an optional prior for each of the problem's entries; `problem` must outlive this
  /// object.
  ProblemWithPriors(LeastSquaresProblem* problem, const std::vector<std::optional<Prior>>& priors,
                    std::vector<RandomEffect> effects);
  /// Takes the priors of the problem's entries.
  ProblemWithPriors(LeastSquaresProblem* problem, std::vector<RandomEffect> effects);

  /// Whether there is any row that `problem` does not have.
  bool HasRows() const;

  const std::vector<RandomEffect>& effects() const { return effects_; }
  void SetSpread(int effect, double spread) { effects_[effect].spread = spread; }

  const std::vector<ParameterEntry>& entries() const override { return problem_->entries(); }
  int num_shared() const override { return problem_->num_shared(); }
  int num_blocks() const override { return problem_->num_blocks() + (shared_.empty() ? 0 : 1); }
  int num_own(int block) const override;
  int num_rows(int block) const override;
  int num_observation_rows(int block) const override;
  int num_noise_rows(int block) const override;
  int num_slope_rows(int block) const override;
  void SetHuber(double huber) override { problem_->SetHuber(huber); }
  double weight(int block) const override;
  std::vector<RowPlace> Places(int block) const override;
  bool EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                     BlockDerivatives derivatives, BlockEvaluation* evaluation) override;
  std::optional<Certificate> Certify(const Eigen::VectorXd& p) override {
    return problem_->Certify(p);
  }
  void AddRadii(const Eigen::VectorXd& p, Certificate* certificate) override {
    problem_->AddRadii(p, certificate);
  }
  HeldColumns EvaluateHeld(int block, const Eigen::VectorXd& p, GradientMethod method,
                           int most) override;
  std::vector<std::string> FindInconsistencies(const Eigen::VectorXd& p) override {
    return problem_->FindInconsistencies(p);
  }
  std::unique_ptr<LeastSquaresProblem> Window(double part) const override;
  std::unique_ptr<LeastSquaresProblem> Released(const std::string& path) const override;
  std::string BlockName(int block) const override;

 private:
  /// A row in the local parameters [shared | own] of its block.
  struct PriorRow {
    int parameter;
    int mean;    ///< local index of μ; −1: the prior's own center
    int effect;  ///< −1: none
    Prior prior;
  };
  PriorResidual Evaluate(const PriorRow& row, const Eigen::VectorXd& p,
                         PriorResidual* by_mean) const;
  bool IsOfPriors(int block) const { return block == problem_->num_blocks(); }
  const std::vector<PriorRow>& RowsOf(int block) const {
    return IsOfPriors(block) ? shared_ : own_[block];
  }

  LeastSquaresProblem* problem_;
  std::unique_ptr<LeastSquaresProblem> owned_;  ///< the problem of a window, if this is one
  std::vector<RandomEffect> effects_;
  std::vector<std::vector<PriorRow>> own_;  ///< of each block of `problem`
  std::vector<PriorRow> shared_;
};

}  // namespace tangible
