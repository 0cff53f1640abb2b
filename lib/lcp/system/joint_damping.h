// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// An equivalent form of a mode system for bodies of little inertia far from their joints.
//
// Elimination of such a body leaves A M⁻¹ Aᵀ with entries r²/I, beside which 1/m is lost to
// rounding, although the system is well conditioned: the joint restrains the rotation that inertia
// does not. Multiples of the joints' rows A v = b added to the rows of momentum,
//
//   E K x = E r,   E = [1  Aᵀ w; 0  1],   (E K)₁₁ = M + Aᵀ w A
//
// change nothing in exact arithmetic and give each body the inertia w r² that the joint makes it
// feel; w = 1 / (the row's mobility by translation). The transposed system has Kᵀ u = c with u = Eᵀ
// ũ, (E K)ᵀ ũ = c.

#include "tangible/lcp/system/block_lu.h"
#include "tangible/lcp/system/contact_problem.h"

namespace tangible {

/// Whether at some joint r²/I of a body exceeds 1/m by more than a factor of 1e3, so that
/// elimination would lose more than 1e-13.
bool HasSpreadJoints(const ContactProblem<double>& problem);

/// The problem with Aᵀ w A added as dampers along the rows of every joint.
ContactProblem<double> WithJointDampers(const ContactProblem<double>& problem);

/// x := K⁻¹ x or K⁻ᵀ x (row-major of `columns`, in the order of ContactSystem's unknowns) by the
/// factors of K, or of E K where joints are spread.
void SolveByFactors(const BlockLu<double>& lu, const ContactProblem<double>& problem, double* x,
                    int columns);
void SolveTransposedByFactors(const BlockLu<double>& lu, const ContactProblem<double>& problem,
                              double* x, int columns);

}  // namespace tangible
