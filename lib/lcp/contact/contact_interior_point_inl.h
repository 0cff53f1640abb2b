// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The linear system of an interior-point iteration,
//
//   K = [ M  −Aᵀ  −Bᵀ;  A  0  0;  G  0  F + D(s/z) ],
//
// assembled, and solved with refinement. Included by contact_interior_point_iteration_inl.h alone.

#include <cmath>

#include "tangible/lcp/contact/contact_interior_point.h"
#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {

template <typename T>
class InteriorPointSystem {
 public:
  InteriorPointSystem(const ContactProblem<T>& problem, const ContactInteriorPointOptions& options,
                      InteriorPointWorkspace<T>* w)
      : p_(problem),
        proximal_(options.proximal),
        w_(*w),
        nb_(problem.num_bodies),
        nj_(static_cast<int>(problem.joints.size())),
        nc_(static_cast<int>(problem.contacts.size())) {}

 protected:
  // Maximum number of refinements of a linear solve.
  static constexpr int kMaxRefinements = 3;
  // s / z, and on the impulses' rows a proximal term: redundant contacts give K a condition number
  // of the order of 1 / complementarity. A term on the change of z bounds it and does not change
  // the solution.
  T ContactDiagonal(int row) const {
    const double proximal = row % 3 == 2 ? 0.0 : proximal_ * w_.unit_s[row] / w_.unit_z[row];
    return w_.s[row] / w_.z[row] + proximal;
  }

  // Whether a row of z, s exists: the normal row exists unless λn is given, the others where the
  // contact has friction.
  bool Used(int row) const {
    const ContactBlock<T>& contact = p_.contacts[row / 3];
    return row % 3 == 0 ? !contact.limit_given : contact.has_friction;
  }
  void SetPattern() {
    w_.edges.clear();
    for (const DamperBlock<T>& damper : p_.dampers) {
      if (damper.a >= 0 && damper.b >= 0) {
        w_.edges.emplace_back(damper.a, damper.b);
      }
    }
    int block = nb_;
    const auto add = [&](int a, int b) {
      if (a >= 0) {
        w_.edges.emplace_back(a, block);
      }
      if (b >= 0) {
        w_.edges.emplace_back(b, block);
      }
      ++block;
    };
    for (const JointBlock<T>& joint : p_.joints) {
      add(joint.a, joint.b);
      if (joint.c < 0) continue;
      --block;
      add(joint.c, joint.d);
    }
    for (const ContactBlock<T>& contact : p_.contacts) {
      add(contact.a, contact.b);
    }
    w_.lu.SetPattern(block, nb_, w_.edges);
  }

  void Assemble() {
    w_.lu.SetZero();
    for (int body = 0; body < nb_; ++body) {
      for (int i = 0; i < 3; ++i) {
        w_.lu.Diagonal(body)[4 * i] = p_.mass[3 * body + i];
      }
    }
    int edge = 0;
    for (const DamperBlock<T>& d : p_.dampers) {
      if (d.a >= 0) {
        AddOuter(d.row_a, d.row_a, d.weight, w_.lu.Diagonal(d.a));
      }
      if (d.b >= 0) {
        AddOuter(d.row_b, d.row_b, d.weight, w_.lu.Diagonal(d.b));
      }
      if (d.a >= 0 && d.b >= 0) {
        AddOuter(d.row_a, d.row_b, d.weight, w_.lu.FirstSecond(edge));
        AddOuter(d.row_b, d.row_a, d.weight, w_.lu.SecondFirst(edge));
        ++edge;
      }
    }
    AssembleConstraints(edge);
  }

  void AssembleConstraints(int edge) {
    for (int j = 0; j < nj_; ++j) {
      const JointBlock<T>& joint = p_.joints[j];
      T* diagonal = w_.lu.Diagonal(nb_ + j);
      for (int r = 0; r < 3; ++r) {
        if (r >= joint.rows) {
          diagonal[4 * r] = T(1.0);
        } else if (p_.redundant_joints) {
          // Where joints form loops their rows may be dependent. A proximal term keeps K regular
          // and does not change the solution, as it acts on the change of y only.
          diagonal[4 * r] = T(kProximal * joint.give[r] * JointMobility(p_.mass, joint, r));
        }
      }
      const auto add = [&](const RowPart<T>* rows) {
        for (int r = 0; r < joint.rows; ++r) {
          for (int i = 0; i < 3; ++i) {
            w_.lu.SecondFirst(edge)[3 * r + i] = rows[r][i];
            w_.lu.FirstSecond(edge)[3 * i + r] = -rows[r][i];
          }
        }
        ++edge;
      };
      if (joint.a >= 0) {
        add(joint.row_a);
      }
      if (joint.b >= 0) {
        add(joint.row_b);
      }
      if (joint.c >= 0) {
        add(&joint.row_c);
      }
      if (joint.d >= 0) {
        add(&joint.row_d);
      }
    }
    for (int i = 0; i < nc_; ++i) {
      const ContactBlock<T>& c = p_.contacts[i];
      T* d = w_.lu.Diagonal(nb_ + nj_ + i);
      for (int r = 0; r < 3; ++r) {
        d[4 * r] = Used(3 * i + r) ? ContactDiagonal(3 * i + r) : T(1.0);
      }
      if (c.has_friction) {
        // F = [0 0 0; 0 0 1; 2μ −1 0] beside the diagonal, by rows (contact_problem.h).
        d[5] = T(1.0);
        d[6] = 2.0 * c.friction;
        d[7] = T(-1.0);
      }
      const auto add = [&](const RowPart<T>& normal, const RowPart<T>& tangent) {
        T* row = w_.lu.SecondFirst(edge);
        T* column = w_.lu.FirstSecond(edge);
        for (int k = 0; k < 3; ++k) {
          row[k] = normal[k];
          column[3 * k] = -normal[k];
          if (c.has_friction) {
            row[3 + k] = tangent[k];
            column[3 * k] += c.friction * tangent[k];
            column[3 * k + 1] = -tangent[k];
          }
        }
        ++edge;
      };
      if (c.a >= 0) {
        add(c.normal_a, c.tangent_a);
      }
      if (c.b >= 0) {
        add(c.normal_b, c.tangent_b);
      }
    }
  }

  // step += K⁻¹ (rhs − K step). Near the end, with redundant contacts, the condition number of K is
  // of the order of 1 / complementarity; without refinement the equations drift by 1e-6 and the
  // iteration stalls.
  void Refine() {
    double last = HUGE_VAL;
    for (int round = 0; round < kMaxRefinements; ++round) {
      LinearResidual();
      w_.lu.Solve(w_.correction.data(), 1);
      double size = 0.0;
      for (size_t i = 0; i < w_.step.size(); ++i) {
        size += std::abs(ValueOf(w_.correction[i]));
      }
      if (!(size < last)) {
        break;  // refinement no longer helps, or is not finite
      }
      for (size_t i = 0; i < w_.step.size(); ++i) {
        w_.step[i] += w_.correction[i];
      }
      last = 0.1 * size;
    }
  }

  // correction := rhs − K step.
  void LinearResidual() {
    w_.correction = w_.rhs;
    T* r = w_.correction.data();
    const T* x = w_.step.data();
    for (int i = 0; i < 3 * nb_; ++i) {
      r[i] -= p_.mass[i] * x[i];
    }
    for (const DamperBlock<T>& d : p_.dampers) {
      const T impulse = -d.weight * RowDot(d.a, d.row_a, d.b, d.row_b, x);
      AddRowTransposed(d.a, d.row_a, d.b, d.row_b, impulse, r);
    }
    for (int j = 0; j < nj_; ++j) {
      const JointBlock<T>& joint = p_.joints[j];
      const int at = 3 * (nb_ + j);
      for (int k = 0; k < joint.rows; ++k) {
        AddJointRowTransposed(joint, k, x[at + k], r);
        r[at + k] -= JointRowDot(joint, k, x);
      }
    }
    for (int i = 0; i < nc_; ++i) {
      const ContactBlock<T>& c = p_.contacts[i];
      const int at = 3 * (nb_ + nj_ + i);
      const T* dz = x + at;
      AddRowTransposed(c.a, c.normal_a, c.b, c.normal_b, dz[0], r);
      r[at] -= RowDot(c.a, c.normal_a, c.b, c.normal_b, x) +
               (Used(3 * i) ? ContactDiagonal(3 * i) : T(1.0)) * dz[0];
      if (c.has_friction) {
        const T tangential = dz[1] - c.friction * dz[0];
        AddRowTransposed(c.a, c.tangent_a, c.b, c.tangent_b, tangential, r);
        r[at + 1] -= RowDot(c.a, c.tangent_a, c.b, c.tangent_b, x) + dz[2] +
                     ContactDiagonal(3 * i + 1) * dz[1];
        r[at + 2] -= 2.0 * c.friction * dz[0] - dz[1] + ContactDiagonal(3 * i + 2) * dz[2];
      }
    }
  }

  const ContactProblem<T>& p_;
  const double proximal_;
  InteriorPointWorkspace<T>& w_;
  const int nb_, nj_, nc_;
};

}  // namespace tangible
