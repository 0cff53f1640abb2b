// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/problem.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/dense/tolerances.h"
#include "tangible/math/decompositions.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::string ShapeError(const char* name, Index rows, Index cols, Index got_rows, Index got_cols) {
  return std::string(name) + ": expected " + std::to_string(rows) + " x " + std::to_string(cols) +
         ", got " + std::to_string(got_rows) + " x " + std::to_string(got_cols);
}

std::string CheckBlock(const char* name, const MatrixXd& block, Index rows, Index cols) {
  const bool both_empty = block.size() == 0 && rows * cols == 0;
  if (!both_empty && (block.rows() != rows || block.cols() != cols)) {
    return ShapeError(name, rows, cols, block.rows(), block.cols());
  }
  if (!block.allFinite()) return std::string(name) + ": expected finite numbers";
  return "";
}

// The smallest y with the same Aᵀ y. Joints that contradict each other can have a part of y of any
// size that cancels in Aᵀ y; it moves nothing and must not enter a scale.
VectorXd EffectiveImpulse(const MatrixXd& A, const VectorXd& y) {
  if (y.size() < 2 || A.cols() == 0 || !y.allFinite()) return y;
  const MatrixXd rows = A.transpose();
  const OrthogonalDecomposition decomposition(rows);
  if (decomposition.rank() == y.size()) return y;
  return decomposition.Solve(VectorXd(rows * y));
}

template <typename T>
MatrixXd Values(const MatrixX<T>& matrix) {
  return matrix.unaryExpr([](const T& x) { return ValueOf(x); });
}

}  // namespace

const char* ToString(LcpStatus status) {
  switch (status) {
    case LcpStatus::kSolved:
      return "solved";
    case LcpStatus::kInfeasible:
      return "infeasible";
    case LcpStatus::kUnsolved:
      break;
  }
  return "unsolved";
}

const char* ToString(LcpSolver solver) {
  switch (solver) {
    case LcpSolver::kInteriorPoint:
      return "interior_point";
    case LcpSolver::kGuess:
      return "guess";
    case LcpSolver::kLemke:
      return "lemke";
    case LcpSolver::kEnumeration:
      return "enumeration";
    case LcpSolver::kNone:
      break;
  }
  return "none";
}

template <typename T>
void ConformEmptyBlocks(MixedLcp<T>& problem) {
  const auto conform = [](MatrixX<T>& block, Index rows, Index cols) {
    if (block.size() == 0 && rows * cols == 0) block.resize(rows, cols);
  };
  conform(problem.M, problem.num_v(), problem.num_v());
  conform(problem.A, problem.num_y(), problem.num_v());
  conform(problem.G, problem.num_z(), problem.num_v());
  conform(problem.F, problem.num_z(), problem.num_z());
}

LinearEquations AllEquations(const MixedLcp<double>& problem) {
  const Index nv = problem.num_v();
  const Index ny = problem.num_y();
  const Index nz = problem.num_z();
  const Index n = nv + ny + nz;
  LinearEquations all{MatrixX<double>::Zero(n, n + nz), VectorX<double>(n)};
  all.E.topLeftCorner(nv, nv) = problem.M;
  all.E.block(0, nv, nv, ny) = -problem.A.transpose();
  all.E.block(0, nv + ny, nv, nz) = -problem.G.transpose();
  all.E.block(nv, 0, ny, nv) = problem.A;
  all.E.block(nv + ny, 0, nz, nv) = -problem.G;
  all.E.block(nv + ny, nv + ny, nz, nz) = -problem.F;
  all.E.bottomRightCorner(nz, nz).setIdentity();
  all.f << problem.p, problem.b, problem.c;
  return all;
}

std::string ValidateProblem(const MixedLcp<double>& problem) {
  const Index nv = problem.num_v();
  const Index ny = problem.num_y();
  const Index nz = problem.num_z();
  for (const std::string& error :
       {CheckBlock("M", problem.M, nv, nv), CheckBlock("p", problem.p, nv, 1),
        CheckBlock("A", problem.A, ny, nv), CheckBlock("b", problem.b, ny, 1),
        CheckBlock("G", problem.G, nz, nv), CheckBlock("F", problem.F, nz, nz),
        CheckBlock("c", problem.c, nz, 1)}) {
    if (!error.empty()) return error;
  }
  return "";
}

template <typename T>
MixedLcp<double> ValuesOf(const MixedLcp<T>& problem) {
  MixedLcp<double> values;
  values.M = Values<T>(problem.M);
  values.p = Values<T>(problem.p);
  values.A = Values<T>(problem.A);
  values.b = Values<T>(problem.b);
  values.G = Values<T>(problem.G);
  values.F = Values<T>(problem.F);
  values.c = Values<T>(problem.c);
  return values;
}

LcpScales ComputeScales(const MixedLcp<double>& problem, const VectorXd& v, const VectorXd& y,
                        const VectorXd& z) {
  const MatrixXd G = problem.G.cwiseAbs();
  const VectorXd joints = EffectiveImpulse(problem.A, y).cwiseAbs();
  const VectorXd impulse = problem.p.cwiseAbs() + problem.A.cwiseAbs().transpose() * joints +
                           G.transpose() * z.cwiseAbs();
  LcpScales scales;
  scales.momentum = problem.M.cwiseAbs() * v.cwiseAbs() + impulse;
  VectorXd speed = v.cwiseAbs();
  VectorXd inverse_mass = VectorXd::Zero(v.size());
  double root_energy = 0.0;
  for (Index j = 0; j < v.size(); ++j) {
    if (problem.M(j, j) <= 0.0) continue;
    inverse_mass[j] = 1.0 / problem.M(j, j);
    root_energy += std::sqrt(problem.M(j, j)) *
                   std::max(std::abs(v[j]), std::abs(problem.p[j]) * inverse_mass[j]);
  }
  for (Index j = 0; j < v.size(); ++j) {
    const double pushed =
        std::min(impulse[j] * inverse_mass[j], root_energy * std::sqrt(inverse_mass[j]));
    speed[j] = std::max(speed[j], pushed);
  }
  scales.joint = problem.A.cwiseAbs() * speed + problem.b.cwiseAbs();
  scales.slack = G * speed + problem.F.cwiseAbs() * z.cwiseAbs() + problem.c.cwiseAbs();

  const VectorXd delassus = problem.F.diagonal() + G.cwiseAbs2() * inverse_mass;
  double largest[2] = {0.0, 0.0};
  const auto kind = [&](Index i) { return RowOf(G, i).isZero(0.0) ? 1 : 0; };
  for (Index i = 0; i < z.size(); ++i) {
    largest[kind(i)] = std::max(largest[kind(i)], std::abs(z[i]));
  }
  scales.force.resize(z.size());
  for (Index i = 0; i < z.size(); ++i) {
    double from_slack = 0.0;
    if (delassus[i] > 0.0) {
      from_slack = scales.slack[i] / delassus[i];
    } else {
      for (Index k = 0; k < z.size(); ++k) {
        const double effect = std::abs(problem.F(k, i));
        if (effect > 0.0) from_slack = std::max(from_slack, scales.slack[k] / effect);
      }
    }
    scales.force[i] = std::max(largest[kind(i)], from_slack);
  }
  return scales;
}

VectorXd Slack(const MixedLcp<double>& problem, const VectorXd& v, const VectorXd& z) {
  return problem.G * v + problem.F * z + problem.c;
}

double ScaledResidual(const MixedLcp<double>& problem, const VectorXd& v, const VectorXd& y,
                      const VectorXd& z) {
  const VectorXd s = Slack(problem, v, z);
  const VectorXd momentum =
      problem.M * v - problem.A.transpose() * y - problem.G.transpose() * z - problem.p;
  const VectorXd joint = problem.A * v - problem.b;
  if (!s.allFinite() || !momentum.allFinite() || !joint.allFinite()) {
    return std::numeric_limits<double>::infinity();
  }
  const LcpScales scales = ComputeScales(problem, v, y, z);
  double residual = 0.0;
  for (Index i = 0; i < z.size(); ++i) {
    const double row = std::min(Ratio(z[i], scales.force[i]), Ratio(s[i], scales.slack[i]));
    residual = std::max(residual, std::abs(row));
  }
  for (Index j = 0; j < v.size(); ++j) {
    residual = std::max(residual, std::abs(Ratio(momentum[j], scales.momentum[j])));
  }
  for (Index j = 0; j < y.size(); ++j) {
    residual = std::max(residual, std::abs(Ratio(joint[j], scales.joint[j])));
  }
  return residual;
}

bool DependsOnData(const MixedLcp<double>& problem, const VectorXd& v, const VectorXd& y,
                   const VectorXd& z, double residual) {
  MixedLcp<double> homogeneous = problem;
  homogeneous.p.setZero();
  homogeneous.b.setZero();
  homogeneous.c.setZero();
  return residual <= kDependsOnData * ScaledResidual(homogeneous, v, y, z);
}

#define TANGIBLE_INSTANTIATE(T)                   \
  template void ConformEmptyBlocks(MixedLcp<T>&); \
  template MixedLcp<double> ValuesOf(const MixedLcp<T>&);
TANGIBLE_INSTANTIATE(double)
#define TANGIBLE_INSTANTIATE_JET(N) TANGIBLE_INSTANTIATE(Jet<(N)>)
TANGIBLE_FOR_EACH_JET_WIDTH(TANGIBLE_INSTANTIATE_JET)
#undef TANGIBLE_INSTANTIATE_JET
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
