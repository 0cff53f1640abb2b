// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The residual of a contact problem in Jets at the solution in double, the right-hand side of the
// implicit derivative K ẋ = −Ṙ. Included only by the files that step in Jets.

#include <vector>

#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// Derivatives of −R at the double solution: the right-hand side, row-major (3 num_blocks, N).
template <typename T>
class ImplicitResidual {
 public:
  /// `signs`: σ of each closed contact in λt = −σ μ λn.
  ImplicitResidual(const ContactProblem<T>& problem, const ContactSolution<double>& solution,
                   const std::vector<double>& signs, const std::vector<int>& contact_block,
                   std::vector<double>* rhs)
      : p_(problem), s_(solution), signs_(signs), contact_block_(contact_block), rhs_(*rhs) {}

  void Fill() {
    const int nb = p_.num_bodies;
    std::vector<T> load(3 * nb);
    const double* v = s_.motion.data();
    for (int i = 0; i < 3 * nb; ++i) {
      load[i] = p_.load[i] - p_.mass[i] * v[i];
    }
    for (const DamperBlock<T>& d : p_.dampers) {
      const T impulse = -d.weight * RowDot(d.a, d.row_a, d.b, d.row_b, v);
      AddRowTransposed(d.a, d.row_a, d.b, d.row_b, impulse, load.data());
    }
    for (size_t j = 0; j < p_.joints.size(); ++j) {
      const JointBlock<T>& joint = p_.joints[j];
      for (int k = 0; k < joint.rows; ++k) {
        AddRowTransposed(joint.a, joint.row_a[k], joint.b, joint.row_b[k],
                         s_.joint_impulse[3 * j + k], load.data());
        Set(3 * (nb + static_cast<int>(j)) + k,
            joint.rhs[k] - RowDot(joint.a, joint.row_a[k], joint.b, joint.row_b[k], v));
      }
    }
    for (size_t i = 0; i < p_.contacts.size(); ++i) {
      if (contact_block_[i] >= 0) {
        Contact(static_cast<int>(i), &load);
      }
    }
    for (int i = 0; i < 3 * nb; ++i) {
      Set(i, load[i]);
    }
  }

 private:
  void Set(int row, const T& value) {
    for (int k = 0; k < NumDerivatives<T>::value; ++k) {
      rhs_[row * NumDerivatives<T>::value + k] = value.v[k];
    }
  }

  void Contact(int i, std::vector<T>* load) {
    const ContactBlock<T>& c = p_.contacts[i];
    const double* v = s_.motion.data();
    const int row = 3 * contact_block_[i];
    const double normal = s_.normal_impulse[i];
    AddRowTransposed(c.a, c.normal_a, c.b, c.normal_b, normal, load->data());
    Set(row,
        c.driven ? T(c.offset - normal) : T(-c.c_n - RowDot(c.a, c.normal_a, c.b, c.normal_b, v)));
    const T slip = c.c_t + RowDot(c.a, c.tangent_a, c.b, c.tangent_b, v);
    T tangent(s_.tangent_impulse[i]);
    if (s_.modes[i] == ContactMode::kSticking) {
      Set(row + 1, -slip);
    } else {
      tangent = -signs_[i] * normal * c.friction;
    }
    AddRowTransposed(c.a, c.tangent_a, c.b, c.tangent_b, tangent, load->data());
  }

  const ContactProblem<T>& p_;
  const ContactSolution<double>& s_;
  const std::vector<double>& signs_;
  const std::vector<int>& contact_block_;
  std::vector<double>& rhs_;
};

/// σ of each contact by its mode; a sliding contact without friction has the sign of its sliding
/// too, which gives the one-sided derivative as μ increases from 0.
inline std::vector<double> SlidingSigns(const ContactProblem<double>& problem,
                                        const ContactSolution<double>& solution) {
  std::vector<double> signs(problem.contacts.size());
  for (size_t i = 0; i < signs.size(); ++i) {
    signs[i] = solution.modes[i] == ContactMode::kClosed
                   ? FrictionlessSlidingSign(problem, problem.contacts[i], solution.motion.data())
                   : SlidingSign(solution.modes[i]);
  }
  return signs;
}

}  // namespace tangible
