// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The decompression of an impact by Poisson's law: a contact problem in which each contact has a
// least impulse o, e times its impulse of compression (0: it does not rebound).
//
//   M v − Aᵀ y − Σ (nᵀ λn + tᵀ λt) = p,   A v = b
//   s_n = n v + c_n ≥ 0,   λn ≥ o,   s_n (λn − o) = 0
//   |λt| ≤ μ λn, against the sliding speed t v + c_t
//
// Each contact is open (o = 0 alone), closed (s_n = 0), or driven (λn = o, s_n ≥ 0), and sticks or
// slides like any other contact. Modes that the solution of their linear system contradicts are
// changed and the system is solved again; where that does not converge, the dense portfolio finds
// the modes from the one-sided form. A solution is accepted only by its scaled natural residual.
//
// Pfeiffer, Glocker: Multibody Dynamics with Unilateral Contacts, 1996, ch. 8.

#include <vector>

#include "tangible/lcp/contact/contact_solver.h"

namespace tangible {

class DecompressionSolver {
 public:
  /// The contacts' offsets are given; Solve sets `driven` of each contact and `pushed_load`.
  /// `solution` holds a guess on entry (the compression's modes, sized for the problem) and the
  /// solution on return, its normal impulses with the offsets in them.
  ContactSolverReport Solve(const ContactSolverOptions& options, ContactProblem<double>* problem,
                            ContactSolution<double>* solution);
  /// The mode system of the last solution, factorised with its modes.
  ContactSystem& system() { return system_; }

 private:
  bool SolveByModeChanges(const ContactSolverOptions& options, ContactProblem<double>* problem,
                          ContactSolution<double>* solution, ContactSolverReport* report);

  ContactSystem system_;
  ModeSolve mode_solve_;
  ContactScales scales_;
};

}  // namespace tangible
