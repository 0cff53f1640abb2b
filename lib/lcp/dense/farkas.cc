// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/farkas.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/dense/nnls.h"
#include "tangible/lcp/dense/scaling.h"
#include "tangible/lcp/dense/tolerances.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Whether each value is at most the rounding of its terms.
bool Small(const VectorXd& value, const VectorXd& terms) {
  return (value.array() <= kFarkasCondition * terms.array()).all();
}

// The slacks' columns, those of the unit matrix, follow the rows: they would keep small rows small.
void AppendSlacks(Index num_z, Equilibration* scaling) {
  scaling->col.conservativeResize(scaling->col.size() + num_z);
  scaling->col.tail(num_z) = scaling->row.tail(num_z).cwiseInverse();
}

// The largest entry of every row and column is near 1.
Equilibration ByLargest(const MixedLcp<double>& problem, const MatrixXd& E) {
  Equilibration scaling = Equilibrate(E.leftCols(E.rows()));
  AppendSlacks(problem.num_z(), &scaling);
  return scaling;
}

double InverseOr1(double size) { return size > 0.0 ? 1.0 / size : 1.0; }

// M has a diagonal of 1, and the largest entry of every row of A and G in such units is 1, also
// where it is far from those of M. Rows of G that are zero are scaled by F.
Equilibration ByMass(const MixedLcp<double>& problem) {
  const Index nv = problem.num_v(), ny = problem.num_y(), nz = problem.num_z();
  Equilibration scaling;
  scaling.row = VectorXd::Ones(nv + ny + nz);
  for (Index j = 0; j < nv; ++j) {
    scaling.row[j] = InverseOr1(std::sqrt(std::max(problem.M(j, j), 0.0)));
  }
  const VectorXd v = scaling.row.head(nv);
  const auto largest = [&v](const MatrixXd& rows, Index i) {
    return v.size() == 0 ? 0.0 : RowOf(rows, i).cwiseProduct(v).cwiseAbs().maxCoeff();
  };
  for (Index i = 0; i < ny; ++i) scaling.row[nv + i] = InverseOr1(largest(problem.A, i));
  for (Index i = 0; i < nz; ++i) scaling.row[nv + ny + i] = InverseOr1(largest(problem.G, i));
  scaling.col = scaling.row;
  for (Index i = 0; i < nz; ++i) {
    if (largest(problem.G, i) > 0.0) continue;
    const VectorXd row = problem.F.row(i).transpose().cwiseProduct(scaling.col.tail(nz));
    scaling.row[nv + ny + i] = InverseOr1(row.cwiseAbs().maxCoeff());
  }
  AppendSlacks(nz, &scaling);
  return scaling;
}

// A checked proof from the least squares of the scaled equations, or empty.
VectorXd SearchScaled(const MixedLcp<double>& problem, const LinearEquations& equations,
                      const Equilibration& scaling) {
  const MatrixXd E = scaling.row.asDiagonal() * equations.E * scaling.col.asDiagonal();
  const VectorXd f = scaling.row.cwiseProduct(equations.f);
  if (!E.allFinite() || !f.allFinite()) return VectorXd();
  // Their residual is the proof.
  VectorXd residual = SolveNnls(E, f, problem.num_v() + problem.num_y()).residual;
  residual.tail(problem.num_z()) = (-residual.tail(problem.num_z())).cwiseMax(0.0);
  const double largest = residual.size() > 0 ? residual.cwiseAbs().maxCoeff() : 0.0;
  if (!(largest > 0.0)) return VectorXd();
  // The residual is a difference of numbers of f's size, and entries that are rounding count as
  // zero. That is decided here, as the entries of the proof differ by what the rows differ.
  const double rounding = kLcpRounding * f.cwiseAbs().maxCoeff();
  for (const double least : kFarkasEntries) {
    const double threshold = std::clamp(rounding, least * largest, kMostFarkasEntry * largest);
    VectorXd farkas = scaling.row.cwiseProduct(
        residual.unaryExpr([=](double x) { return std::abs(x) < threshold ? 0.0 : x; }));
    farkas /= farkas.cwiseAbs().maxCoeff();
    if (CheckFarkas(problem, farkas)) return farkas;
  }
  return VectorXd();
}

}  // namespace

bool CheckFarkas(const MixedLcp<double>& problem, const VectorXd& farkas) {
  const Index nv = problem.num_v();
  const Index ny = problem.num_y();
  const Index nz = problem.num_z();
  if (farkas.size() != nv + ny + nz || !farkas.allFinite()) return false;
  const VectorXd u = farkas.head(nv);
  const VectorXd t = farkas.segment(nv, ny);
  const VectorXd w = farkas.tail(nz);
  if (nz > 0 && w.minCoeff() < 0.0) return false;
  const VectorXd size_u = u.cwiseAbs();
  const VectorXd size_t = t.cwiseAbs();
  const VectorXd momentum =
      problem.M.transpose() * u + problem.A.transpose() * t + problem.G.transpose() * w;
  const VectorXd momentum_terms = problem.M.cwiseAbs().transpose() * size_u +
                                  problem.A.cwiseAbs().transpose() * size_t +
                                  problem.G.cwiseAbs().transpose() * w;
  const VectorXd joint = problem.A * u;
  const VectorXd row = problem.F.transpose() * w - problem.G * u;
  const VectorXd row_terms = problem.F.cwiseAbs().transpose() * w + problem.G.cwiseAbs() * size_u;
  const double delta = u.dot(problem.p) + t.dot(problem.b) - w.dot(problem.c);
  const double delta_terms = size_u.dot(problem.p.cwiseAbs()) + size_t.dot(problem.b.cwiseAbs()) +
                             w.dot(problem.c.cwiseAbs());
  return delta > 0.0 && delta >= kProofMargin * delta_terms &&
         Small(momentum.cwiseAbs(), momentum_terms) &&
         Small(joint.cwiseAbs(), problem.A.cwiseAbs() * size_u) && Small(row, row_terms);
}

VectorXd FindFarkas(const MixedLcp<double>& problem) {
  const LinearEquations equations = AllEquations(problem);
  // Which scaling distinguishes a proof from rounding depends on whether it contains M's rows.
  for (const Equilibration& scaling : {ByLargest(problem, equations.E), ByMass(problem)}) {
    VectorXd farkas = SearchScaled(problem, equations, scaling);
    if (farkas.size() > 0) return farkas;
  }
  return VectorXd();
}

}  // namespace tangible
