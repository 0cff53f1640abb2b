// SPDX-License-Identifier: Apache-2.0
// SolveImplicit and SolveUnrolled of solver.h for each Jet width.
#include <vector>

#include "tangible/lcp/dense/dense_lu.h"
#include "tangible/lcp/dense/derivative.h"
#include "tangible/lcp/dense/interior_point.h"
#include "tangible/lcp/dense/solver.h"
#include "tangible/lcp/dense/tolerances.h"

namespace tangible {
namespace {

/// The k-th derivative parts of a problem.
template <typename T>
MixedLcp<double> DerivativePart(const MixedLcp<T>& problem, int k) {
  const auto part = [k](const T& x) { return x.v[k]; };
  MixedLcp<double> derivative;
  derivative.M = problem.M.unaryExpr(part);
  derivative.p = problem.p.unaryExpr(part);
  derivative.A = problem.A.unaryExpr(part);
  derivative.b = problem.b.unaryExpr(part);
  derivative.G = problem.G.unaryExpr(part);
  derivative.F = problem.F.unaryExpr(part);
  derivative.c = problem.c.unaryExpr(part);
  return derivative;
}

template <typename T>
void SetDerivativePart(const VectorX<double>& derivative, int k, VectorX<T>& x) {
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i].v[k] = derivative[i];
}

template <typename T>
VectorX<T> SlackOf(const MixedLcp<T>& problem, const VectorX<T>& v, const VectorX<T>& z) {
  VectorX<T> s = problem.c;
  for (Eigen::Index j = 0; j < v.size(); ++j) s += problem.G.col(j) * v[j];
  for (Eigen::Index j = 0; j < z.size(); ++j) s += problem.F.col(j) * z[j];
  return s;
}

/// Copies a solution in double to T, without the derivatives of its vectors.
template <typename T>
LcpSolution<T> WithoutDerivatives(const LcpSolution<double>& values) {
  LcpSolution<T> solution;
  solution.status = values.status;
  solution.v = values.v.template cast<T>();
  solution.y = values.y.template cast<T>();
  solution.z = values.z.template cast<T>();
  solution.s = values.s.template cast<T>();
  solution.residual = values.residual;
  solution.solver = values.solver;
  solution.iterations = values.iterations;
  solution.farkas = values.farkas;
  solution.message = values.message;
  return solution;
}

/// Solves the system of the rows' modes in T, as corrections of `solution`. 1e-9 is added to the
/// diagonal, so that redundant rows have a solution; three corrections reduce the error of that to
/// 1e-27 of the consistent part.
template <typename T>
void SolveModesIn(const MixedLcp<T>& problem, const RowModes& row_modes, LcpSolution<T>& solution) {
  const Eigen::Index nv = problem.num_v();
  const Eigen::Index ny = problem.num_y();
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < problem.num_z(); ++i) {
    if (row_modes.modes[i] != RowMode::kInactive) rows.push_back(i);
  }
  const Eigen::Index n = nv + ny + static_cast<Eigen::Index>(rows.size());
  MatrixX<T> K = MatrixX<T>::Constant(n, n, T(0.0));
  const MatrixX<T> G = problem.G(rows, Eigen::all);
  K.topLeftCorner(nv, nv) = problem.M;
  K.block(0, nv, nv, ny) = -problem.A.transpose();
  K.topRightCorner(nv, n - nv - ny) = -G.transpose();
  K.block(nv, 0, ny, nv) = problem.A;
  K.bottomLeftCorner(n - nv - ny, nv) = G;
  K.bottomRightCorner(n - nv - ny, n - nv - ny) = problem.F(rows, rows);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Eigen::Index at = nv + ny + static_cast<Eigen::Index>(k);
    K(at, at) += row_modes.kink_weight[rows[k]];
  }
  const MatrixX<T> exact = K;
  for (Eigen::Index i = 0; i < n; ++i) K(i, i) += kJetShift;
  DenseLu<T> lu;
  if (!lu.Compute(K)) return;
  VectorX<T> rhs(n);
  const VectorX<T> active_c = problem.c(rows);
  rhs << problem.p, problem.b, -active_c;
  VectorX<T> x(n);
  const VectorX<T> active_z = solution.z(rows);
  x << solution.v, solution.y, active_z;
  for (int pass = 0; pass < 4; ++pass) {
    VectorX<T> r = rhs;
    for (Eigen::Index j = 0; j < n; ++j) r -= exact.col(j) * x[j];
    x += lu.Solve(r);
  }
  solution.v = x.head(nv);
  solution.y = x.segment(nv, ny);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    solution.z[rows[k]] = x[nv + ny + static_cast<Eigen::Index>(k)];
  }
}

}  // namespace

template <typename T>
LcpSolution<T> SolveImplicit(const MixedLcp<T>& problem, const LcpOptions& options) {
  MixedLcp<T> conformed = problem;
  ConformEmptyBlocks(conformed);
  const MixedLcp<double> values = ValuesOf(conformed);
  const LcpSolution<double> found = SolveLcp(values, options);
  auto solution = WithoutDerivatives<T>(found);
  if (found.status != LcpStatus::kSolved) return solution;
  const LcpDerivative derivative(values, {found.v, found.y, found.z});
  for (int k = 0; k < NumDerivatives<T>::value; ++k) {
    const LcpVector change = derivative.Tangent(DerivativePart(conformed, k));
    SetDerivativePart(change.v, k, solution.v);
    SetDerivativePart(change.y, k, solution.y);
    SetDerivativePart(change.z, k, solution.z);
  }
  solution.s = SlackOf(conformed, solution.v, solution.z);
  return solution;
}

template <typename T>
LcpSolution<T> SolveUnrolled(const MixedLcp<T>& problem, const LcpOptions& options) {
  MixedLcp<T> conformed = problem;
  ConformEmptyBlocks(conformed);
  const MixedLcp<double> values = ValuesOf(conformed);
  if (!ValidateProblem(values).empty()) {
    return WithoutDerivatives<T>(SolveLcp(values, options));
  }
  const InteriorPointResult<T> run =
      SolveInteriorPoint(conformed, {.max_iterations = options.max_iterations});
  LcpSolution<T> solution;
  solution.v = run.v;
  solution.y = run.y;
  solution.z = run.z;
  solution.iterations = run.iterations;
  const auto measure = [&values](const LcpSolution<T>& s) {
    const auto value = [](const T& x) { return ValueOf(x); };
    return ScaledResidual(values, s.v.unaryExpr(value), s.y.unaryExpr(value), s.z.unaryExpr(value));
  };
  solution.residual = measure(solution);
  // The residual at κ is κ / margin: 1e-10 corresponds to margins of 1e-4, where the error of
  // derivatives is κ / margin² = 1e-6. Nearer to a kink the modes have to be identified.
  if (run.converged && solution.residual <= options.tolerance) {
    solution.status = LcpStatus::kSolved;
    solution.solver = LcpSolver::kInteriorPoint;
  } else {
    const LcpSolution<double> found = SolveLcp(values, options);
    solution = WithoutDerivatives<T>(found);
    if (found.status != LcpStatus::kSolved) return solution;
    const RowModes row_modes = ClassifyRows(values, {found.v, found.y, found.z});
    solution.z = row_modes.point.z.template cast<T>();
    SolveModesIn(conformed, row_modes, solution);
    solution.residual = measure(solution);
  }
  solution.s = SlackOf(conformed, solution.v, solution.z);
  return solution;
}

#define TANGIBLE_INSTANTIATE(N)                                                               \
  template LcpSolution<Jet<(N)>> SolveImplicit(const MixedLcp<Jet<(N)>>&, const LcpOptions&); \
  template LcpSolution<Jet<(N)>> SolveUnrolled(const MixedLcp<Jet<(N)>>&, const LcpOptions&);
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE)
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
