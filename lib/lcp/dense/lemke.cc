// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/lemke.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tangible/lcp/dense/scaling.h"
#include "tangible/lcp/dense/tolerances.h"
#include "tangible/math/decompositions.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The columns are w (0 to n-1), z (n to 2n-1), z₀ (2n) and the right-hand side (2n+1). The columns
// of w hold B⁻¹, which the lexicographic rule reads.
class Tableau {
 public:
  Tableau(const MatrixXd& W, const VectorXd& q, const VectorXd& d)
      : n_(q.size()), rows_(n_, 2 * n_ + 2), basis_(n_) {
    rows_.leftCols(n_).setIdentity();
    rows_.middleCols(n_, n_) = -W;
    rows_.col(2 * n_) = -d;
    rows_.col(2 * n_ + 1) = q;
    for (Index i = 0; i < n_; ++i) basis_[i] = i;
  }

  Index Artificial() const { return 2 * n_; }
  Index Basic(Index row) const { return basis_[row]; }
  Index Complement(Index variable) const { return variable < n_ ? variable + n_ : variable - n_; }

  // The row in which z₀ enters the basis: the lexicographic minimum of (q, B⁻¹)ᵢ / dᵢ.
  Index FirstRow() const {
    const VectorXd d = -rows_.col(Artificial());
    Index best = 0;
    for (Index i = 1; i < n_; ++i) {
      if (LexicographicallyLess(i, d[i], best, d[best])) best = i;
    }
    return best;
  }

  // The row that limits `entering`, or -1 on a ray. z₀ is preferred as the leaving variable,
  // because that ends the path.
  Index LeavingRow(Index entering) const {
    const auto column = rows_.col(entering);
    const double tolerance = kLeastPivot * std::max(1.0, column.cwiseAbs().maxCoeff());
    Index best = -1;
    Index artificial_row = -1;
    for (Index i = 0; i < n_; ++i) {
      if (column[i] <= tolerance) continue;
      if (basis_[i] == Artificial()) artificial_row = i;
      if (best < 0 || LexicographicallyLess(i, column[i], best, column[best])) best = i;
    }
    if (artificial_row < 0) return best;
    const double ratio = Rhs(artificial_row) / column[artificial_row];
    const double least = Rhs(best) / column[best];
    return ratio <= least + kLcpRounding * std::abs(least) ? artificial_row : best;
  }

  // Returns the variable that leaves.
  Index Pivot(Index row, Index entering) {
    rows_.row(row) /= rows_(row, entering);
    for (Index i = 0; i < n_; ++i) {
      const double factor = rows_(i, entering);
      if (i != row && factor != 0.0) rows_.row(i) -= factor * rows_.row(row);
    }
    return std::exchange(basis_[row], entering);
  }

  VectorXd BasicZ() const {
    VectorXd z = VectorXd::Zero(n_);
    for (Index i = 0; i < n_; ++i) {
      if (basis_[i] >= n_ && basis_[i] < Artificial()) z[basis_[i] - n_] = std::max(0.0, Rhs(i));
    }
    return z;
  }

 private:
  double Rhs(Index row) const { return rows_(row, 2 * n_ + 1); }

  bool LexicographicallyLess(Index i, double divide_i, Index k, double divide_k) const {
    const auto compare = [&](Index column) {
      const double a = rows_(i, column) / divide_i;
      const double b = rows_(k, column) / divide_k;
      if (std::abs(a - b) <= kRatioTie * (std::abs(a) + std::abs(b))) return 0;
      return a < b ? -1 : 1;
    };
    int order = compare(2 * n_ + 1);
    for (Index column = 0; order == 0 && column < n_; ++column) order = compare(column);
    return order < 0;
  }

  Index n_;
  RowMatrixXd rows_;
  std::vector<Index> basis_;
};

int PivotLimit(const LemkeOptions& options, Index n) {
  if (options.max_pivots > 0) return options.max_pivots;
  const double size = static_cast<double>(n);
  return static_cast<int>(std::min(200000.0, 1e8 / (size * size) + 50.0 * size));
}

}  // namespace

LemkeResult SolveLemke(const MatrixXd& W, const VectorXd& q, const LemkeOptions& options) {
  const Index n = q.size();
  LemkeResult result;
  result.z = VectorXd::Zero(n);
  if (n == 0 || q.minCoeff() >= 0.0) {
    result.status = LemkeStatus::kSolved;
    return result;
  }
  const Equilibration scaling = Equilibrate(W);
  const VectorXd scaled_q = scaling.row.cwiseProduct(q);
  const double size = scaled_q.cwiseAbs().maxCoeff();
  const VectorXd d = options.covering.size() == n ? options.covering : VectorXd::Ones(n);
  Tableau tableau(scaling.row.asDiagonal() * W * scaling.col.asDiagonal(), scaled_q / size, d);
  const int limit = PivotLimit(options, n);
  Index leaving = tableau.Pivot(tableau.FirstRow(), tableau.Artificial());
  for (result.pivots = 1; result.pivots < limit; ++result.pivots) {
    const Index entering = tableau.Complement(leaving);
    const Index row = tableau.LeavingRow(entering);
    if (row < 0) {
      result.status = LemkeStatus::kRay;
      break;
    }
    leaving = tableau.Pivot(row, entering);
    if (leaving == tableau.Artificial()) {
      result.status = LemkeStatus::kSolved;
      break;
    }
  }
  result.z = size * scaling.col.cwiseProduct(tableau.BasicZ());
  if (!result.z.allFinite()) {
    result.status = LemkeStatus::kPivotLimit;
    result.z.setZero();
  }
  return result;
}

LemkeResult SolveLemkeFrom(const VectorXd& start, const MatrixXd& W, const VectorXd& q,
                           const LemkeOptions& options) {
  std::vector<Index> basis, others;
  for (Index i = 0; i < q.size(); ++i) (start[i] > 0.0 ? basis : others).push_back(i);
  if (basis.empty()) return SolveLemke(W, q, options);
  const Index size = static_cast<Index>(basis.size());
  const MatrixXd square = W(basis, basis);
  const Equilibration scaling = Equilibrate(square);
  const PartialLu lu(scaling.row.asDiagonal() * square * scaling.col.asDiagonal());
  const auto solve = [&](const MatrixXd& rhs) -> MatrixXd {
    const auto once = [&](const MatrixXd& of) -> MatrixXd {
      if (of.cols() == 0) return of;  // Eigen's triangular solve would form a null reference
      return scaling.col.asDiagonal() * lu.Solve(MatrixXd(scaling.row.asDiagonal() * of));
    };
    const MatrixXd x = once(rhs);
    return x + once(rhs - square * x);
  };
  // The basis after w and z have changed places, with the rows in their old places.
  const MatrixXd inverse = solve(MatrixXd::Identity(size, size));
  const MatrixXd by_others = solve(W(basis, others));
  const VectorXd at = solve(-q(basis));
  const MatrixXd below = W(others, basis);
  MatrixXd pivoted(q.size(), q.size());
  VectorXd constants(q.size());
  pivoted(basis, basis) = inverse;
  pivoted(basis, others) = -by_others;
  pivoted(others, basis) = below * inverse;
  pivoted(others, others) = W(others, others) - below * by_others;
  constants(basis) = at;
  constants(others) = q(others) + below * at;
  LemkeResult result;
  result.z = start;
  if (!pivoted.allFinite() || !constants.allFinite()) return result;
  result = SolveLemke(pivoted, constants, options);
  const VectorXd of_basis = at + inverse * result.z(basis) - by_others * result.z(others);
  result.z(basis) = of_basis.cwiseMax(0.0);
  return result;
}

std::optional<ReducedLcp> ReduceToPlain(const MixedLcp<double>& problem) {
  const Index nv = problem.num_v();
  const Index ny = problem.num_y();
  const Index nz = problem.num_z();
  MatrixXd K = MatrixXd::Zero(nv + ny, nv + ny);
  K.topLeftCorner(nv, nv) = problem.M;
  K.topRightCorner(nv, ny) = -problem.A.transpose();
  K.bottomLeftCorner(ny, nv) = problem.A;
  MatrixXd rhs = MatrixXd::Zero(nv + ny, nz + 1);
  rhs.topLeftCorner(nv, nz) = problem.G.transpose();
  rhs.col(nz) << problem.p, problem.b;

  MatrixXd solution = MatrixXd::Zero(nv + ny, nz + 1);
  if (nv + ny > 0) {
    const Equilibration scaling = Equilibrate(K);
    const MatrixXd scaled = scaling.row.asDiagonal() * K * scaling.col.asDiagonal();
    OrthogonalDecomposition decomposition;
    decomposition.SetThreshold(kReducedRank);
    decomposition.Compute(scaled);
    const MatrixXd scaled_rhs = scaling.row.asDiagonal() * rhs;
    MatrixXd x = decomposition.Solve(scaled_rhs);
    x += decomposition.Solve(MatrixXd(scaled_rhs - scaled * x));
    const double error = (scaled_rhs - scaled * x).cwiseAbs().maxCoeff();
    if (!(error <= kConsistent * scaled_rhs.cwiseAbs().maxCoeff())) return std::nullopt;
    solution = scaling.col.asDiagonal() * x;
  }
  ReducedLcp reduced;
  reduced.v0 = solution.col(nz).head(nv);
  reduced.y0 = solution.col(nz).tail(ny);
  reduced.v_z = solution.topLeftCorner(nv, nz);
  reduced.y_z = solution.bottomLeftCorner(ny, nz);
  reduced.W = problem.F + problem.G * reduced.v_z;
  reduced.q = problem.c + problem.G * reduced.v0;
  return reduced;
}

}  // namespace tangible
