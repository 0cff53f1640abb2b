// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/dense/derivative.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "tangible/lcp/dense/solver.h"

namespace tangible {
namespace {

template <typename Derived>
double LargestEntry(const Eigen::MatrixBase<Derived>& x) {
  return x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0.0;
}

}  // namespace

LcpDerivative::LcpDerivative(const MixedLcp<double>& problem, const LcpVector& solution)
    : problem_(problem),
      rows_(ClassifyRows(problem, solution)),
      system_(problem, rows_.modes, rows_.kink_weight) {}

LcpVector LcpDerivative::RightHandSide(const MixedLcp<double>& d) const {
  const LcpVector& at = rows_.point;
  return {d.p - d.M * at.v + d.G.transpose() * at.z + d.A.transpose() * at.y, d.b - d.A * at.v,
          -(d.G * at.v + d.F * at.z + d.c)};
}

LcpVector LcpDerivative::Tangent(const MixedLcp<double>& perturbation) const {
  const LcpVector rhs = RightHandSide(perturbation);
  double error = 0.0;
  LcpVector change = system_.Solve(rhs, &error);
  // The residual is compared with the size of the terms, because terms that cancel leave only
  // rounding.
  const LcpVector& at = rows_.point;
  const double terms =
      LargestEntry(perturbation.p) + LargestEntry(perturbation.b) + LargestEntry(perturbation.c) +
      (LargestEntry(perturbation.M) + LargestEntry(perturbation.G) + LargestEntry(perturbation.A)) *
          LargestEntry(at.v) +
      (LargestEntry(perturbation.G) + LargestEntry(perturbation.F)) * LargestEntry(at.z) +
      LargestEntry(perturbation.A) * LargestEntry(at.y);
  const double size = std::max({LargestEntry(rhs.v), LargestEntry(rhs.y), LargestEntry(rhs.z)});
  if (size > 0.0) linear_residual_ = std::max(linear_residual_, error * (size / terms));
  return change;
}

bool LcpDerivative::OneSidedTangent(const MixedLcp<double>& perturbation, LcpVector& change) const {
  std::vector<Eigen::Index> kinks;
  std::vector<RowMode> held = rows_.modes;
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (held[i] != RowMode::kKink) continue;
    held[i] = RowMode::kInactive;
    kinks.push_back(static_cast<Eigen::Index>(i));
  }
  const ModeSystem system(problem_, held, rows_.kink_weight);
  const LcpVector rhs = RightHandSide(perturbation);
  change = system.Solve(rhs);
  // On the kink rows ds = W dz + q; the other rows keep their modes.
  const Eigen::Index n = static_cast<Eigen::Index>(kinks.size());
  const auto slack = [&](const LcpVector& x) -> VectorX<double> {
    return problem_.G(kinks, Eigen::all) * x.v + problem_.F(kinks, Eigen::all) * x.z;
  };
  MixedLcp<double> small;
  small.c = slack(change) - rhs.z(kinks);
  small.F.resize(n, n);
  std::vector<LcpVector> responses;
  for (Eigen::Index k = 0; k < n; ++k) {
    LcpVector response =
        system.Solve({RowOf(problem_.G, kinks[k]), VectorX<double>::Zero(problem_.num_y()),
                      -problem_.F.col(kinks[k])});
    response.z[kinks[k]] = 1.0;
    small.F.col(k) = slack(response);
    responses.push_back(std::move(response));
  }
  const LcpSolution<double> solution = SolveLcp(small);
  if (solution.status != LcpStatus::kSolved) return false;
  for (Eigen::Index k = 0; k < n; ++k) {
    change.v += solution.z[k] * responses[k].v;
    change.y += solution.z[k] * responses[k].y;
    change.z += solution.z[k] * responses[k].z;
  }
  return true;
}

MixedLcp<double> LcpDerivative::Adjoint(const LcpVector& loss_gradient) const {
  const LcpVector& at = rows_.point;
  double error = 0.0;
  const LcpVector dual = system_.SolveTransposed(loss_gradient, &error);
  linear_residual_ = std::max(linear_residual_, error);
  const VectorX<double>& u = dual.v;
  const VectorX<double>& t = dual.y;
  const VectorX<double>& w = dual.z;
  MixedLcp<double> gradient;
  gradient.p = u;
  gradient.b = t;
  gradient.c = -w;
  gradient.M = -0.5 * (u * at.v.transpose() + at.v * u.transpose());
  gradient.F = -w * at.z.transpose();
  gradient.G = at.z * u.transpose() - w * at.v.transpose();
  gradient.A = at.y * u.transpose() - t * at.v.transpose();
  return gradient;
}

Certificate LcpDerivative::certificate() const {
  Certificate certificate;
  certificate.margin_min = rows_.margin_min;
  if (rows_.margin_row >= 0) certificate.margin_where = "row " + std::to_string(rows_.margin_row);
  certificate.degenerate_rows = rows_.num_kinks;
  certificate.redundant_rows = system_.rank_deficiency();
  certificate.condition = system_.condition();
  certificate.linear_residual = linear_residual_;
  SetVerdict(certificate);
  return certificate;
}

}  // namespace tangible
