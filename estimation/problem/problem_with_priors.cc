// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/problem_with_priors.h"

#include <cmath>
#include <utility>

namespace tangible {
namespace {

std::vector<std::optional<Prior>> PriorsOf(const std::vector<ParameterEntry>& entries) {
  std::vector<std::optional<Prior>> priors;
  priors.reserve(entries.size());
  for (const ParameterEntry& entry : entries) {
    priors.push_back(entry.prior);
  }
  return priors;
}

}  // namespace

ProblemWithPriors::ProblemWithPriors(LeastSquaresProblem* problem,
                                     std::vector<RandomEffect> effects)
    : ProblemWithPriors(problem, PriorsOf(problem->entries()), std::move(effects)) {}

ProblemWithPriors::ProblemWithPriors(LeastSquaresProblem* problem,
                                     const std::vector<std::optional<Prior>>& priors,
                                     std::vector<RandomEffect> effects)
    : problem_(problem), effects_(std::move(effects)), own_(problem->num_blocks()) {
  const BlockLayout layout(*problem);
  for (int k = 0; k < layout.num_shared(); ++k) {
    if (priors[k]) {
      shared_.push_back({k, -1, -1, *priors[k]});
    }
  }
  for (int block = 0; block < layout.num_blocks(); ++block) {
    for (int i = layout.num_shared(); i < layout.num_local(block); ++i) {
      const int k = layout.ParameterOf(block, i);
      if (priors[k]) {
        own_[block].push_back({i, -1, -1, *priors[k]});
      }
      for (size_t e = 0; e < effects_.size(); ++e) {
        if (effects_[e].own[block] == k) {
          own_[block].push_back({i, effects_[e].mean, static_cast<int>(e), {effects_[e].kind}});
        }
      }
    }
  }
}

bool ProblemWithPriors::HasRows() const {
  bool any = !shared_.empty();
  for (const std::vector<PriorRow>& rows : own_) {
    any = any || !rows.empty();
  }
  return any;
}

int ProblemWithPriors::num_own(int block) const {
  return IsOfPriors(block) ? 0 : problem_->num_own(block);
}

int ProblemWithPriors::num_rows(int block) const {
  const int rows = static_cast<int>(RowsOf(block).size());
  return IsOfPriors(block) ? rows : problem_->num_rows(block) + rows;
}

int ProblemWithPriors::num_observation_rows(int block) const {
  return IsOfPriors(block) ? 0 : problem_->num_observation_rows(block);
}

int ProblemWithPriors::num_noise_rows(int block) const {
  return IsOfPriors(block) ? 0 : problem_->num_noise_rows(block);
}

int ProblemWithPriors::num_slope_rows(int block) const {
  return IsOfPriors(block) ? 0 : problem_->num_slope_rows(block);
}

double ProblemWithPriors::weight(int block) const {
  return IsOfPriors(block) ? 1.0 : problem_->weight(block);
}

std::vector<RowPlace> ProblemWithPriors::Places(int block) const {
  return IsOfPriors(block) ? std::vector<RowPlace>() : problem_->Places(block);
}

std::string ProblemWithPriors::BlockName(int block) const {
  return IsOfPriors(block) ? "priors: " : problem_->BlockName(block);
}

HeldColumns ProblemWithPriors::EvaluateHeld(int block, const Eigen::VectorXd& p,
                                            GradientMethod method, int most) {
  return IsOfPriors(block) ? HeldColumns() : problem_->EvaluateHeld(block, p, method, most);
}

std::unique_ptr<LeastSquaresProblem> ProblemWithPriors::Window(double part) const {
  std::unique_ptr<LeastSquaresProblem> window = problem_->Window(part);
  if (window == nullptr) {
    return nullptr;
  }
  auto with_priors = std::make_unique<ProblemWithPriors>(window.get(), effects_);
  with_priors->owned_ = std::move(window);
  return with_priors;
}

std::unique_ptr<LeastSquaresProblem> ProblemWithPriors::Released(const std::string& path) const {
  std::unique_ptr<LeastSquaresProblem> released = problem_->Released(path);
  if (released == nullptr) {
    return nullptr;
  }
  std::vector<RandomEffect> effects = effects_;
  for (RandomEffect& effect : effects) {  // own parameters follow the shared ones
    for (int& own : effect.own) {
      own += own < 0 ? 0 : 1;
    }
  }
  auto with_priors = std::make_unique<ProblemWithPriors>(released.get(), std::move(effects));
  with_priors->owned_ = std::move(released);
  return with_priors;
}

PriorResidual ProblemWithPriors::Evaluate(const PriorRow& row, const Eigen::VectorXd& p,
                                          PriorResidual* by_mean) const {
  *by_mean = {};
  if (row.mean < 0) {
    return EvaluatePrior(row.prior, p[row.parameter]);
  }
  Prior prior = row.prior;
  prior.center = p[row.mean];
  prior.sigma = effects_[row.effect].spread;
  // r depends on θ − μ, or on ln θ − ln μ: the derivative with respect to μ is the negative of that
  // with respect to θ at θ = μ.
  by_mean->derivative = -EvaluatePrior(prior, prior.center).derivative;
  return EvaluatePrior(prior, p[row.parameter]);
}

bool ProblemWithPriors::EvaluateBlock(int block, const Eigen::VectorXd& p, GradientMethod method,
                                      BlockDerivatives derivatives, BlockEvaluation* evaluation) {
  *evaluation = BlockEvaluation();
  if (!IsOfPriors(block) && !problem_->EvaluateBlock(block, p, method, derivatives, evaluation)) {
    return false;
  }
  const std::vector<PriorRow>& rows = RowsOf(block);
  if (rows.empty()) {
    return true;
  }
  const Eigen::Index first = evaluation->residuals.size();
  const Eigen::Index count = first + static_cast<Eigen::Index>(rows.size());
  evaluation->residuals.conservativeResize(count);
  const bool with_jacobian = derivatives == BlockDerivatives::kCompute;
  if (with_jacobian) {
    evaluation->jacobian.conservativeResize(count, p.size());
    evaluation->jacobian.bottomRows(count - first).setZero();
  }
  // Rows of priors have no weight: they are divided by the root of the block's weight.
  const double root = std::sqrt(1.0 / weight(block));
  for (size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Index at = first + static_cast<Eigen::Index>(i);
    PriorResidual by_mean;
    const PriorResidual row = Evaluate(rows[i], p, &by_mean);
    if (!std::isfinite(row.residual) || !std::isfinite(row.derivative)) {
      evaluation->message = "a log-normal prior of a value that is not positive";
      return false;
    }
    evaluation->residuals[at] = root * row.residual;
    if (with_jacobian) {
      evaluation->jacobian(at, rows[i].parameter) = root * row.derivative;
      if (rows[i].mean >= 0) {
        evaluation->jacobian(at, rows[i].mean) = root * by_mean.derivative;
      }
    }
  }
  return true;
}

}  // namespace tangible
