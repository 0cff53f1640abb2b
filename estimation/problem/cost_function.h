// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Residuals as Ceres cost functions.
//
// Ceres applies a loss function to a residual block as a whole, so that each measured coordinate is
// a block of its own. Before it evaluates the blocks, Ceres calls SharedEvaluation, which makes the
// single run from which all blocks read. The only parameter block is the vector of all unknowns.

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <functional>
#include <utility>

#include "tangible/math/scalar.h"

namespace tangible {

/// Residuals at x and, unless `jacobian` is null, their derivatives with respect to x; false where
/// they cannot be computed.
using ResidualFunction = std::function<bool(const Eigen::VectorXd& x, Eigen::VectorXd* residuals,
                                            RowMatrixXd* jacobian)>;

class SharedEvaluation : public ceres::EvaluationCallback {
 public:
  /// The parameter block is x->data(), which must outlive this object.
  SharedEvaluation(ResidualFunction function, const Eigen::VectorXd* x)
      : function_(std::move(function)), x_(x) {}

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;

  /// Whether the run at x succeeded.
  bool ok() const { return ok_; }
  const Eigen::VectorXd& values() const { return values_; }
  /// Valid after an evaluation with Jacobians.
  const RowMatrixXd& jacobian() const { return jacobian_; }

 private:
  ResidualFunction function_;
  const Eigen::VectorXd* x_;
  Eigen::VectorXd evaluated_;
  Eigen::VectorXd values_;
  RowMatrixXd jacobian_;
  bool ok_ = false;
  bool has_jacobian_ = false;
};

/// Residual i of the shared evaluation; false where that failed, so that the minimiser shortens its
/// step.
class CoordinateCostFunction : public ceres::CostFunction {
 public:
  CoordinateCostFunction(const SharedEvaluation* shared, int i, int num_unknowns);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  const SharedEvaluation* shared_;
  int i_;
};

}  // namespace tangible
