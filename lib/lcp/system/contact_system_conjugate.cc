// SPDX-License-Identifier: Apache-2.0
//
// Refinement where δ is large beside the compliance of held bodies: generalised conjugate residuals
// on K K_δ⁻¹, where K_δ is the factorised matrix.
#include <algorithm>
#include <cmath>

#include "tangible/lcp/system/contact_system.h"
#include "tangible/lcp/system/tolerances.h"
#include "tangible/math/scratch.h"

namespace tangible {
namespace {

// There are no more slow directions than heavy bodies, which are few.
constexpr int kMostDirections = 12;
// After this many rounds in a row that reduce no residual by a tenth the iteration ends: rows
// contradict each other, or the residual is rounding.
constexpr int kMostIdle = 3;
constexpr double kLessened = 0.9;

}  // namespace

template <bool kTransposed>
void ContactSystem::RefineConjugate(const ContactProblem<double>& problem,
                                    const std::vector<ContactMode>& modes,
                                    Regularisation regularisation, const FreeMomenta& free,
                                    double* x, int columns, int column,
                                    RefinementScratch* scratch) {
  const size_t rows = rhs_.size() / columns;
  SizeScratch(rows * (5 + 2 * kMostDirections), &scratch->conjugate);
  double* zero = scratch->conjugate.data();
  double* rhs = zero + rows;
  double* at = rhs + rows;
  double* left = at + rows;
  double* weight = left + rows;
  double* corrections = weight + rows;
  double* changes = corrections + rows * kMostDirections;  // K times these, orthonormal
  ResidualSize* size = &scratch->sizes[column];
  for (size_t i = 0; i < rows; ++i) {
    const RowScale& kind =
        i < 3 * static_cast<size_t>(problem.num_bodies) ? size->momentum : size->constraint;
    const double scale = std::max(kind.terms, kind.parts);
    weight[i] = scale > 0.0 ? 1.0 / scale : 1.0;
    zero[i] = 0.0;
    rhs[i] = rhs_[i * columns + column];
    at[i] = x[i * columns + column];
  }
  const auto dot = [&](const double* p, const double* q) {
    double sum = 0.0;
    for (size_t i = 0; i < rows; ++i) {
      sum += weight[i] * p[i] * (weight[i] * q[i]);
    }
    return sum;
  };
  const auto subtract = [rows](double factor, const double* p, double* q) {
    for (size_t i = 0; i < rows; ++i) {
      q[i] -= factor * p[i];
    }
  };
  const FreeMomenta own = {free.values + std::min(column, free.columns - 1), free.columns};
  const auto residual = [&](const double* of, const double* point, double* to) {
    return ResidualWith<kTransposed>(problem, modes, regularisation, own, of, point, 1, to,
                                     nullptr);
  };
  residual(rhs, at, left);
  int idle = 0;
  for (int k = 0; k < kMostDirections && idle < kMostIdle && size->ToParts() > kDirectionGoal;
       ++k) {
    double* correction = corrections + rows * k;
    double* change = changes + rows * k;
    std::copy(left, left + rows, correction);
    SolveOnce<kTransposed>(problem, modes, correction, 1);
    residual(zero, correction, change);  // the sign is that of −K
    const double whole = std::sqrt(dot(change, change));
    for (int j = 0; j < 2 * k; ++j) {  // twice, against rounding
      const double part = dot(changes + rows * (j % k), change);
      subtract(part, changes + rows * (j % k), change);
      subtract(part, corrections + rows * (j % k), correction);
    }
    const double norm = std::sqrt(dot(change, change));
    if (!(norm > kSpanned * whole) || !std::isfinite(whole)) {
      return;
    }
    for (size_t i = 0; i < rows; ++i) {
      change[i] /= norm;
      correction[i] /= norm;
    }
    subtract(dot(change, left), correction, at);
    const ResidualSize next = residual(rhs, at, left);
    const double before = size->ToParts();
    idle = next.ToParts() < kLessened * before ? 0 : idle + 1;
    if (next.ToParts() < before) {
      *size = next;
      for (size_t i = 0; i < rows; ++i) {
        x[i * columns + column] = at[i];
      }
    }
  }
}

#define TANGIBLE_INSTANTIATE(kTransposed)                                             \
  template void ContactSystem::RefineConjugate<kTransposed>(                          \
      const ContactProblem<double>&, const std::vector<ContactMode>&, Regularisation, \
      const FreeMomenta&, double*, int, int, RefinementScratch*);
TANGIBLE_INSTANTIATE(false)
TANGIBLE_INSTANTIATE(true)
#undef TANGIBLE_INSTANTIATE

}  // namespace tangible
