// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/fit/evaluation_log.h"

#include <cstring>
#include <utility>

namespace tangible {
namespace {

bool SameBits(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<size_t>(a.size())) == 0;
}

long NumNumbers(const Evaluation& evaluation) {
  return static_cast<long>(evaluation.at.size() + evaluation.residuals.size() +
                           evaluation.jacobian.size());
}

}  // namespace

bool EvaluationLog::Evaluate(const Eigen::VectorXd& at, const Function& function,
                             Eigen::VectorXd* residuals, RowMatrixXd* jacobian, long* rollouts,
                             std::string* message) {
  if (next_ < evaluations_.size()) {
    const Evaluation& known = evaluations_[next_++];
    if (known.with_jacobian != (jacobian != nullptr) || !SameBits(known.at, at)) {
      mismatch_ = static_cast<long>(next_);
      throw EvaluationMismatch();
    }
    *rollouts += known.rollouts;
    *message = known.message;
    if (known.done) {
      *residuals = known.residuals;
      if (jacobian != nullptr) {
        *jacobian = known.jacobian;
      }
    }
    return known.done;
  }
  Evaluation evaluation;
  const long before = *rollouts;
  const bool done =
      function(&evaluation.residuals, jacobian == nullptr ? nullptr : &evaluation.jacobian);
  if (done) {
    *residuals = evaluation.residuals;
    if (jacobian != nullptr) {
      *jacobian = evaluation.jacobian;
    }
  } else {
    // The partial result of a failed evaluation is not used.
    evaluation.residuals.resize(0);
    evaluation.jacobian.resize(0, 0);
  }
  evaluation.at = at;
  full_ = full_ || num_numbers_ + NumNumbers(evaluation) > kMaxNumbers;
  if (full_) {
    return done;
  }
  evaluation.with_jacobian = jacobian != nullptr;
  evaluation.done = done;
  evaluation.message = *message;
  evaluation.rollouts = *rollouts - before;
  num_numbers_ += NumNumbers(evaluation);
  evaluations_.push_back(std::move(evaluation));
  next_ = evaluations_.size();
  if (jacobian != nullptr && on_iteration_) {
    on_iteration_();
  }
  return done;
}

void EvaluationLog::Restore(std::vector<Evaluation> evaluations) {
  evaluations_ = std::move(evaluations);
  next_ = 0;
  num_numbers_ = 0;
  for (const Evaluation& evaluation : evaluations_) {
    num_numbers_ += NumNumbers(evaluation);
  }
  full_ = false;
}

}  // namespace tangible
