// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The mixed LCP of a step of planar bodies, in its own structure: blocks of three unknowns (a twist
// each), joints of up to three rows, contacts with a normal and a tangent row.
//
//   M v − Aᵀ y − Σ_contacts (nᵀ λn + tᵀ λt) = p         momentum; M block diagonal plus dampers
//   A v = b                                             joints
//   s_n = n v + c_n ≥ 0,   λn ≥ 0,   s_n λn = 0         each contact
//   w = t v + c_t,   |λt| ≤ μ λn                        Coulomb
//   w > 0 ⇒ λt = −μ λn,   w < 0 ⇒ λt = μ λn
//
// Each row touches at most two blocks, the row of a coupling up to four. Units: v m/s and rad/s,
// p and impulses N s and N m s, M kg and kg m². Problems of the same form give accelerations (v
// m/s² and rad/s², p and λ N and N m) and corrections of poses (v m and rad, p and λ kg m and kg
// m²): hence `motion` for v and `load` for p.
//
// As a complementarity problem each contact with friction has three rows (the planar form of
// Pfeiffer and Glocker, Multibody Dynamics with Unilateral Contacts, 1996, ch. 6). The sliding
// speed is w = w⁺ − w⁻, its positive and negative parts, and λt = τ⁺ − μ λn:
//   s_n = n v + c_n        ⊥ λn
//   w⁺  = t v + c_t + w⁻   ⊥ τ⁺        τ⁺ = μ λn + λt
//   τ⁻  = 2 μ λn − τ⁺      ⊥ w⁻         τ⁻ = μ λn − λt
// An impact's decompression (contact_decompression.h) adds a least impulse o to a contact:
//   s_n = n v + c_n ≥ 0,   λn ≥ o,   s_n (λn − o) = 0
// Dry friction in a joint is a contact without a normal row: λn = o = h, and μ is the torque or
// force at which it slides. So is the rolling friction of the contact before it, with that
// contact's λn in the place of o: |torque| ≤ ρ λn against the relative angular velocity.
// The planar form has a unique, strictly complementary solution at a disc at rest, where the
// one-sided form of two friction rows has a continuum of solutions.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tangible/lcp/system/tolerances.h"
#include "tangible/math/scalar.h"

namespace tangible {

/// One constraint row on up to two blocks; −1: that body is prescribed or static (its part is in
/// the row's constant).
template <typename T>
using RowPart = std::array<T, 3>;

/// The mode of a contact at a solution.
enum class ContactMode : unsigned char {
  kOpen,             ///< λn = λt = 0
  kSticking,         ///< s_n = 0, w = 0
  kSlidingPositive,  ///< s_n = 0, λt = −μ λn
  kSlidingNegative,  ///< s_n = 0, λt = μ λn
  kClosed,           ///< s_n = 0, frictionless: λt = 0
};

/// σ in λt = −σ μ λn: the sign of sliding, 0 where friction does not follow λn.
inline double SlidingSign(ContactMode mode) {
  return mode == ContactMode::kSlidingPositive   ? 1.0
         : mode == ContactMode::kSlidingNegative ? -1.0
                                                 : 0.0;
}

template <typename T>
struct DamperBlock {
  int a = -1, b = -1;       ///< moving blocks, or −1
  RowPart<T> row_a, row_b;  ///< relative speed = row_a v_a + row_b v_b + known
  T weight;  ///< impulse a unit of relative speed (h c), added to M as weight rowᵀ row
};

template <typename T>
struct JointBlock {
  int a = -1, b = -1;
  int rows = 0;  ///< 1 to 3
  RowPart<T> row_a[3], row_b[3];
  T rhs[3];  ///< b, less what bodies of prescribed motion contribute
  /// Of a coupling, whose only row touches up to two more blocks; c < 0: it does not.
  int c = -1, d = -1;
  RowPart<T> row_c, row_d;
  /// Factors of the proximal terms of its rows: what redundant rows leave open is shared in inverse
  /// proportion to them.
  std::array<double, 3> give{1.0, 1.0, 1.0};
};

template <typename T>
struct ContactBlock {
  int a = -1, b = -1;
  RowPart<T> normal_a, normal_b, tangent_a, tangent_b;
  T c_n;              ///< m/s
  T c_t;              ///< m/s, from bodies of prescribed motion
  T friction;         ///< μ
  bool has_friction;  ///< μ > 0: rows for it
  T offset = T(0.0);  ///< o ≥ 0, the least λn, N s
  /// The uncertainty of c_n, m/s: rounding of the positions from which the gap is computed. Modes
  /// are not changed for smaller violations.
  double rounding = 0.0;
  /// λn = o with s_n ≥ 0: in the mode system this equation stands in place of s_n = 0.
  bool driven = false;
  /// Friction with a given limit μ o: its normal rows are 0, and it is always driven.
  bool limit_given = false;
  /// Rolling friction of the contact before it: μ is ρ, m, and o repeats the λn of that contact at
  /// the solution. In the mode system a torque at its limit is a part of that λn's column, and its
  /// own λn is 0.
  bool rolls = false;
};

template <typename T>
struct ContactProblem {
  int num_bodies = 0;
  std::vector<T> mass;  ///< 3 num_bodies: diagonal of M
  std::vector<DamperBlock<T>> dampers;
  std::vector<T> load;  ///< p, 3 num_bodies
  std::vector<JointBlock<T>> joints;
  bool redundant_joints = false;  ///< joints form loops: their rows may be dependent
  bool has_rolling = false;       ///< whether some contact has rolling friction
  std::vector<ContactBlock<T>> contacts;
  /// p + Σ nᵀ o, empty where no contact has an offset; it gives the size of speeds. A body that the
  /// compression stopped has p = 0 to rounding, and is pushed from both sides.
  std::vector<T> pushed_load;

  const std::vector<T>& scale_load() const { return pushed_load.empty() ? load : pushed_load; }

  /// Empties the problem; its memory is kept.
  void Clear() {
    num_bodies = 0;
    mass.clear();
    dampers.clear();
    load.clear();
    joints.clear();
    redundant_joints = has_rolling = false;
    contacts.clear();
    pushed_load.clear();
  }
  /// Memory of the vectors.
  size_t bytes() const {
    return sizeof(T) * (mass.capacity() + load.capacity() + pushed_load.capacity()) +
           sizeof(DamperBlock<T>) * dampers.capacity() + sizeof(JointBlock<T>) * joints.capacity() +
           sizeof(ContactBlock<T>) * contacts.capacity();
  }
};

/// A solution; vectors are sized for the problem. Impulses of joints: 3 for each joint, unused rows
/// 0.
template <typename T>
struct ContactSolution {
  std::vector<T> motion;           ///< v, 3 num_bodies
  std::vector<T> joint_impulse;    ///< 3 num_joints
  std::vector<T> normal_impulse;   ///< for each contact
  std::vector<T> tangent_impulse;  ///< for each contact, signed
  std::vector<ContactMode> modes;  ///< for each contact

  /// Memory of the vectors.
  size_t bytes() const {
    return sizeof(T) * (motion.capacity() + joint_impulse.capacity() + normal_impulse.capacity() +
                        tangent_impulse.capacity()) +
           sizeof(ContactMode) * modes.capacity();
  }
};

/// x + factor y.
inline RowPart<double> Combine(const RowPart<double>& x, double factor, const RowPart<double>& y) {
  return {x[0] + factor * y[0], x[1] + factor * y[1], x[2] + factor * y[2]};
}

/// What the torque of rolling friction at its limit adds to the column of a contact's λn.
struct RollingColumn {
  double along = 0.0;  ///< −σ ρ, m; 0: none
  RowPart<double> row_a, row_b;

  RowPart<double> AddedTo(const RowPart<double>& column, const RowPart<double>& row) const {
    return along == 0.0 ? column : Combine(column, along, row);
  }
};
inline RollingColumn RollingColumnOf(const ContactProblem<double>& problem,
                                     const std::vector<ContactMode>& modes, size_t contact) {
  if (!problem.has_rolling || contact + 1 >= problem.contacts.size()) return {};
  const ContactBlock<double>& next = problem.contacts[contact + 1];
  if (!next.rolls) return {};
  return {-SlidingSign(modes[contact + 1]) * next.friction, next.tangent_a, next.tangent_b};
}

/// Repeats the normal impulses of contacts in the blocks of their rolling friction.
inline void TakeRollingLimits(const ContactSolution<double>& solution,
                              ContactProblem<double>* problem) {
  for (size_t i = 1; problem->has_rolling && i < problem->contacts.size(); ++i) {
    ContactBlock<double>& block = problem->contacts[i];
    if (block.rolls) block.offset = std::max(0.0, solution.normal_impulse[i - 1]);
  }
}

/// block += leftᵀ weight right, 3 x 3 by rows.
template <typename T>
void AddOuter(const RowPart<T>& left, const RowPart<T>& right, const T& weight, T* block) {
  for (int i = 0; i < 3; ++i) {
    const T scaled = weight * left[i];
    for (int j = 0; j < 3; ++j) {
      block[3 * i + j] += scaled * right[j];
    }
  }
}

/// row · v over the moving blocks.
template <typename T, typename V>
T RowDot(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b, const V* v) {
  T sum(0.0);
  if (a >= 0) {
    sum += row_a[0] * v[3 * a] + row_a[1] * v[3 * a + 1] + row_a[2] * v[3 * a + 2];
  }
  if (b >= 0) {
    sum += row_b[0] * v[3 * b] + row_b[1] * v[3 * b + 1] + row_b[2] * v[3 * b + 2];
  }
  return sum;
}

/// x += rowᵀ factor over the moving blocks.
template <typename T, typename F, typename X>
void AddRowTransposed(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b,
                      const F& factor, X* x) {
  for (int i = 0; i < 3 && a >= 0; ++i) {
    x[3 * a + i] += row_a[i] * factor;
  }
  for (int i = 0; i < 3 && b >= 0; ++i) {
    x[3 * b + i] += row_b[i] * factor;
  }
}

/// The same of row k of a joint.
template <typename T, typename V>
T JointRowDot(const JointBlock<T>& joint, int k, const V* v) {
  T sum = RowDot(joint.a, joint.row_a[k], joint.b, joint.row_b[k], v);
  if (joint.c >= 0) sum += RowDot(joint.c, joint.row_c, joint.d, joint.row_d, v);
  return sum;
}
template <typename T, typename F, typename X>
void AddJointRowTransposed(const JointBlock<T>& joint, int k, const F& factor, X* x) {
  AddRowTransposed(joint.a, joint.row_a[k], joint.b, joint.row_b[k], factor, x);
  if (joint.c >= 0) AddRowTransposed(joint.c, joint.row_c, joint.d, joint.row_d, factor, x);
}

/// visit(body, row, impulse) for every row of joints and contacts and each of its two bodies (−1:
/// not a moving one); tangent rows of contacts without friction too.
template <typename Visit>
void ForEachImpulse(const ContactProblem<double>& problem, const ContactSolution<double>& solution,
                    const Visit& visit) {
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    const JointBlock<double>& joint = problem.joints[j];
    for (int k = 0; k < joint.rows; ++k) {
      visit(joint.a, joint.row_a[k], solution.joint_impulse[3 * j + k]);
      visit(joint.b, joint.row_b[k], solution.joint_impulse[3 * j + k]);
    }
    if (joint.c >= 0) {
      visit(joint.c, joint.row_c, solution.joint_impulse[3 * j]);
      visit(joint.d, joint.row_d, solution.joint_impulse[3 * j]);
    }
  }
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    const ContactBlock<double>& contact = problem.contacts[i];
    visit(contact.a, contact.normal_a, solution.normal_impulse[i]);
    visit(contact.b, contact.normal_b, solution.normal_impulse[i]);
    visit(contact.a, contact.tangent_a, solution.tangent_impulse[i]);
    visit(contact.b, contact.tangent_b, solution.tangent_impulse[i]);
  }
}

/// The largest `give` of joints that may be redundant; 1 where there are none. Friction of a given
/// limit gives as much: it shares with supports what both hold by their friction.
template <typename T>
double LargestGive(const ContactProblem<T>& problem) {
  double give = 1.0;
  for (const JointBlock<T>& joint : problem.joints) {
    if (problem.redundant_joints && joint.rows > 0) give = std::max(give, joint.give[0]);
  }
  return give;
}

/// The sign of the sliding speed of a contact without friction, along which friction would act as
/// soon as μ exceeds 0; 0 where the speed is the rounding of its terms, at the solved or the free
/// twist (bodies that rest side by side): there the contact would stick.
inline double FrictionlessSlidingSign(const ContactProblem<double>& problem,
                                      const ContactBlock<double>& c, const double* v) {
  const double slip = RowDot(c.a, c.tangent_a, c.b, c.tangent_b, v) + c.c_t;
  const std::vector<double>& momentum = problem.scale_load();
  double terms = std::abs(c.c_t);
  const auto add = [&](int block, const RowPart<double>& row) {
    for (int i = 0; i < 3 && block >= 0; ++i) {
      const double free = momentum[3 * block + i] / problem.mass[3 * block + i];
      terms += std::abs(row[i]) * std::max(std::abs(v[3 * block + i]), std::abs(free));
    }
  };
  add(c.a, c.tangent_a);
  add(c.b, c.tangent_b);
  return std::abs(slip) <= kSlipRounding * terms ? 0.0 : slip > 0.0 ? 1.0 : -1.0;
}

}  // namespace tangible
