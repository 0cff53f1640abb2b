// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How well a mode system (contact_system.h) is determined. This is for certificates, not for the
// inner loop of a simulation.
//
// Everything is measured in units that make bodies and constraints comparable: K̃ = D K D with
// D = M^(-1/2) on bodies and (r M⁻¹ rᵀ)^(-1/2) on a constraint's row r. Then M̃ has a diagonal of 1
// (plus dampers), and the rows of [A; C] have norm 1.

#include "tangible/lcp/system/contact_system.h"

namespace tangible {

/// Rank deficiency of the active rows (joints, normals of closed contacts, tangents of sticking
/// ones): how many impulses are not determined. Joint trees, and other bodies that independent rows
/// attach to a single body, are removed body by body. For each group of bodies that the remaining
/// rows connect, a dense column-pivoted QR of the scaled rows gives the rank:
/// O(rows · 3 bodies · the smaller of both).
int CountRedundantRows(const ContactProblem<double>& problem,
                       const std::vector<ContactMode>& modes);

/// By how much the rank of the directions in which impulses act exceeds that of the active rows.
/// Not 0 where redundant contacts slide with different friction (two feet of a body that cannot
/// turn): their normal impulses are not determined, and here the sum of their friction is not
/// determined either.
int CountUndeterminedMotions(const ContactProblem<double>& problem,
                             const std::vector<ContactMode>& modes);

struct RowGroupSize {
  int bodies = 0;
  int rows = 0;
};

struct UndeterminedCounts {
  bool counted = false;     ///< else the counts are 0
  int impulses = 0;         ///< CountRedundantRows
  int motions = 0;          ///< CountUndeterminedMotions
  double operations = 0.0;  ///< for dense ranks: 2 · rows · 3 bodies · the smaller of both, summed
  RowGroupSize largest;     ///< the group of the most operations
};

/// Both counts, unless a rank takes more operations than the limit; the cost is then linear in
/// bodies and rows.
UndeterminedCounts CountUndetermined(const ContactProblem<double>& problem,
                                     const std::vector<ContactMode>& modes, double most_operations);

struct SystemQuality {
  double condition =
      1.0;  ///< estimate of ‖K̃‖₁ ‖K̃⁻¹‖₁ (Hager's, a lower bound, mostly within a factor of 3)
  double residual =
      0.0;  ///< relative, of the solution of a system whose right-hand side is consistent
};

/// Measures a factorised system by a few solves. Where rows are redundant the condition is that of
/// the regularised system. Source of the estimate: W. W. Hager, SIAM J. Sci. Stat. Comput. 5 (1984)
/// 311.
SystemQuality MeasureSystem(const ContactProblem<double>& problem,
                            const std::vector<ContactMode>& modes, ContactSystem* system);

}  // namespace tangible
