// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Closed contacts taken out of a mode system: with D = δ on their diagonal,
//
//   λ = D⁻¹ (c − C v),     (M + Bᵀ D⁻¹ C) v − Aᵀ y = p + Bᵀ D⁻¹ c
//   λ = D⁻¹ (c + B v),     (M + Cᵀ D⁻¹ B) v + Aᵀ y = p − Cᵀ D⁻¹ c      for Kᵀ
//
// What is left to factorise is a graph of bodies (and joints), which does not grow with the points
// of a contact and whose pattern is the same for all modes: of a pyramid of boxes a tenth of the
// work. The price: with δ = 1e-10 of the rows' mobility ten digits are lost, which refinement
// against K brings back, and more where friction is large, for Bᵀ D⁻¹ C is unsymmetric there.

#include <utility>
#include <vector>

#include "tangible/lcp/system/block_lu.h"
#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// The closed contacts of a mode system, as ContactSystem numbers its unknowns.
struct ClosedContacts {
  const ContactProblem<double>& problem;
  const std::vector<ContactMode>& modes;
  const std::vector<int>& block;     ///< of a contact, −1 if open
  const std::vector<double>& delta;  ///< D of those that are not driven (there it is 1), 3 a block
};

/// Whether elimination bears it: there are contacts enough to gain from it, and none slides with
/// large friction.
bool WorthCondensing(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes);

/// Adds an edge for each contact of two moving bodies, open ones too.
void AddContactEdges(const ContactProblem<double>& problem,
                     std::vector<std::pair<int, int>>* edges);

/// Adds Bᵀ D⁻¹ C; `edge` is the first of AddContactEdges.
void AddCondensedContacts(const ClosedContacts& contacts, int edge, BlockLu<double>* lu);

/// The right-hand side of what is left, and from its solution the contacts' unknowns; x row-major
/// of `columns`.
template <bool kTransposed>
void CondenseRightHandSide(const ClosedContacts& contacts, double* x, int columns);
template <bool kTransposed>
void RecoverImpulses(const ClosedContacts& contacts, double* x, int columns);

}  // namespace tangible
