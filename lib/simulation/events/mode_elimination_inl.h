// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The linear system of given contact modes (lcp/system/contact_system.h) by elimination in the
// scalar itself, independently of any solve in double. Included by event_jets.cc alone.

#include <vector>

#include "tangible/lcp/dense/dense_lu.h"
#include "tangible/lcp/system/contact_problem.h"
#include "tangible/lcp/system/tolerances.h"
#include "tangible/simulation/events/tolerances.h"

namespace tangible {
namespace internal {

inline constexpr int kEliminationRefinements = 4;

}  // namespace internal

template <typename T>
class ModeElimination {
 public:
  /// Solves the problem with the given modes of its contacts, for bodies, normal impulses, and the
  /// tangential impulses of contacts that stick. `signs`: σ of the others in λt = −σ μ λn. Cost:
  /// the cube of the number of rows.
  static void Solve(const ContactProblem<T>& p, const std::vector<ContactMode>& modes,
                    const std::vector<double>& signs, ContactSolution<T>* out) {
    int size = 3 * p.num_bodies;
    for (const JointBlock<T>& joint : p.joints) {
      size += joint.rows;
    }
    std::vector<int> row_of(p.contacts.size(), -1);
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      if (modes[i] != ContactMode::kOpen) {
        row_of[i] = size;
        size += modes[i] == ContactMode::kSticking ? 2 : 1;
      }
    }
    VectorX<T> rhs(size);
    for (int i = 0; i < 3 * p.num_bodies; ++i) {
      rhs[i] = p.load[i];
    }
    int row = 3 * p.num_bodies;
    for (const JointBlock<T>& joint : p.joints) {
      for (int r = 0; r < joint.rows; ++r, ++row) {
        rhs[row] = joint.rhs[r];
      }
    }
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      if (row_of[i] >= 0) {
        rhs[row_of[i]] = p.contacts[i].rolls    ? T(0.0)
                         : p.contacts[i].driven ? p.contacts[i].offset
                                                : -p.contacts[i].c_n;
        if (modes[i] == ContactMode::kSticking) {
          rhs[row_of[i] + 1] = -p.contacts[i].c_t;
        }
      }
    }
    const MatrixX<T> exact = System(p, modes, signs, 0.0, row_of, size);
    DenseLu<T> lu;
    VectorX<T> x;
    if (lu.Compute(exact) && lu.pivot_ratio() > kSingularPivot) {
      x = lu.Solve(rhs);
    } else {
      lu.Compute(System(p, modes, signs, kContactRegularisation, row_of, size));
      x = lu.Solve(rhs);
      for (int k = 0; k < internal::kEliminationRefinements; ++k) {
        VectorX<T> left(size);
        for (int i = 0; i < size; ++i) {
          left[i] = rhs[i];
          for (int j = 0; j < size; ++j) {
            left[i] -= exact(i, j) * x[j];
          }
        }
        x += lu.Solve(left);
      }
    }
    out->motion.resize(3 * p.num_bodies);
    for (int i = 0; i < 3 * p.num_bodies; ++i) {
      out->motion[i] = x[i];
    }
    out->joint_impulse.assign(3 * p.joints.size(), T(0.0));
    row = 3 * p.num_bodies;
    for (size_t j = 0; j < p.joints.size(); ++j) {
      for (size_t r = 0; r < static_cast<size_t>(p.joints[j].rows); ++r, ++row) {
        out->joint_impulse[3 * j + r] = x[row];
      }
    }
    out->normal_impulse.assign(p.contacts.size(), T(0.0));
    out->tangent_impulse.assign(p.contacts.size(), T(0.0));
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      if (row_of[i] >= 0) {
        out->normal_impulse[i] = p.contacts[i].rolls ? out->normal_impulse[i - 1] : T(x[row_of[i]]);
        if (modes[i] == ContactMode::kSticking) {
          out->tangent_impulse[i] = x[row_of[i] + 1];
        }
      }
    }
  }

 private:
  // The mode system as a dense matrix; δ > 0 on its constraints' diagonal.
  static MatrixX<T> System(const ContactProblem<T>& p, const std::vector<ContactMode>& modes,
                           const std::vector<double>& signs, double delta,
                           const std::vector<int>& row_of, int size) {
    MatrixX<T> k = MatrixX<T>::Constant(size, size, T(0.0));
    const int bodies = 3 * p.num_bodies;
    for (int i = 0; i < bodies; ++i) {
      k(i, i) = p.mass[i];
    }
    for (const DamperBlock<T>& d : p.dampers) {
      AddProduct(d.a, d.row_a, d.b, d.row_b, d.weight, &k);
    }
    const auto add = [&](int row, int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b,
                         double gives = 1.0) {
      const double mobility = RowMobility(p.mass, a, row_a, b, row_b);
      k(row, row) += T(delta * gives * mobility);
      for (int i = 0; i < 3; ++i) {
        if (a >= 0) k(row, 3 * a + i) += row_a[i];
        if (b >= 0) k(row, 3 * b + i) += row_b[i];
      }
    };
    const auto add_force = [&](int column, int a, const RowPart<T>& row_a, int b,
                               const RowPart<T>& row_b, const T& factor) {
      for (int i = 0; i < 3; ++i) {
        if (a >= 0) k(3 * a + i, column) -= factor * row_a[i];
        if (b >= 0) k(3 * b + i, column) -= factor * row_b[i];
      }
    };
    const double give = LargestGive(p);
    int row = bodies;
    for (const JointBlock<T>& joint : p.joints) {
      for (int r = 0; r < joint.rows; ++r, ++row) {
        add(row, joint.a, joint.row_a[r], joint.b, joint.row_b[r], joint.give[r]);
        add_force(row, joint.a, joint.row_a[r], joint.b, joint.row_b[r], T(1.0));
        if (joint.c < 0) continue;
        add(row, joint.c, joint.row_c, joint.d, joint.row_d, joint.give[r]);
        add_force(row, joint.c, joint.row_c, joint.d, joint.row_d, T(1.0));
      }
    }
    for (size_t i = 0; i < p.contacts.size(); ++i) {
      const ContactBlock<T>& c = p.contacts[i];
      const int at = row_of[i];
      if (at < 0) {
        continue;
      }
      if (c.driven) {
        k(at, at) = T(1.0);
      } else {
        add(at, c.a, c.normal_a, c.b, c.normal_b);
      }
      add_force(at, c.a, c.normal_a, c.b, c.normal_b, T(1.0));
      if (modes[i] == ContactMode::kSticking) {
        add(at + 1, c.a, c.tangent_a, c.b, c.tangent_b, c.limit_given ? give : 1.0);
        add_force(at + 1, c.a, c.tangent_a, c.b, c.tangent_b, T(1.0));
      } else {
        // A torque at its limit follows the normal impulse of the contact before it.
        add_force(c.rolls ? row_of[i - 1] : at, c.a, c.tangent_a, c.b, c.tangent_b,
                  T(-signs[i] * c.friction));
      }
    }
    return k;
  }

  static void AddProduct(int a, const RowPart<T>& row_a, int b, const RowPart<T>& row_b,
                         const T& weight, MatrixX<T>* k) {
    const int blocks[2] = {a, b};
    const RowPart<T>* rows[2] = {&row_a, &row_b};
    for (int x = 0; x < 2; ++x) {
      for (int y = 0; y < 2; ++y) {
        for (int i = 0; i < 3 && blocks[x] >= 0; ++i) {
          for (int j = 0; j < 3 && blocks[y] >= 0; ++j) {
            (*k)(3 * blocks[x] + i, 3 * blocks[y] + j) += weight * (*rows[x])[i] * (*rows[y])[j];
          }
        }
      }
    }
  }
};

}  // namespace tangible
