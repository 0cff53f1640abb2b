// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/row_modes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tangible/lcp/dense/nnls.h"
#include "tangible/lcp/dense/tolerances.h"
#include "tangible/math/decompositions.h"

namespace tangible {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Ratios {
  VectorXd z;  // zᵢ / ζᵢ
  VectorXd s;  // sᵢ / σᵢ
};

Ratios ComputeRatios(const MixedLcp<double>& problem, const LcpVector& point) {
  const LcpScales scales = ComputeScales(problem, point.v, point.y, point.z);
  const VectorXd s = Slack(problem, point.v, point.z);
  Ratios ratios{point.z, s};
  for (Index i = 0; i < s.size(); ++i) {
    ratios.z[i] = Ratio(point.z[i], scales.force[i]);
    ratios.s[i] = Ratio(s[i], scales.slack[i]);
  }
  return ratios;
}

// Lowers the z that act only on slacks of rows without force; see the header.
LcpVector LowerFreeRows(const MixedLcp<double>& problem, const LcpVector& solution) {
  LcpVector point = solution;
  for (Index i = 0; i < point.z.size(); ++i) {
    if (!(point.z[i] > 0.0) || !RowOf(problem.G, i).isZero(0.0)) continue;
    const VectorXd s = Slack(problem, point.v, point.z);
    const Ratios ratios = ComputeRatios(problem, point);
    double least = 0.0;
    bool is_free = true;
    for (Index k = 0; k < s.size() && is_free; ++k) {
      const double effect = problem.F(k, i);
      if (effect == 0.0) continue;
      is_free = effect > 0.0 && ratios.z[k] <= kLcpZero;
      // The slack reaches 0 at this z; a slack of rounding size counts as 0 already.
      const double slack = ratios.s[k] <= kLcpZero ? 0.0 : s[k];
      least = std::max(least, point.z[i] - slack / effect);
    }
    if (is_free) point.z[i] = least;
  }
  return point;
}

// The functionals dz, ds of the rows in `degenerate` on a basis of the equations' null space, as
// the rows of the result, dz first.
MatrixXd ConeFunctionals(const MixedLcp<double>& problem, const std::vector<Index>& active,
                         const std::vector<Index>& degenerate) {
  const Index nv = problem.num_v();
  const Index ny = problem.num_y();
  const Index na = static_cast<Index>(active.size());
  const Index nd = static_cast<Index>(degenerate.size());
  std::vector<Index> forces = active;
  forces.insert(forces.end(), degenerate.begin(), degenerate.end());
  MatrixXd equations = MatrixXd::Zero(nv + ny + na, nv + ny + na + nd);
  equations.topLeftCorner(nv, nv) = problem.M;
  equations.block(0, nv, nv, ny) = -problem.A.transpose();
  equations.topRightCorner(nv, na + nd) = -problem.G(forces, Eigen::all).transpose();
  equations.block(nv, 0, ny, nv) = problem.A;
  equations.bottomLeftCorner(na, nv) = problem.G(active, Eigen::all);
  equations.bottomRightCorner(na, na + nd) = problem.F(active, forces);
  const Equilibration scaling = Equilibrate(equations);

  MatrixXd null_space = MatrixXd::Identity(equations.cols(), equations.cols());
  if (equations.rows() > 0) {
    const MatrixXd scaled = scaling.row.asDiagonal() * equations * scaling.col.asDiagonal();
    // In the QR of the transpose the last columns of Q are orthogonal to all rows.
    PivotedQr qr;
    qr.SetThreshold(kRankTolerance);
    qr.Compute(scaled.transpose());
    null_space = scaling.col.asDiagonal() * qr.Q().rightCols(equations.cols() - qr.rank());
  }
  MatrixXd functionals(2 * nd, null_space.cols());
  functionals.topRows(nd) = null_space.bottomRows(nd);
  functionals.bottomRows(nd) = problem.G(degenerate, Eigen::all) * null_space.topRows(nv) +
                               problem.F(degenerate, forces) * null_space.bottomRows(na + nd);
  return functionals;
}

// For each row bᵢ of B: is bᵢ t = 0 for all t with B t ≥ 0? By non-negative least squares: the
// residual t of min ‖bᵢ + Bᵀ λ‖, λ ≥ 0, is zero (then bᵢ is part of a vanishing combination) or a
// direction with B t ≥ 0, bᵢ t > 0.
std::vector<char> ImplicitZeros(MatrixXd B) {
  const double size = B.size() > 0 ? B.cwiseAbs().maxCoeff() : 0.0;
  for (Index i = 0; i < B.rows(); ++i) {
    const double norm = RowOf(B, i).norm();
    if (norm > kVanishingRow * size && norm > 0.0) {
      B.row(i) /= norm;
    } else if (norm > 0.0) {
      B.row(i).setZero();
    }
  }
  std::vector<char> zero(B.rows(), 1);
  for (Index i = 0; i < B.rows(); ++i) {
    if (zero[i] == 0 || RowOf(B, i).isZero(0.0)) continue;
    const VectorXd direction = SolveNnls(-B.transpose(), B.row(i).transpose()).residual;
    if (direction.norm() <= kNoDirection) continue;
    const VectorXd values = B * direction;
    for (Index k = 0; k < B.rows(); ++k) {
      if (values[k] > kNoDirection * direction.norm()) zero[k] = 0;
    }
  }
  return zero;
}

std::vector<Index> RowsOfMode(const std::vector<RowMode>& modes, RowMode mode) {
  std::vector<Index> rows;
  for (Index i = 0; i < static_cast<Index>(modes.size()); ++i) {
    if (modes[i] == mode) rows.push_back(i);
  }
  return rows;
}

// Makes rows marked kKink active or inactive where the other rows leave no choice.
void ResolveDegenerate(const MixedLcp<double>& problem, std::vector<RowMode>& modes) {
  const std::vector<Index> degenerate = RowsOfMode(modes, RowMode::kKink);
  if (degenerate.empty()) return;
  const std::vector<char> zero =
      ImplicitZeros(ConeFunctionals(problem, RowsOfMode(modes, RowMode::kActive), degenerate));
  const std::size_t n = degenerate.size();
  for (std::size_t k = 0; k < n; ++k) {
    if (zero[n + k] != 0) {
      modes[degenerate[k]] = RowMode::kActive;
    } else if (zero[k] != 0) {
      modes[degenerate[k]] = RowMode::kInactive;
    }
  }
}

// Wᵢᵢ of F + G diag(M)⁻¹ Gᵀ; for a row where it is 0 (a sliding speed) the effect of its z through
// the first row k that it acts on, |Fₖᵢ Fᵢₖ| / Wₖₖ.
double WeightAlone(const MixedLcp<double>& problem, Index i) {
  const auto diagonal = [&problem](Index k) {
    double weight = std::abs(problem.F(k, k));
    for (Index j = 0; j < problem.num_v(); ++j) {
      if (problem.M(j, j) > 0.0) weight += problem.G(k, j) * problem.G(k, j) / problem.M(j, j);
    }
    return weight;
  };
  double weight = diagonal(i);
  for (Index k = 0; k < problem.num_z() && weight == 0.0; ++k) {
    const double through = std::abs(problem.F(k, i) * problem.F(i, k));
    if (k != i && through > 0.0 && diagonal(k) > 0.0) weight = through / diagonal(k);
  }
  return weight > 0.0 ? weight : 1.0;
}

// κ of the kink rows: Wᵢᵢ with the active rows held, or of the row alone where those are singular.
// A row whose force does not move its own slack (a skew pair) has no kink: its z stays 0.
void WeighKinks(const MixedLcp<double>& problem, RowModes& result) {
  std::vector<RowMode> held = result.modes;
  for (RowMode& mode : held) {
    if (mode == RowMode::kKink) mode = RowMode::kInactive;
  }
  const std::vector<Index> kinks = RowsOfMode(result.modes, RowMode::kKink);
  if (kinks.empty()) return;
  const ModeSystem system(problem, held, result.kink_weight);
  for (const Index i : kinks) {
    double error = 0.0;
    const LcpVector response = system.Solve(
        {RowOf(problem.G, i), VectorXd::Zero(problem.num_y()), -problem.F.col(i)}, &error);
    const double alone = WeightAlone(problem, i);
    const double held_weight =
        RowOf(problem.G, i).dot(response.v) + problem.F.row(i).dot(response.z) + problem.F(i, i);
    const double size = alone + problem.F.row(i).cwiseAbs().dot(response.z.cwiseAbs());
    const bool consistent = error < kConsistent;
    if (consistent && std::abs(held_weight) <= kNoWeight * size) {
      result.modes[i] = RowMode::kInactive;
    } else {
      result.kink_weight[i] = consistent ? std::abs(held_weight) : alone;
    }
  }
}

// Ratios for margins: a speed is small if it is small compared with the largest speed, not only
// compared with its own terms (a gap that closes at 1e-9 m/s under a body that slides at 1 m/s).
Ratios ComputeMargins(const MixedLcp<double>& problem, const LcpVector& point) {
  const LcpScales scales = ComputeScales(problem, point.v, point.y, point.z);
  const VectorXd s = Slack(problem, point.v, point.z);
  const double speed = point.v.size() > 0 ? point.v.cwiseAbs().maxCoeff() : 0.0;
  Ratios margins{point.z, s};
  for (Index i = 0; i < s.size(); ++i) {
    const double slack_scale =
        std::max(scales.slack[i], RowOf(problem.G, i).cwiseAbs().sum() * speed);
    const double growth = scales.slack[i] > 0.0 ? slack_scale / scales.slack[i] : 1.0;
    margins.z[i] = Ratio(point.z[i], scales.force[i] * growth);
    margins.s[i] = Ratio(s[i], slack_scale);
  }
  return margins;
}

// The smallest margin of rows whose change of mode would change the derivative.
void FindMargin(const MixedLcp<double>& problem, RowModes& result) {
  const Ratios ratios = ComputeMargins(problem, result.point);
  // A small margin does not count if the other rows force the row to keep its mode (λ₊ of a
  // sticking contact with hardly any tangential load): such a row is treated as degenerate, and
  // then resolved.
  std::vector<RowMode> suspects = result.modes;
  for (Index i = 0; i < ratios.z.size(); ++i) {
    if (std::max(ratios.z[i], ratios.s[i]) < kSuspectMargin) suspects[i] = RowMode::kKink;
  }
  std::vector<RowMode> resolved = suspects;
  ResolveDegenerate(problem, resolved);
  result.margin_min = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < ratios.z.size(); ++i) {
    if (suspects[i] == RowMode::kKink && resolved[i] != RowMode::kKink) continue;
    // The row is degenerate, but other rows force its mode; their margins count instead.
    const bool bound = result.modes[i] != RowMode::kKink;
    if (bound && std::max(ratios.z[i], ratios.s[i]) <= kLcpZero) continue;
    const double margin =
        result.modes[i] == RowMode::kKink ? 0.0 : std::max(ratios.z[i], ratios.s[i]);
    if (margin < result.margin_min) {
      result.margin_min = margin;
      result.margin_row = i;
    }
  }
}

}  // namespace

RowModes ClassifyRows(const MixedLcp<double>& problem, const LcpVector& solution) {
  RowModes result;
  result.point = LowerFreeRows(problem, solution);
  const Ratios ratios = ComputeRatios(problem, result.point);
  const Index nz = problem.num_z();
  result.kink_weight = VectorXd::Zero(nz);
  result.modes.assign(nz, RowMode::kInactive);
  for (Index i = 0; i < nz; ++i) {
    if (ratios.z[i] > kLcpZero) {
      result.modes[i] = RowMode::kActive;
    } else if (!(ratios.s[i] > kLcpZero)) {
      result.modes[i] = RowMode::kKink;
    }
  }
  ResolveDegenerate(problem, result.modes);
  WeighKinks(problem, result);
  for (const RowMode mode : result.modes) result.num_kinks += mode == RowMode::kKink ? 1 : 0;
  FindMargin(problem, result);
  return result;
}

}  // namespace tangible
