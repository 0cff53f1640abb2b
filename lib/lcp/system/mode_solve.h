// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// The solution of a contact problem whose modes are given: one linear system,
//   K x = (p, b, −c),   x = (v, y, λ),
// with λt = −σ μ λn where a contact slides, and λn = o where it is driven. The caller has to check
// whether the solution satisfies the inequalities that the modes assume.

#include <limits>
#include <vector>

#include "tangible/lcp/system/contact_system.h"

namespace tangible {

class ModeSolve {
 public:
  /// Factorises `system` with the modes of `solution` and fills in the rest of it; false where the
  /// system is singular. With `centre`, whose impulses are given, the solve is a proximal step from
  /// these: of the impulses that give the same motion it finds those nearest to them. `centre` may
  /// be `solution`. False too where, before refinement, more than `most_beyond` impulses of
  /// contacts plainly exceed their limits (kPlainlyBeyond); only proximal steps look at that.
  bool Solve(const ContactProblem<double>& problem, const ContactSolution<double>* centre,
             ContactSystem* system, ContactSolution<double>* solution,
             int most_beyond = std::numeric_limits<int>::max());
  /// Reserves memory for this many rows.
  void Reserve(size_t rows);

 private:
  int CountBeyond(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes,
                  const std::vector<int>& block_of) const;

  std::vector<double> rhs_, start_, x_;
};

}  // namespace tangible
