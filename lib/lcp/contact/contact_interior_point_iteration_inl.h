// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The iteration of contact_interior_point.h; included by contact_interior_point.cc, and by
// verification's file for another scalar.

#include <algorithm>
#include <cmath>

#include "tangible/lcp/contact/contact_interior_point_inl.h"
#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {
namespace internal {

// The step as a fraction of the way to the boundary; near 1 at the end, so that convergence stays
// fast.
inline constexpr double kStepToBoundary = 0.995;
inline constexpr double kShortening = 0.8;
inline constexpr int kMaxShortenings = 20;
// After a step shorter than this the next one returns to the central path, without the second-order
// term.
inline constexpr double kRecentreBelow = 0.2;
inline constexpr double kRecentring = 0.5;
// This many short steps in a row mean that rounding has stopped the iteration.
inline constexpr int kMaxShortSteps = 20;

template <typename T>
class ContactIteration : private InteriorPointSystem<T> {
 public:
  using Base = InteriorPointSystem<T>;
  using Base::Base;
  using Base::nb_, Base::nc_, Base::nj_, Base::p_, Base::w_;
  using Base::Used;

  void Start() {
    this->SetPattern();
    SetScales();
    const auto zero = [](std::vector<T>* x, size_t n) { x->assign(n, T(0.0)); };
    zero(&w_.v, 3 * nb_);
    zero(&w_.y, 3 * nj_);
    zero(&w_.z, 3 * nc_);
    zero(&w_.s, 3 * nc_);
    zero(&w_.ds, 3 * nc_);
    zero(&w_.ds_affine, 3 * nc_);
    zero(&w_.target, 3 * nc_);
    for (int i = 0; i < 3 * nb_; ++i) {
      w_.v[i] = p_.load[i] / p_.mass[i];
    }
    for (int i = 0; i < 3 * nc_; ++i) {
      if (Used(i)) {
        w_.z[i] = T(w_.unit_z[i]);
        w_.s[i] = T(w_.unit_s[i]);
      } else if (i % 3 == 0) {
        w_.z[i] = p_.contacts[i / 3].offset;
      }
    }
  }

  // Mean of z s / κ over the rows, by value.
  double Complementarity() const {
    double sum = 0.0;
    int count = 0;
    for (int i = 0; i < 3 * nc_; ++i) {
      if (Used(i)) {
        sum += ValueOf(w_.z[i]) * ValueOf(w_.s[i]) / Unit(i);
        ++count;
      }
    }
    return count > 0 ? sum / count : 0.0;
  }

  // Length of the last step taken, in [0, 1].
  double LastStep() const { return last_step_; }

  // One predictor-corrector step; false where the linear system is singular or the step is not
  // finite.
  bool Step() {
    this->Assemble();
    if (!w_.lu.Factor()) {
      return false;
    }
    Residuals();
    const double mean_product = Complementarity();
    for (int i = 0; i < 3 * nc_; ++i) {
      w_.target[i] = -w_.s[i] * w_.z[i];
    }
    Direction();
    w_.ds_affine = w_.ds;
    w_.affine = w_.step;
    const double affine_alpha = std::min(1.0, ValueOf(BoundaryStep()));
    const double ratio =
        mean_product > 0.0 ? AffineComplementarity(affine_alpha) / mean_product : 0.0;
    const bool recentre = last_step_ < kRecentreBelow;
    const double centring = std::max(ratio * ratio * ratio, recentre ? kRecentring : 0.0);
    const double second_order = recentre ? 0.0 : 1.0;
    for (int i = 0; i < 3 * nc_; ++i) {
      if (Used(i)) {
        w_.target[i] = centring * mean_product * Unit(i) - w_.s[i] * w_.z[i] -
                       second_order * w_.ds_affine[i] * Dz(w_.affine, i);
      }
    }
    Direction();
    T alpha = kStepToBoundary * BoundaryStep();
    if (ValueOf(alpha) > 1.0) {
      alpha = T(1.0);
    }
    alpha *= CentredFraction(ValueOf(alpha));
    last_step_ = ValueOf(alpha);
    return Advance(alpha);
  }

  // Largest violation of the three equations, relative to their units.
  double Violation() {
    Residuals();
    double worst = 0.0;
    for (int i = 0; i < 3 * nc_; ++i) {
      if (Used(i)) {
        worst = std::max(worst, std::abs(ValueOf(Residual(nb_ + nj_, i))) / w_.unit_s[i]);
      }
    }
    return worst;
  }

  void Extract(ContactSolution<T>* solution) const {
    solution->motion = w_.v;
    solution->joint_impulse = w_.y;
    solution->normal_impulse.assign(nc_, T(0.0));
    solution->tangent_impulse.assign(nc_, T(0.0));
    solution->modes.assign(nc_, ContactMode::kOpen);
    for (int i = 0; i < nc_; ++i) {
      const ContactBlock<T>& contact = p_.contacts[i];
      solution->normal_impulse[i] = w_.z[3 * i];
      if (contact.has_friction) {
        solution->tangent_impulse[i] = w_.z[3 * i + 1] - contact.friction * w_.z[3 * i];
      }
      solution->modes[i] = Mode(i);
    }
  }

 private:
  double Unit(int row) const { return w_.unit_z[row] * w_.unit_s[row]; }
  const T& Dz(const std::vector<T>& step, int row) const { return step[3 * (nb_ + nj_) + row]; }
  T& Residual(int block, int row) { return w_.residual[3 * block + row]; }

  // Whether z rather than s of a row is positive at the solution.
  bool ImpulseDominates(int row) const {
    return ValueOf(w_.z[row]) / w_.unit_z[row] > ValueOf(w_.s[row]) / w_.unit_s[row];
  }

  ContactMode Mode(int i) const {
    if (Used(3 * i) && !ImpulseDominates(3 * i)) {
      return ContactMode::kOpen;
    }
    if (!p_.contacts[i].has_friction) {
      return ContactMode::kClosed;
    }
    if (!ImpulseDominates(3 * i + 1)) {
      return ContactMode::kSlidingPositive;
    }
    return ImpulseDominates(3 * i + 2) ? ContactMode::kSlidingNegative : ContactMode::kSticking;
  }

  void SetScales() {
    // One speed scale is used for all contacts: with a scale for each contact a third of the
    // problems of a settling pile were not solved.
    double speed = 0.0;
    for (const ContactBlock<T>& c : p_.contacts) {
      const double c_n = ValueOf(c.c_n);
      const double c_t = ValueOf(c.c_t);
      double n = c_n;
      double t = c_t;
      const auto add = [&](int block, const RowPart<T>& normal, const RowPart<T>& tangent) {
        for (int i = 0; i < 3 && block >= 0; ++i) {
          const double v = ValueOf(p_.load[3 * block + i]) / ValueOf(p_.mass[3 * block + i]);
          n += ValueOf(normal[i]) * v;
          t += ValueOf(tangent[i]) * v;
        }
      };
      add(c.a, c.normal_a, c.tangent_a);
      add(c.b, c.normal_b, c.tangent_b);
      speed = std::max({speed, std::abs(c_n), std::abs(c_t), std::abs(n), std::abs(t)});
    }
    if (speed == 0.0) {
      speed = 1.0;
    }
    w_.unit_z.assign(3 * nc_, 1.0);
    w_.unit_s.assign(3 * nc_, 1.0);
    for (int i = 0; i < nc_; ++i) {
      const ContactBlock<T>& c = p_.contacts[i];
      if (Used(3 * i)) {
        w_.unit_s[3 * i] = speed;
        w_.unit_z[3 * i] = speed / RowMobility(p_.mass, c.a, c.normal_a, c.b, c.normal_b);
      }
      if (c.has_friction) {
        const double impulse = speed / RowMobility(p_.mass, c.a, c.tangent_a, c.b, c.tangent_b);
        w_.unit_s[3 * i + 1] = speed;
        w_.unit_z[3 * i + 1] = impulse;
        // The cone row's slack is 2 μ λn − τ⁺: its unit grows with max(1, μ), so that μ up to 1e6
        // works.
        w_.unit_s[3 * i + 2] = impulse * std::max(1.0, 2.0 * ValueOf(c.friction));
        w_.unit_z[3 * i + 2] = speed;
      }
    }
  }

  // residual := right-hand side of the Newton system except for the complementarity rows.
  void Residuals() {
    w_.residual.assign(3 * (nb_ + nj_ + nc_), T(0.0));
    T* r = w_.residual.data();
    const T* v = w_.v.data();
    for (int i = 0; i < 3 * nb_; ++i) {
      r[i] = p_.load[i] - p_.mass[i] * v[i];
    }
    for (const DamperBlock<T>& d : p_.dampers) {
      const T impulse = -d.weight * RowDot(d.a, d.row_a, d.b, d.row_b, v);
      AddRowTransposed(d.a, d.row_a, d.b, d.row_b, impulse, r);
    }
    for (int j = 0; j < nj_; ++j) {
      const JointBlock<T>& joint = p_.joints[j];
      for (int k = 0; k < joint.rows; ++k) {
        AddJointRowTransposed(joint, k, w_.y[3 * j + k], r);
        r[3 * (nb_ + j) + k] = joint.rhs[k] - JointRowDot(joint, k, v);
      }
    }
    for (int i = 0; i < nc_; ++i) {
      const ContactBlock<T>& c = p_.contacts[i];
      const T* z = &w_.z[3 * i];
      const T* s = &w_.s[3 * i];
      T* out = r + 3 * (nb_ + nj_ + i);
      AddRowTransposed(c.a, c.normal_a, c.b, c.normal_b, z[0], r);
      if (Used(3 * i)) {
        out[0] = s[0] - c.c_n - RowDot(c.a, c.normal_a, c.b, c.normal_b, v);
      }
      if (c.has_friction) {
        const T tangential = z[1] - c.friction * z[0];
        AddRowTransposed(c.a, c.tangent_a, c.b, c.tangent_b, tangential, r);
        out[1] = s[1] - c.c_t - RowDot(c.a, c.tangent_a, c.b, c.tangent_b, v) - z[2];
        out[2] = s[2] - 2.0 * c.friction * z[0] + z[1];
      }
    }
  }

  // Computes the Newton direction for z ds + s dz = target; fills step and ds. With ds = (target −
  // s dz) / z the rows G dv + F dz − ds = r become G dv + (F + diag(s / z)) dz = r + target / z.
  void Direction() {
    w_.step = w_.residual;
    T* contact_rows = w_.step.data() + 3 * (nb_ + nj_);
    for (int i = 0; i < 3 * nc_; ++i) {
      if (Used(i)) {
        contact_rows[i] += w_.target[i] / w_.z[i];
      }
    }
    w_.rhs = w_.step;
    w_.lu.Solve(w_.step.data(), 1);
    this->Refine();
    for (int i = 0; i < 3 * nc_; ++i) {
      if (Used(i)) {
        w_.ds[i] = (w_.target[i] - w_.s[i] * contact_rows[i]) / w_.z[i];
      }
    }
  }

  // The largest α that keeps z + α dz and s + α ds at or above 0 (a large number if nothing
  // shrinks).
  T BoundaryStep() const {
    T alpha(1e3);
    for (int i = 0; i < 3 * nc_; ++i) {
      if (!Used(i)) {
        continue;
      }
      const T& dz = Dz(w_.step, i);
      if (ValueOf(dz) < 0.0 && ValueOf(alpha) * ValueOf(dz) < -ValueOf(w_.z[i])) {
        alpha = -w_.z[i] / dz;
      }
      if (ValueOf(w_.ds[i]) < 0.0 && ValueOf(alpha) * ValueOf(w_.ds[i]) < -ValueOf(w_.s[i])) {
        alpha = -w_.s[i] / w_.ds[i];
      }
    }
    return alpha;
  }

  double AffineComplementarity(double alpha) const {
    double sum = 0.0;
    int count = 0;
    for (int i = 0; i < 3 * nc_; ++i) {
      if (Used(i)) {
        sum += (ValueOf(w_.z[i]) + alpha * ValueOf(Dz(w_.affine, i))) *
               (ValueOf(w_.s[i]) + alpha * ValueOf(w_.ds_affine[i])) / Unit(i);
        ++count;
      }
    }
    return count > 0 ? std::max(0.0, sum / count) : 0.0;
  }

  // The fraction of the step after which no product z s has fallen far below the mean: friction
  // makes the problem non-monotone, and from a point too close to the boundary the iteration makes
  // no progress.
  double CentredFraction(double alpha) const {
    double fraction = 1.0;
    for (int trial = 0; trial < kMaxShortenings; ++trial) {
      double sum = 0.0;
      double least = HUGE_VAL;
      int count = 0;
      for (int i = 0; i < 3 * nc_; ++i) {
        if (Used(i)) {
          const double product = (ValueOf(w_.z[i]) + fraction * alpha * ValueOf(Dz(w_.step, i))) *
                                 (ValueOf(w_.s[i]) + fraction * alpha * ValueOf(w_.ds[i])) /
                                 Unit(i);
          sum += product;
          least = std::min(least, product);
          ++count;
        }
      }
      if (count == 0 || least >= kNeighbourhood * sum / count) {
        return fraction;
      }
      fraction *= kShortening;
    }
    return 1.0;  // already off the path: only the boundary limits the step
  }

  bool Advance(const T& alpha) {
    for (const T& x : w_.step) {
      if (!std::isfinite(ValueOf(x))) {
        return false;
      }
    }
    const T* step = w_.step.data();
    for (int i = 0; i < 3 * nb_; ++i) {
      w_.v[i] += alpha * step[i];
    }
    for (int i = 0; i < 3 * nj_; ++i) {
      w_.y[i] += alpha * step[3 * nb_ + i];
    }
    for (int i = 0; i < 3 * nc_; ++i) {
      if (Used(i)) {
        w_.z[i] += alpha * step[3 * (nb_ + nj_) + i];
        w_.s[i] += alpha * w_.ds[i];
      }
    }
    return true;
  }

  double last_step_ = 1.0;
};

}  // namespace internal

template <typename T>
InteriorPointOutcome SolveContactsByInteriorPoint(const ContactProblem<T>& problem,
                                                  const ContactInteriorPointOptions& options,
                                                  InteriorPointWorkspace<T>* workspace,
                                                  ContactSolution<T>* solution) {
  internal::ContactIteration<T> iteration(problem, options, workspace);
  InteriorPointOutcome outcome;
  if (!options.resume) {
    iteration.Start();
  }
  outcome.complementarity = iteration.Complementarity();
  // At least two steps are taken: the first makes the equations hold, which they need not at a
  // neutral start.
  int short_steps = 0;
  while (outcome.iterations < options.max_iterations && short_steps < internal::kMaxShortSteps) {
    if (!iteration.Step()) {
      break;
    }
    ++outcome.iterations;
    const double before = outcome.complementarity;
    outcome.complementarity = iteration.Complementarity();
    if (before <= kArrived && outcome.complementarity > 0.5 * before &&
        iteration.Violation() <= kEquationsHold) {
      outcome.converged = true;  // as far as rounding lets it
      break;
    }
    short_steps = iteration.LastStep() < kShortInteriorStep ? short_steps + 1 : 0;
    if ((outcome.iterations >= 2 || options.resume) &&
        outcome.complementarity <= options.complementarity &&
        iteration.Violation() <= kEquationsHold) {
      outcome.converged = true;
      break;
    }
  }
  iteration.Extract(solution);
  return outcome;
}

}  // namespace tangible
