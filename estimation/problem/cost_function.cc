// SPDX-License-Identifier: Apache-2.0
#include "tangible/estimation/problem/cost_function.h"

#include <algorithm>

namespace tangible {

void SharedEvaluation::PrepareForEvaluation(bool evaluate_jacobians,
                                            bool /*new_evaluation_point*/) {
  // The line search of a bounded problem evaluates earlier points again, and calls them new.
  const bool same = evaluated_.size() == x_->size() && evaluated_ == *x_;
  if (same && (has_jacobian_ || !evaluate_jacobians || !ok_)) {
    return;
  }
  evaluated_ = *x_;
  ok_ = function_(*x_, &values_, evaluate_jacobians ? &jacobian_ : nullptr);
  has_jacobian_ = ok_ && evaluate_jacobians;
}

CoordinateCostFunction::CoordinateCostFunction(const SharedEvaluation* shared, int i,
                                               int num_unknowns)
    : shared_(shared), i_(i) {
  set_num_residuals(1);
  mutable_parameter_block_sizes()->push_back(num_unknowns);
}

bool CoordinateCostFunction::Evaluate(double const* const* /*parameters*/, double* residuals,
                                      double** jacobians) const {
  if (!shared_->ok()) {
    return false;
  }
  residuals[0] = shared_->values()[i_];
  if (jacobians != nullptr && jacobians[0] != nullptr) {
    const auto row = shared_->jacobian().row(i_);
    std::copy(row.data(), row.data() + row.size(), jacobians[0]);
  }
  return true;
}

}  // namespace tangible
