// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How well a mode system (contact_system.h) is determined: for certificates, not for the hot path.
//
// All is measured in units in which bodies and constraints are alike: K̃ = D K D with D = M^(-1/2)
// on bodies and (r M⁻¹ rᵀ)^(-1/2) on a constraint's row r. Then M̃ has a diagonal of 1 (plus
// dampers), and the rows of [A; C] have norm 1.

#include "tangible/lcp/system/contact_system.h"

namespace tangible {

/// Rank deficiency of the active rows (joints, normals of closed contacts, tangents of sticking
/// ones): how many impulses are not determined. Joint trees and what else hangs on one body by
/// independent rows are taken off body by body; of each group of bodies that the other rows connect
/// a column-pivoted QR of the scaled rows, dense: O(rows · 3 bodies · the smaller of both).
int CountRedundantRows(const ContactProblem<double>& problem,
                       const std::vector<ContactMode>& modes);

/// By how much the rank of the directions in which impulses act exceeds that of the active rows.
/// Not 0 where redundant contacts slide with different friction (two feet of a body that cannot
/// turn): their normal impulses are not determined, and here neither is the friction that they sum
/// to.
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
  double operations = 0.0;  ///< of dense ranks: 2 · rows · 3 bodies · the smaller of both, summed
  RowGroupSize largest;     ///< the group of the most operations
};

/// Both counts, unless a rank takes more operations than that; what is then done is linear in
/// bodies and rows.
UndeterminedCounts CountUndetermined(const ContactProblem<double>& problem,
                                     const std::vector<ContactMode>& modes, double most_operations);

struct SystemQuality {
  double condition =
      1.0;  ///< estimate of ‖K̃‖₁ ‖K̃⁻¹‖₁ (Hager's, a lower bound, mostly within a factor of 3)
  double residual =
      0.0;  ///< relative, of the solution of a system whose right-hand side is consistent
};

/// Of a factorised system: a few solves. Where rows are redundant the condition is that of the
/// regularised system. Source of the estimate: W. W. Hager, SIAM J. Sci. Stat. Comput. 5 (1984)
/// 311.
SystemQuality MeasureSystem(const ContactProblem<double>& problem,
                            const std::vector<ContactMode>& modes, ContactSystem* system);

}  // namespace tangible
