// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/sampled_surrogate.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tangible/control/ilqr.h"
#include "tangible/math/random.h"

namespace tangible {

VectorX<double> ControlSizes(const ControlProblem& problem, const RowMatrixXd& controls) {
  VectorX<double> sizes = problem.high - problem.low;
  for (Eigen::Index i = 0; i < sizes.size(); ++i) {
    if (!std::isfinite(sizes[i])) {
      sizes[i] = std::max(1.0, controls.col(i).cwiseAbs().maxCoeff());
    }
  }
  return sizes;
}

std::string CheckSurrogate(const ControlProblem& problem) {
  for (Eigen::Index i = 0; i < problem.low.size(); ++i) {
    if (std::isfinite(problem.low[i]) && std::isfinite(problem.high[i])) continue;
    return "bounds of control " + std::to_string(i) +
           ": expected finite ones, of whose range a surrogate's deviation is a share, got none";
  }
  return "";
}

void AverageJacobians(const ControlProblem& problem, const Plan& plan,
                      const SampledSurrogate& options, std::vector<MatrixX<double>>* a,
                      std::vector<MatrixX<double>>* b) {
  const long steps = plan.controls.rows();
  const VectorX<double> scale = options.deviation * ControlSizes(problem, plan.controls);
  std::vector<MatrixX<double>> sum_a(steps), sum_b(steps);
  std::vector<int> counts(steps, 0);
  std::mt19937_64 random = Generator(options.seed, 0);
  VectorX<double> offset(scale.size()), next;
  MatrixX<double> one_a, one_b;
  std::string error;
  for (int s = 0; s < options.samples; ++s) {
    if (s % 2 == 0) {
      for (Eigen::Index i = 0; i < offset.size(); ++i) offset[i] = scale[i] * Normal(&random);
    } else {
      offset = -offset;
    }
    VectorX<double> x = plan.states.row(0);
    for (long k = 0; k < steps; ++k) {
      const VectorX<double> u =
          (plan.controls.row(k).transpose() + offset).cwiseMax(problem.low).cwiseMin(problem.high);
      if (!problem.map->Linearise(problem.first_step + k, x, u, &next, &one_a, &one_b, &error)) {
        break;
      }
      sum_a[k] = counts[k] == 0 ? one_a : MatrixX<double>(sum_a[k] + one_a);
      sum_b[k] = counts[k] == 0 ? one_b : MatrixX<double>(sum_b[k] + one_b);
      ++counts[k];
      x = next;
    }
  }
  for (long k = 0; k < steps; ++k) {
    if (counts[k] == 0) continue;
    (*a)[k] = sum_a[k] / counts[k];
    (*b)[k] = sum_b[k] / counts[k];
  }
}

}  // namespace tangible
