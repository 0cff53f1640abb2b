// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// A solve in Jets beside that in double: of a fixed step, an impact, or accelerations. Implicit:
// the residual R of the problem in Jets at the solution in double, and K ẋ = −Ṙ; unrolled: every
// operation of the interior point. Included only by the files that step in Jets.

#include <vector>

#include "tangible/dynamics/assembly/assembly.h"
#include "tangible/lcp/contact/contact_interior_point.h"
#include "tangible/simulation/events/event_record.h"
#include "tangible/simulation/events/tolerances.h"

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
        AddJointRowTransposed(joint, k, s_.joint_impulse[3 * j + k], load.data());
        Set(3 * (nb + static_cast<int>(j)) + k, joint.rhs[k] - JointRowDot(joint, k, v));
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
    // The normal impulse of rolling friction is no unknown of its own.
    Set(row, c.rolls    ? T(0.0)
             : c.driven ? T(c.offset - normal)
                        : T(-c.c_n - RowDot(c.a, c.normal_a, c.b, c.normal_b, v)));
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

/// The problem of a recorded step at a state in Jets.
template <typename T>
void AssembleInJets(const Model<T>& model, const StepRecord& record, const State<T>& state,
                    ContactProblem<T>* problem) {
  AssemblyScratch<T> scratch;
  if (!record.before.supports.empty() && state.supports.empty()) {
    State<T> with_supports = state;
    with_supports.supports = record.before.supports;
    return AssembleInJets(model, record, with_supports, problem);
  }
  AssembleWithoutContacts(model, state, record.time, record.h, problem, &scratch);
  AssembleContacts(model, state, record.h, record.contacts, record.friction, record.restitution,
                   &scratch, problem);
}

/// The implicit derivative: motion, and normal and sticking impulses, with the values of the
/// solution in double. `signs` as for ImplicitResidual.
template <typename T>
void SolveImplicitly(const ContactProblem<T>& problem, const ContactProblem<double>& in_double,
                     const ContactSolution<double>& solution, const std::vector<double>& signs,
                     ContactSystem* system, ContactSolution<T>* out) {
  constexpr int kWidth = NumDerivatives<T>::value;
  std::vector<double> rhs(3 * static_cast<size_t>(system->num_blocks()) * kWidth, 0.0);
  const std::vector<int>& block_of = system->contact_block();
  ImplicitResidual<T>(problem, solution, signs, block_of, &rhs).Fill();
  system->Solve(in_double, solution.modes, rhs.data(), kWidth);
  const auto jet = [&](double value, size_t row) {
    T x(value);
    for (int d = 0; d < kWidth; ++d) {
      x.v[d] = rhs[row * kWidth + d];
    }
    return x;
  };
  out->motion.resize(solution.motion.size());
  for (size_t i = 0; i < solution.motion.size(); ++i) {
    out->motion[i] = jet(solution.motion[i], i);
  }
  out->joint_impulse.assign(3 * problem.joints.size(), T(0.0));
  for (size_t j = 0; j < problem.joints.size(); ++j) {
    for (size_t r = 0; r < static_cast<size_t>(problem.joints[j].rows); ++r) {
      const size_t row = 3 * (static_cast<size_t>(problem.num_bodies) + j) + r;
      out->joint_impulse[3 * j + r] = jet(solution.joint_impulse[3 * j + r], row);
    }
  }
  out->normal_impulse.assign(problem.contacts.size(), T(0.0));
  out->tangent_impulse.assign(problem.contacts.size(), T(0.0));
  for (size_t i = 0; i < problem.contacts.size(); ++i) {
    if (block_of[i] >= 0) {
      const size_t row = 3 * static_cast<size_t>(block_of[i]);
      out->normal_impulse[i] = problem.contacts[i].rolls ? out->normal_impulse[i - 1]
                                                         : jet(solution.normal_impulse[i], row);
      if (solution.modes[i] == ContactMode::kSticking) {
        out->tangent_impulse[i] = jet(solution.tangent_impulse[i], row + 1);
      }
    }
  }
}

/// Every operation of the interior point; false where it does not converge. The limits of rolling
/// friction are those of the last solution's normal impulses, first of `in_double`, until values
/// and derivatives no longer change.
template <typename T>
bool SolveUnrolled(const ContactProblem<T>& problem, const ContactSolution<double>& in_double,
                   ContactSolution<T>* solution) {
  InteriorPointWorkspace<T> workspace;
  ContactInteriorPointOptions options;
  options.complementarity = kUnrolledComplementarity;
  if (!problem.has_rolling) {
    return SolveContactsByInteriorPoint(problem, options, &workspace, solution).converged;
  }
  constexpr int kMostRounds = 30;
  ContactProblem<T> given = problem;
  given.has_rolling = false;
  std::vector<T> normal(in_double.normal_impulse.begin(), in_double.normal_impulse.end());
  for (int round = 0; round < kMostRounds; ++round) {
    for (size_t i = 1; i < given.contacts.size(); ++i) {
      ContactBlock<T>& block = given.contacts[i];
      if (!problem.contacts[i].rolls) continue;
      block.rolls = false;
      block.offset = normal[i - 1];
      block.has_friction = problem.contacts[i].has_friction && in_double.normal_impulse[i] > 0.0;
    }
    if (!SolveContactsByInteriorPoint(given, options, &workspace, solution).converged) return false;
    double change = 0.0;
    double size = 0.0;
    for (size_t i = 1; i < given.contacts.size(); ++i) {
      if (!problem.contacts[i].rolls) continue;
      if constexpr (requires(const T& x) { x.v.cwiseAbs(); }) {
        const T& next = solution->normal_impulse[i - 1];
        const T difference = next - normal[i - 1];
        const auto largest = [](const T& x) {
          return std::max(std::abs(x.a), x.v.cwiseAbs().maxCoeff());
        };
        change = std::max(change, largest(difference));
        size = std::max(size, largest(next));
      } else {
        change = HUGE_VAL;  // the derivatives of a tape are not known yet
      }
    }
    normal = solution->normal_impulse;
    if (change <= kRollingRounding * size) break;
  }
  return true;
}

}  // namespace tangible
