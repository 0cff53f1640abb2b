// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which contacts act on each other at an instant: those where an impulse along a row of one changes
// the speed along a row of the other,
//
//     g = r M⁻¹ (1 − Aᵀ (A M⁻¹ Aᵀ)⁻¹ A M⁻¹) r'ᵀ ≠ 0,
//
// r and r' the normals of the two contacts, and their tangents where they have friction; M the
// masses, A the rows of joints. A disc without friction that meets a floor and a wall at right
// angles has g = 0: neither impact changes the other, so that they have separate times, and their
// order does not matter. With friction at either it has not.

#include <vector>

#include "tangible/lcp/system/contact_problem.h"
#include "tangible/lcp/system/contact_system.h"

namespace tangible {

class CoupledContacts {
 public:
  /// Of a problem of impulses; false where its joints have no solution.
  bool Start(const ContactProblem<double>& problem);
  /// Whether an impulse of contact i moves each contact along its rows; a solve for two loads.
  std::vector<bool> ReachedBy(const ContactProblem<double>& problem, size_t i);

 private:
  ContactSystem system_;
  std::vector<ContactMode> all_open_;
};

/// The number of each contact's group, which are those that act on each other, directly or through
/// others of the problem. All are 0 where `wanted` contacts are all of one group, or the problem's
/// joints have no solution. A solve for each contact at worst, and few where the wanted ones act on
/// each other directly.
std::vector<int> GroupsOfContacts(const ContactProblem<double>& problem,
                                  const std::vector<bool>& wanted);

}  // namespace tangible
