// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Planar contact problems, generated from a seed, for which it is known whether they have a
// solution.
//
// Known by theory: with c_n ≥ 0, c_t = 0 and joints at rest (b = 0) the one-sided form
// (lcp/problem.h) is copositive, and every z of its homogeneous problem has Gᵀ z = 0 and zᵀ c = λnᵀ
// c_n ≥ 0: there is a solution for any friction, any rows and any momenta (Cottle, Pang, Stone
// 1992, theorem 3.8.6). Known by construction: speeds, modes and impulses are drawn first, and p,
// c_n, c_t follow from them. Known to have no solution: bodies in a row between two walls that
// approach each other, weights w ≥ 0 on the normal rows with Σ w n = 0 and Σ w c_n < 0.

#include <cstdint>
#include <string>
#include <vector>

#include "tangible/lcp/dense/problem.h"
#include "tangible/lcp/system/contact_problem.h"

namespace tangible::corpus {

/// What is known about a problem, and what the solvers have to achieve.
enum class Known {
  kSolvable,        ///< monotone, a P-matrix, or friction up to 2: all must be solved
  kHardlySolvable,  ///< any other with a solution: 95 % must be solved
  kInfeasible,      ///< must be reported, and proved
  kUnsolvable,      ///< feasible without a solution: must not be called solved
  kUnknown,         ///< must not be answered wrongly
};

struct ContactCase {
  std::string kind;  ///< "stack"
  std::string name;  ///< "stack 17": with the seed it makes the problem again
  Known known = Known::kSolvable;
  ContactProblem<double> problem;
  ContactSolution<double> drawn;  ///< a solution, where it is known by construction
};

/// The kinds, in the order in which they are listed.
const std::vector<std::string>& ContactKinds();

/// Number `index` of a kind, of 1 to `most_contacts` contacts, log-uniform.
ContactCase MakeContactCase(const std::string& kind, std::uint64_t seed, int index,
                            int most_contacts);

/// The same problem in the dense one-sided form: rows (λn, λ+, λ−, γ) of each contact with
/// friction, λn alone of one without.
MixedLcp<double> OneSidedForm(const ContactProblem<double>& problem);

/// A solution of that form as one of the contact problem; the modes are left open.
ContactSolution<double> FromOneSided(const ContactProblem<double>& problem,
                                     const LcpSolution<double>& solution);

}  // namespace tangible::corpus
