// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Elimination of the closed contacts from a mode system: with D = δ on their diagonal,
//
//   λ = D⁻¹ (c − C v),     (M + Bᵀ D⁻¹ C) v − Aᵀ y = p + Bᵀ D⁻¹ c
//   λ = D⁻¹ (c + B v),     (M + Cᵀ D⁻¹ B) v + Aᵀ y = p − Cᵀ D⁻¹ c      for Kᵀ
//
// The matrix that remains to be factorised is a graph of bodies (and joints), which does not grow
// with the number of contact points and whose pattern is the same for all modes: for a pyramid of
// boxes this is a tenth of the work. The disadvantage: with δ = 1e-10 of the rows' mobility ten
// digits are lost, which refinement against K restores, and more where friction is large, because
// Bᵀ D⁻¹ C is unsymmetric there.

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
  const std::vector<double>& delta;  ///< D, 3 for each block; 1 where driven
};

/// Whether elimination of the contacts pays and is accurate: there are enough contacts to save
/// work, and none slides with large friction.
bool WorthCondensing(const ContactProblem<double>& problem, const std::vector<ContactMode>& modes);

/// Adds an edge for each contact of two moving bodies, open ones too.
void AddContactEdges(const ContactProblem<double>& problem,
                     std::vector<std::pair<int, int>>* edges);

/// Adds Bᵀ D⁻¹ C; `edge` is the first of AddContactEdges.
void AddCondensedContacts(const ClosedContacts& contacts, int edge, BlockLu<double>* lu);

/// The right-hand side of the remaining system, and from its solution the contacts' unknowns; x is
/// row-major of `columns`.
template <bool kTransposed>
void CondenseRightHandSide(const ClosedContacts& contacts, double* x, int columns);
template <bool kTransposed>
void RecoverImpulses(const ClosedContacts& contacts, double* x, int columns);

}  // namespace tangible
