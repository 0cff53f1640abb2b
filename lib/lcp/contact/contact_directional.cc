// SPDX-License-Identifier: Apache-2.0
#include "tangible/lcp/contact/contact_directional.h"

#include <algorithm>
#include <cmath>

#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/dense/solver.h"
#include "tangible/lcp/system/contact_residual.h"

namespace tangible {
namespace {

using Kind = ContactKink::Kind;

RowPart<double> Scaled(double factor, const RowPart<double>& row) {
  return {factor * row[0], factor * row[1], factor * row[2]};
}

ContactKink KinkOf(const ContactProblem<double>& problem, const ContactSolution<double>& solution,
                   const ContactScales& scales, size_t i, bool touching, double tolerance) {
  const ContactBlock<double>& c = problem.contacts[i];
  if (c.rolls && solution.modes[i] == ContactMode::kOpen) return {};
  const double* v = solution.motion.data();
  const ContactValues values = Evaluate(problem, scales, c, v);
  const double normal = solution.normal_impulse[i];
  const double normal_scale = NormalScale(c, values, scales.impulse);
  const bool loaded = c.limit_given || (!touching && normal > tolerance * normal_scale);
  const double along = values.slip > 0.0 ? 1.0 : -1.0;
  if (!loaded) {
    if (!touching && std::abs(values.s_n) > tolerance * values.scale_n) {
      return {};
    }
    if (!c.has_friction) {
      return {Kind::kTouches, 0.0};
    }
    const bool rests = std::abs(values.slip) <= tolerance * values.scale_t;
    return rests ? ContactKink{Kind::kTouchesAtRest, 0.0} : ContactKink{Kind::kTouches, along};
  }
  if (!c.has_friction) {
    const bool has_tangent =
        std::any_of(c.tangent_a.begin(), c.tangent_a.end(), [](double x) { return x != 0.0; });
    return has_tangent && FrictionlessSlidingSign(problem, c, v) == 0.0
               ? ContactKink{Kind::kFrictionFromZero, 0.0}
               : ContactKink{};
  }
  const double tangent = solution.tangent_impulse[i];
  const double tangent_scale =
      std::max(normal_scale * c.friction, values.scale_t / values.mobility_t);
  if (std::abs(values.slip) <= tolerance * values.scale_t &&
      c.friction * normal - std::abs(tangent) <= tolerance * tangent_scale) {
    return {Kind::kFrictionLimit, tangent > 0.0 ? -1.0 : 1.0};
  }
  return {};
}

double Mobility(const ContactProblem<double>& problem, const ContactBlock<double>& c) {
  return std::max(RowMobility(problem.mass, c.a, c.normal_a, c.b, c.normal_b),
                  RowMobility(problem.mass, c.a, c.tangent_a, c.b, c.tangent_b));
}

}  // namespace

void FindKinks(const ContactProblem<double>& problem, const ContactSolution<double>& solution,
               const std::vector<bool>& touching, double tolerance,
               std::vector<ContactKink>* kinks) {
  const ContactScales scales(problem, solution);
  kinks->clear();
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    kinks->push_back(KinkOf(problem, solution, scales, i, touching[i], tolerance));
  }
}

bool ContactDirectional::Factor(const ContactProblem<double>& problem,
                                const ContactSolution<double>& solution,
                                const std::vector<ContactKink>& kinks) {
  problem_ = &problem;
  solution_ = &solution;
  kinks_ = kinks;
  row_modes_ = base_modes_ = solution.modes;
  row_blocks_.assign(kinks.size(), -1);
  num_blocks_ = problem.num_bodies + static_cast<int>(problem.joints.size());
  for (size_t i = 0; i < kinks.size(); ++i) {
    switch (kinks[i].kind) {
      case Kind::kNone:
        break;
      case Kind::kTouches:
        base_modes_[i] = ContactMode::kOpen;
        row_modes_[i] =
            problem.contacts[i].has_friction ? ContactMode::kSticking : ContactMode::kClosed;
        break;
      case Kind::kTouchesAtRest:
        base_modes_[i] = ContactMode::kOpen;
        row_modes_[i] = ContactMode::kSticking;
        break;
      case Kind::kFrictionLimit:
        base_modes_[i] =
            kinks[i].sign > 0.0 ? ContactMode::kSlidingPositive : ContactMode::kSlidingNegative;
        row_modes_[i] = ContactMode::kSticking;
        break;
      case Kind::kFrictionFromZero:
        base_modes_[i] = ContactMode::kClosed;
        row_modes_[i] = ContactMode::kSticking;
        break;
    }
    if (row_modes_[i] != ContactMode::kOpen) {
      row_blocks_[i] = num_blocks_++;
    }
  }
  ListRows();
  if (!base_.Factor(problem, base_modes_)) {
    return false;
  }
  MakeMatrix();
  return true;
}

void ContactDirectional::ListRows() {
  rows_.clear();
  for (size_t i = 0; i < kinks_.size(); ++i) {
    const ContactBlock<double>& c = problem_->contacts[i];
    const int contact = static_cast<int>(i);
    const auto normal = [&](double along) {
      rows_.push_back({contact, Part::kNormal, c.normal_a, c.normal_b,
                       Combine(c.normal_a, along, c.tangent_a),
                       Combine(c.normal_b, along, c.tangent_b), 0.0});
    };
    const auto tangent = [&](double factor) {
      const RowPart<double> a = Scaled(factor, c.tangent_a);
      const RowPart<double> b = Scaled(factor, c.tangent_b);
      rows_.push_back({contact, Part::kTangent, a, b, a, b, factor});
    };
    switch (kinks_[i].kind) {
      case Kind::kNone:
        break;
      case Kind::kTouches:
        normal(-kinks_[i].sign * c.friction);
        break;
      case Kind::kTouchesAtRest:
        normal(-c.friction);
        tangent(1.0);
        rows_.push_back({contact, Part::kSpeed, {}, {}, {}, {}, 0.0});
        break;
      case Kind::kFrictionLimit:
        tangent(kinks_[i].sign);
        break;
      case Kind::kFrictionFromZero:
        tangent(1.0);
        rows_.push_back({contact, Part::kSpeed, {}, {}, {}, {}, 0.0});
        break;
    }
  }
}

void ContactDirectional::MakeMatrix() {
  const int columns = static_cast<int>(rows_.size());
  const size_t size = 3 * static_cast<size_t>(base_.num_blocks());
  by_z_.assign(size * columns, 0.0);
  W_ = MatrixX<double>::Zero(columns, columns);
  if (columns == 0) {
    return;
  }
  std::vector<double> pushed(3 * static_cast<size_t>(problem_->num_bodies));
  for (int k = 0; k < columns; ++k) {
    const ContactBlock<double>& c = problem_->contacts[rows_[k].contact];
    std::fill(pushed.begin(), pushed.end(), 0.0);
    AddRowTransposed(c.a, rows_[k].push_a, c.b, rows_[k].push_b, 1.0, pushed.data());
    for (size_t i = 0; i < pushed.size(); ++i) {
      by_z_[i * columns + k] = pushed[i];
    }
  }
  base_.Solve(*problem_, base_modes_, by_z_.data(), columns);
  std::vector<double> v(pushed.size());
  for (int l = 0; l < columns; ++l) {
    for (size_t i = 0; i < v.size(); ++i) {
      v[i] = by_z_[i * columns + l];
    }
    const double mobility_l = Mobility(*problem_, problem_->contacts[rows_[l].contact]);
    for (int k = 0; k < columns; ++k) {
      const ContactBlock<double>& c = problem_->contacts[rows_[k].contact];
      const double value = RowDot(c.a, rows_[k].row_a, c.b, rows_[k].row_b, v.data());
      const double scale = std::sqrt(mobility_l * Mobility(*problem_, c));
      W_(k, l) = std::abs(value) <= kDirectionRounding * scale ? 0.0 : value;
    }
  }
  for (int k = 1; k < columns; ++k) {
    if (rows_[k].part == Part::kSpeed) {
      W_(k - 1, k) = 1.0;
      W_(k, k - 1) = -1.0;
      if (kinks_[rows_[k].contact].kind == Kind::kTouchesAtRest) {
        W_(k, k - 2) = 2.0 * problem_->contacts[rows_[k].contact].friction;
      }
    }
  }
}

// The right-hand side of the base system: its rows of r, and the change of friction at given normal
// impulses.
void ContactDirectional::FillBase(const std::vector<double>& r, const std::vector<double>& friction,
                                  std::vector<double>* x) const {
  x->assign(3 * static_cast<size_t>(base_.num_blocks()), 0.0);
  const size_t common = 3 * (static_cast<size_t>(problem_->num_bodies) + problem_->joints.size());
  std::copy_n(r.begin(), common, x->begin());
  for (size_t i = 0; i < kinks_.size(); ++i) {
    if (const int block = base_.contact_block()[i]; block >= 0) {
      (*x)[3 * block] = r[3 * row_blocks_[i]];
      if (base_modes_[i] == ContactMode::kSticking) {
        (*x)[3 * block + 1] = r[3 * row_blocks_[i] + 1];
      }
    }
    const ContactBlock<double>& c = problem_->contacts[i];
    double tangent = 0.0;
    if (kinks_[i].kind == Kind::kFrictionLimit) {
      tangent = -kinks_[i].sign * friction[i] * solution_->normal_impulse[i];
    } else if (kinks_[i].kind == Kind::kFrictionFromZero) {
      tangent = -std::max(0.0, friction[i]) * solution_->normal_impulse[i];
    }
    AddRowTransposed(c.a, c.tangent_a, c.b, c.tangent_b, tangent, x->data());
  }
}

bool ContactDirectional::Contradicts(const std::vector<double>& rhs,
                                     const std::vector<double>& x) const {
  double driven = 0.0;
  for (size_t i = 0; i < rhs.size(); ++i) {
    const double mass = i < problem_->mass.size() ? problem_->mass[i] : 1.0;
    driven = std::max(
        {driven, std::abs(rhs[i]) / mass, i < problem_->mass.size() ? std::abs(x[i]) : 0.0});
  }
  double impulse = 0.0;
  for (size_t i = 0; i < kinks_.size(); ++i) {
    if (const int block = base_.contact_block()[i]; block >= 0) {
      impulse = std::max(impulse, Mobility(*problem_, problem_->contacts[i]) *
                                      std::max(std::abs(x[3 * block]), std::abs(x[3 * block + 1])));
    }
  }
  return !(impulse <= kContradictingRate * driven);
}

VectorX<double> ContactDirectional::Constants(const std::vector<double>& r,
                                              const std::vector<double>& friction,
                                              const std::vector<double>& x) const {
  VectorX<double> q(static_cast<Eigen::Index>(rows_.size()));
  double speed = 0.0;
  for (size_t i = 0; i < problem_->mass.size(); ++i) {
    speed = std::max(speed, std::abs(r[i]) / problem_->mass[i]);
  }
  for (size_t k = 0; k < rows_.size(); ++k) {
    const Row& row = rows_[k];
    const ContactBlock<double>& c = problem_->contacts[row.contact];
    double value = 0.0;
    double scale = 0.0;
    if (row.part == Part::kSpeed) {
      if (kinks_[row.contact].kind == Kind::kFrictionFromZero) {
        value = 2.0 * std::max(0.0, friction[row.contact]) * solution_->normal_impulse[row.contact];
      }
    } else {
      const int place = 3 * row_blocks_[row.contact] + (row.part == Part::kTangent ? 1 : 0);
      const double given = (row.part == Part::kTangent ? row.factor : 1.0) * r[place];
      value = RowDot(c.a, row.row_a, c.b, row.row_b, x.data()) - given;
      scale = speed + std::abs(given);
    }
    q[static_cast<Eigen::Index>(k)] = std::abs(value) <= kDirectionRounding * scale ? 0.0 : value;
  }
  return q;
}

ContactDirectional::Status ContactDirectional::Solve(const std::vector<double>& r,
                                                     const std::vector<double>& friction,
                                                     std::vector<double>* v_dot) {
  std::vector<double> rhs;
  FillBase(r, friction, &rhs);
  std::vector<double> x = rhs;
  base_.Solve(*problem_, base_modes_, x.data(), 1);
  if (Contradicts(rhs, x)) {
    return Status::kContradiction;
  }
  if (!rows_.empty()) {
    MixedLcp<double> lcp;
    lcp.F = W_;
    lcp.c = Constants(r, friction, x);
    const LcpSolution<double> solution = SolveLcp(lcp);
    if (solution.status != LcpStatus::kSolved) {
      return Status::kUnsolved;
    }
    const size_t columns = rows_.size();
    for (size_t i = 0; i < x.size(); ++i) {
      for (size_t k = 0; k < columns; ++k) {
        x[i] += by_z_[i * columns + k] * solution.z[static_cast<Eigen::Index>(k)];
      }
    }
  }
  v_dot->assign(x.begin(), x.begin() + 3 * static_cast<std::ptrdiff_t>(problem_->num_bodies));
  return Status::kSolved;
}

}  // namespace tangible
