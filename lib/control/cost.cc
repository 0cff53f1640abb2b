// SPDX-License-Identifier: Apache-2.0
#include "tangible/control/cost.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tangible/control/tolerances.h"

namespace tangible {
namespace {

// A residual of one or two variables: its value, and its derivatives with respect to `variable`
// (for a point the body's position on that axis) and `angle`.
struct Residual {
  double value;
  double by_variable = 1.0;
  double by_angle = 0.0;
  double curvature = 0.0;  // second derivative by the variable, for a point by the angle
};

Residual Evaluate(const CostTerm& term, const VectorX<double>& x, const VectorX<double>& u) {
  switch (term.kind) {
    case CostTerm::Kind::kState:
      return {x[term.index] - term.target};
    case CostTerm::Kind::kControl:
      return {u[term.index] - term.target};
    case CostTerm::Kind::kAngle: {
      const double half = 0.5 * (x[term.index] - term.target);
      return {2.0 * std::sin(half), std::cos(half), 0.0, -0.5 * std::sin(half)};
    }
    case CostTerm::Kind::kPoint:
      break;
  }
  const double c = std::cos(x[term.index + 2]);
  const double s = std::sin(x[term.index + 2]);
  const double turned[2] = {c * term.at.x() - s * term.at.y(), s * term.at.x() + c * term.at.y()};
  const double by_angle = term.axis == 0 ? -turned[1] : turned[0];
  return {x[term.index + term.axis] + turned[term.axis] - term.target, 1.0, by_angle,
          -turned[term.axis]};
}

}  // namespace

void CostExpansion::SetZero(int num_states, int num_controls) {
  value = 0.0;
  x.setZero(num_states);
  u.setZero(num_controls);
  xx.setZero(num_states, num_states);
  ux.setZero(num_controls, num_states);
  uu.setZero(num_controls, num_controls);
}

double ResidualOf(const CostTerm& term, const VectorX<double>& x, const VectorX<double>& u) {
  return Evaluate(term, x, u).value;
}

VectorX<double> ChangesOf(const CostTerm& term, const VectorX<double>& x,
                          const MatrixX<double>& changes) {
  if (term.kind == CostTerm::Kind::kControl) return VectorX<double>::Zero(changes.cols());
  if (term.kind != CostTerm::Kind::kPoint) return changes.row(term.index);
  const double by_angle = Evaluate(term, x, VectorX<double>()).by_angle;
  return changes.row(term.index + term.axis) + by_angle * changes.row(term.index + 2);
}

Cost::Cost(int num_states, int num_controls, double step_length, std::vector<CostTerm> terms)
    : n_(num_states), m_(num_controls), h_(step_length), terms_(std::move(terms)) {}

double Cost::Value(const VectorX<double>& x, const VectorX<double>& u) const {
  double sum = 0.0;
  for (const CostTerm& term : terms_) {
    if (term.at_end) continue;
    const double r = Evaluate(term, x, u).value;
    sum += 0.5 * term.weight * r * r;
  }
  return h_ * sum;
}

double Cost::EndValue(const VectorX<double>& x) const {
  double sum = 0.0;
  for (const CostTerm& term : terms_) {
    if (!term.at_end) continue;
    const double r = Evaluate(term, x, VectorX<double>()).value;
    sum += 0.5 * term.weight * r * r;
  }
  return sum;
}

double Cost::ValueOfUnits(long steps) const {
  double sum = 0.0;
  for (const CostTerm& term : terms_) {
    const double unit = std::max(1.0, std::abs(term.target));
    const double times = term.at_end ? 1.0 : h_ * static_cast<double>(steps);
    sum += 0.5 * times * term.weight * unit * unit;
  }
  return sum;
}

bool Cost::HasAngleAtMaximum(const RowMatrixXd& states) const {
  const long end = states.rows() - 1;
  for (const CostTerm& term : terms_) {
    if (term.kind != CostTerm::Kind::kAngle || term.weight == 0.0) continue;
    for (long k = term.at_end ? end : 0; k < (term.at_end ? end + 1 : end); ++k) {
      const double slope = Evaluate(term, states.row(k), VectorX<double>()).by_variable;
      if (std::abs(slope) <= kAtMaximum) return true;
    }
  }
  return false;
}

void Cost::Add(const CostTerm& term, double factor, const VectorX<double>& x,
               const VectorX<double>& u, bool exact, CostExpansion* out) const {
  const Residual r = Evaluate(term, x, u);
  const double w = factor * term.weight;
  const double curvature = exact ? w * r.value * r.curvature : 0.0;
  out->value += 0.5 * w * r.value * r.value;
  if (term.kind == CostTerm::Kind::kControl) {
    out->u[term.index] += w * r.value;
    out->uu(term.index, term.index) += w;
    return;
  }
  const bool point = term.kind == CostTerm::Kind::kPoint;
  const int i = point ? term.index + term.axis : term.index;
  out->x[i] += w * r.value * r.by_variable;
  out->xx(i, i) += w * r.by_variable * r.by_variable + (point ? 0.0 : curvature);
  if (point) {
    const int angle = term.index + 2;
    out->x[angle] += w * r.value * r.by_angle;
    out->xx(i, angle) += w * r.by_angle;
    out->xx(angle, i) += w * r.by_angle;
    out->xx(angle, angle) += w * r.by_angle * r.by_angle + curvature;
  }
}

void Cost::Expand(const VectorX<double>& x, const VectorX<double>& u, bool exact,
                  CostExpansion* expansion) const {
  expansion->SetZero(n_, m_);
  for (const CostTerm& term : terms_) {
    if (!term.at_end) Add(term, h_, x, u, exact, expansion);
  }
}

void Cost::ExpandEnd(const VectorX<double>& x, bool exact, CostExpansion* expansion) const {
  expansion->SetZero(n_, m_);
  for (const CostTerm& term : terms_) {
    if (term.at_end) Add(term, 1.0, x, VectorX<double>(), exact, expansion);
  }
}

}  // namespace tangible
