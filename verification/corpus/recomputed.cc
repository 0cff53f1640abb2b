// SPDX-License-Identifier: Apache-2.0
#include "tangible/verification/corpus/recomputed.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tangible::corpus {
namespace {

using Eigen::Index;
using Real = long double;
using Vector = VectorX<Real>;
using Matrix = MatrixX<Real>;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
// A body's speed counts as at least this fraction of the fastest one's.
constexpr Real kSlowest = 1e-6L;

Real Share(Real value, Real scale) {
  return value == 0 ? 0 : scale > 0 ? value / scale : HUGE_VALL;
}

// The positive part of −min(a, b), or min(a, b): the violation of a ≥ 0 ⊥ b ≥ 0.
Real Complementary(Real a, Real b) { return std::abs(std::min(a, b)); }

bool Finite(const std::vector<double>& values, size_t size) {
  return values.size() == size &&
         std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

// Signed and unsigned sums of the terms of each body's momentum balance.
class Balance {
 public:
  Balance(const ContactProblem<double>& problem, const ContactSolution<double>& x)
      : left(3 * problem.num_bodies), terms(3 * problem.num_bodies) {
    for (Index i = 0; i < left.size(); ++i) {
      const Real momentum = problem.load[i];
      const Real carried = static_cast<Real>(problem.mass[i]) * x.motion[i];
      left[i] = momentum - carried;
      terms[i] = std::abs(momentum) + std::abs(carried);
    }
    ForEachImpulse(problem, x, [&](int body, const RowPart<double>& row, double impulse) {
      Push(body, row, impulse);
    });
  }

  Vector left, terms;

 private:
  void Push(int body, const RowPart<double>& row, Real impulse) {
    for (int i = 0; i < 3 && body >= 0; ++i) {
      left[3 * body + i] += row[i] * impulse;
      terms[3 * body + i] += std::abs(row[i] * impulse);
    }
  }
};

class ContactJudge {
 public:
  ContactJudge(const ContactProblem<double>& problem, const ContactSolution<double>& x)
      : problem_(problem), x_(x), balance_(problem, x) {
    // Impulses count up to the sum of all momenta.
    speed_.setZero(problem.num_bodies);
    lever_.setZero(problem.num_bodies);
    Real total = 0;
    for (int body = 0; body < problem.num_bodies; ++body) {
      lever_[body] = std::sqrt(Mass(body, 2) / Mass(body, 0));
      for (int i = 0; i < 3; ++i) {
        const Real length = i == 2 ? lever_[body] : 1;
        const Real free = problem.load[3 * body + i] / Mass(body, i);
        speed_[body] =
            std::max({speed_[body], length * std::abs(static_cast<Real>(x.motion[3 * body + i])),
                      length * std::abs(free)});
      }
      total += Mass(body, 0) * speed_[body];
    }
    const Real fastest = problem.num_bodies > 0 ? speed_.maxCoeff() : 0;
    for (int body = 0; body < problem.num_bodies; ++body) {
      const Real pushed =
          std::min(total, std::max({balance_.terms[3 * body], balance_.terms[3 * body + 1],
                                    balance_.terms[3 * body + 2] / lever_[body]}));
      speed_[body] = std::max({speed_[body], kSlowest * fastest, pushed / Mass(body, 0)});
    }
    for (const double impulse : x.normal_impulse) {
      impulse_ = std::max(impulse_, std::abs(static_cast<Real>(impulse)));
    }
  }

  Real Momentum() const {
    Real worst = 0;
    for (int body = 0; body < problem_.num_bodies; ++body) {
      Real left = 0, terms = 0;
      for (int i = 0; i < 3; ++i) {
        const Real length = i == 2 ? lever_[body] : 1;
        left = std::max(left, std::abs(balance_.left[3 * body + i]) / length);
        terms = std::max(terms, balance_.terms[3 * body + i] / length);
      }
      worst = std::max(worst, Share(left, terms));
    }
    return worst;
  }

  Real Joints() const {
    Real worst = 0;
    for (const JointBlock<double>& joint : problem_.joints) {
      for (int r = 0; r < joint.rows; ++r) {
        const Row row{joint.a, joint.b, joint.row_a[r], joint.row_b[r]};
        worst = std::max(worst, Share(std::abs(Speed(row) - joint.rhs[r]),
                                      Terms(row) + std::abs(static_cast<Real>(joint.rhs[r]))));
      }
    }
    return worst;
  }

  Real Contact(size_t i) const {
    const ContactBlock<double>& c = problem_.contacts[i];
    const Row normal{c.a, c.b, c.normal_a, c.normal_b};
    const Real sigma = Terms(normal) + std::abs(static_cast<Real>(c.c_n));
    const Real zeta = std::max(impulse_, Share(sigma, Mobility(normal)));
    const Real pushed = x_.normal_impulse[i];
    Real worst = Complementary(Share(pushed, zeta), Share(Speed(normal) + c.c_n, sigma));
    const Real rubbed = x_.tangent_impulse[i];
    if (!c.has_friction) return std::max(worst, Share(std::abs(rubbed), zeta));
    const Real mu = c.friction;
    const Row tangent{c.a, c.b, c.tangent_a, c.tangent_b};
    const Real slip = Speed(tangent) + c.c_t;
    const Real scale_t = Terms(tangent) + std::abs(static_cast<Real>(c.c_t));
    const Real zeta_t = zeta * std::max<Real>(1, mu);
    worst = std::max(worst, Share(std::max<Real>(0, std::abs(rubbed) - mu * pushed), zeta_t));
    // Where the contact slides, friction has its limit and opposes the sliding.
    const Real missing = std::abs(rubbed + (slip > 0 ? mu : -mu) * pushed);
    return std::max(worst, std::min(Share(std::abs(slip), scale_t), Share(missing, zeta_t)));
  }

 private:
  struct Row {
    int a, b;
    const RowPart<double>&row_a, &row_b;
  };
  Real Mass(int body, int i) const { return problem_.mass[3 * body + i]; }

  Real Speed(const Row& row) const {
    Real sum = 0;
    for (int i = 0; i < 3; ++i) {
      if (row.a >= 0) sum += static_cast<Real>(row.row_a[i]) * x_.motion[3 * row.a + i];
      if (row.b >= 0) sum += static_cast<Real>(row.row_b[i]) * x_.motion[3 * row.b + i];
    }
    return sum;
  }
  Real Terms(const Row& row) const { return OfBody(row.a, row.row_a) + OfBody(row.b, row.row_b); }
  Real OfBody(int body, const RowPart<double>& row) const {
    if (body < 0) return 0;
    return speed_[body] *
           std::max({std::abs(static_cast<Real>(row[0])), std::abs(static_cast<Real>(row[1])),
                     std::abs(static_cast<Real>(row[2])) / lever_[body]});
  }
  Real Mobility(const Row& row) const {
    Real sum = 0;
    for (int i = 0; i < 3; ++i) {
      if (row.a >= 0) sum += static_cast<Real>(row.row_a[i]) * row.row_a[i] / Mass(row.a, i);
      if (row.b >= 0) sum += static_cast<Real>(row.row_b[i]) * row.row_b[i] / Mass(row.b, i);
    }
    return sum;
  }

  const ContactProblem<double>& problem_;
  const ContactSolution<double>& x_;
  Balance balance_;
  Vector speed_, lever_;
  Real impulse_ = 0;
};

}  // namespace

double RecomputedResidual(const ContactProblem<double>& problem,
                          const ContactSolution<double>& solution) {
  const size_t contacts = problem.contacts.size();
  if (!Finite(solution.motion, problem.mass.size()) || !Finite(solution.normal_impulse, contacts) ||
      !Finite(solution.tangent_impulse, contacts) ||
      !Finite(solution.joint_impulse, 3 * problem.joints.size())) {
    return kInfinite;
  }
  const ContactJudge judge(problem, solution);
  Real worst = std::max(judge.Momentum(), judge.Joints());
  for (size_t i = 0; i < contacts; ++i) worst = std::max(worst, judge.Contact(i));
  return static_cast<double>(worst);
}

double RecomputedResidual(const MixedLcp<double>& problem, const VectorX<double>& v_in,
                          const VectorX<double>& y_in, const VectorX<double>& z_in) {
  const Index nv = problem.num_v(), ny = problem.num_y(), nz = problem.num_z();
  if (v_in.size() != nv || y_in.size() != ny || z_in.size() != nz || !v_in.allFinite() ||
      !y_in.allFinite() || !z_in.allFinite()) {
    return kInfinite;
  }
  // An absent block is replaced by one with its own rows.
  const auto real = [](const MatrixX<double>& block, Index rows, Index cols) -> Matrix {
    if (block.size() == 0) return Matrix::Zero(rows, cols);
    return block.cast<Real>();
  };
  const Matrix M = real(problem.M, nv, nv), A = real(problem.A, ny, nv),
               G = real(problem.G, nz, nv), F = real(problem.F, nz, nz);
  const Vector p = problem.p.cast<Real>(), b = problem.b.cast<Real>(), c = problem.c.cast<Real>();
  const Vector v = v_in.cast<Real>(), y = y_in.cast<Real>(), z = z_in.cast<Real>();
  const Vector pushed = p.cwiseAbs() + A.cwiseAbs().transpose() * y.cwiseAbs() +
                        G.cwiseAbs().transpose() * z.cwiseAbs();
  const Vector left = M * v - A.transpose() * y - G.transpose() * z - p;
  const Vector terms = M.cwiseAbs() * v.cwiseAbs() + pushed;
  // Impulses count up to those that the energy of all bodies could cause.
  Real root_energy = 0;
  for (Index j = 0; j < nv; ++j) {
    const Real mass = std::max<Real>(M(j, j), 0);
    root_energy += std::sqrt(mass) * std::abs(v[j]);
    if (mass > 0) root_energy += std::abs(p[j]) / std::sqrt(mass);
  }
  Vector speed = v.cwiseAbs();
  Vector mobility = F.diagonal();
  for (Index j = 0; j < nv; ++j) {
    if (!(M(j, j) > 0)) continue;
    speed[j] = std::max(speed[j], std::min(pushed[j] / M(j, j), root_energy / std::sqrt(M(j, j))));
    mobility += G.col(j).cwiseAbs2() / M(j, j);
  }
  Real worst = 0;
  for (Index j = 0; j < nv; ++j) worst = std::max(worst, Share(std::abs(left[j]), terms[j]));
  const Vector joint = A * v - b, joint_terms = A.cwiseAbs() * speed + b.cwiseAbs();
  for (Index j = 0; j < ny; ++j) worst = std::max(worst, Share(std::abs(joint[j]), joint_terms[j]));

  const Vector s = G * v + F * z + c;
  const Vector sigma = G.cwiseAbs() * speed + F.cwiseAbs() * z.cwiseAbs() + c.cwiseAbs();
  Real largest[2] = {0, 0};
  const auto kind = [&](Index i) { return nv > 0 && !G.row(i).isZero(0) ? 0 : 1; };
  for (Index i = 0; i < nz; ++i) largest[kind(i)] = std::max(largest[kind(i)], std::abs(z[i]));
  for (Index i = 0; i < nz; ++i) {
    Real zeta = mobility[i] > 0 ? sigma[i] / mobility[i] : 0;
    for (Index k = 0; k < nz && !(mobility[i] > 0); ++k) {
      if (F(k, i) != 0) zeta = std::max(zeta, sigma[k] / std::abs(F(k, i)));
    }
    zeta = std::max(zeta, largest[kind(i)]);
    worst = std::max(worst, Complementary(Share(z[i], zeta), Share(s[i], sigma[i])));
  }
  return static_cast<double>(worst);
}

bool ProvesInfeasible(const MixedLcp<double>& problem, const VectorX<double>& farkas) {
  const Index nv = problem.num_v(), ny = problem.num_y(), nz = problem.num_z();
  if (farkas.size() != nv + ny + nz || !farkas.allFinite()) return false;
  const Vector all = farkas.cast<Real>();
  const auto u = [&](Index j) { return all[j]; };
  const auto t = [&](Index j) { return all[nv + j]; };
  const auto w = [&](Index j) { return all[nv + ny + j]; };
  // A sum of products, and the sum of their sizes; the entry of an absent block is 0.
  struct Sum {
    Real value = 0, size = 0;
    void Add(Real term) {
      value += term;
      size += std::abs(term);
    }
  };
  constexpr Real kRounding = 1e-10L;
  for (Index i = 0; i < nz; ++i) {
    if (w(i) < 0) return false;
    Sum row;
    for (Index k = 0; k < nz; ++k) row.Add(w(k) * problem.F(k, i));
    for (Index j = 0; j < nv; ++j) row.Add(-u(j) * problem.G(i, j));
    if (row.value > kRounding * row.size) return false;
  }
  for (Index j = 0; j < nv; ++j) {
    Sum momentum;
    for (Index k = 0; k < nv; ++k) momentum.Add(problem.M(k, j) * u(k));
    for (Index k = 0; k < ny; ++k) momentum.Add(problem.A(k, j) * t(k));
    for (Index k = 0; k < nz; ++k) momentum.Add(problem.G(k, j) * w(k));
    if (std::abs(momentum.value) > kRounding * momentum.size) return false;
  }
  for (Index k = 0; k < ny; ++k) {
    Sum joint;
    for (Index j = 0; j < nv; ++j) joint.Add(problem.A(k, j) * u(j));
    if (std::abs(joint.value) > kRounding * joint.size) return false;
  }
  Sum delta;
  for (Index j = 0; j < nv; ++j) delta.Add(u(j) * problem.p[j]);
  for (Index j = 0; j < ny; ++j) delta.Add(t(j) * problem.b[j]);
  for (Index j = 0; j < nz; ++j) delta.Add(-w(j) * problem.c[j]);
  return delta.value > 0 && delta.value >= 1e-6L * delta.size;
}

}  // namespace tangible::corpus
