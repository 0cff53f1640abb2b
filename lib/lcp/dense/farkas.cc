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
  const auto [E, f] = AllEquations(problem);
  const Equilibration scaling = Equilibrate(E);
  // The residual of their least squares is the proof.
  const NnlsResult least =
      SolveNnls(scaling.row.asDiagonal() * E * scaling.col.asDiagonal(),
                scaling.row.cwiseProduct(f), problem.num_v() + problem.num_y());
  VectorXd farkas = scaling.row.cwiseProduct(least.residual);
  farkas.tail(problem.num_z()) = (-farkas.tail(problem.num_z())).cwiseMax(0.0);
  const double largest = farkas.size() > 0 ? farkas.cwiseAbs().maxCoeff() : 0.0;
  if (!(largest > 0.0)) return VectorXd();
  // The residual is a difference of numbers of f's size: entries below their rounding count as
  // zero.
  const double rounding = kLcpRounding * scaling.row.maxCoeff() * f.cwiseAbs().maxCoeff();
  const double threshold = std::clamp(rounding / largest, kLeastFarkasEntry, kMostFarkasEntry);
  farkas = farkas.unaryExpr(
      [=](double x) { return std::abs(x) < threshold * largest ? 0.0 : x / largest; });
  return CheckFarkas(problem, farkas) ? farkas : VectorXd();
}

}  // namespace tangible
