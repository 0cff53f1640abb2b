// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/nnls.h"

#include <vector>

#include "tangible/lcp/dense/tolerances.h"
#include "tangible/math/decompositions.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The least-squares solution on the passive columns, zero elsewhere.
VectorXd SolvePassive(const MatrixXd& E, const VectorXd& f, const std::vector<char>& passive) {
  std::vector<Index> columns;
  for (Index j = 0; j < E.cols(); ++j) {
    if (passive[j]) columns.push_back(j);
  }
  VectorXd x = VectorXd::Zero(E.cols());
  if (columns.empty()) return x;
  const VectorXd solution = PivotedQr(E(Eigen::all, columns)).Solve(f);
  for (std::size_t k = 0; k < columns.size(); ++k) x[columns[k]] = solution[k];
  return x;
}

}  // namespace

NnlsResult SolveNnls(const MatrixXd& E, const VectorXd& f, Index num_free) {
  const Index n = E.cols();
  const double tolerance = kNnlsGradient * (E.norm() * f.norm());
  std::vector<char> passive(n, 0);
  for (Index j = 0; j < num_free; ++j) passive[j] = 1;
  NnlsResult result;
  result.x = SolvePassive(E, f, passive);
  result.residual = f - E * result.x;
  Index last_entered = -1;
  for (Index exchange = 0; exchange < 3 * n + 20; ++exchange) {
    const VectorXd gradient = E.transpose() * result.residual;
    Index entering = -1;
    for (Index j = num_free; j < n; ++j) {
      // A column that rounding has just removed again must not re-enter at once.
      if (passive[j] || j == last_entered || gradient[j] <= tolerance) continue;
      if (entering < 0 || gradient[j] > gradient[entering]) entering = j;
    }
    if (entering < 0) {
      result.converged = true;
      return result;
    }
    passive[entering] = 1;
    last_entered = -1;
    for (Index inner = 0; inner <= n; ++inner) {
      const VectorXd target = SolvePassive(E, f, passive);
      double step = 1.0;
      Index leaving = -1;
      for (Index j = num_free; j < n; ++j) {
        if (!passive[j] || target[j] > 0.0) continue;
        const double candidate = result.x[j] / (result.x[j] - target[j]);
        if (leaving < 0 || candidate < step) {
          step = result.x[j] > 0.0 ? candidate : 0.0;
          leaving = j;
        }
      }
      result.x += step * (target - result.x);
      if (leaving < 0) break;
      passive[leaving] = 0;
      result.x[leaving] = 0.0;
      if (leaving == entering) last_entered = entering;
    }
    result.residual = f - E * result.x;
  }
  return result;
}

}  // namespace tangible
