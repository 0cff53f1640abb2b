// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Checks the answers of the solvers from the data alone, in long double, by separate code: the
// solvers' own residuals are not used.
//
// Scales as in lcp/problem.h and lcp/contact_residual.h: a slack by its terms at the speeds that
// cancel in them, an impulse by the largest of its kind or by the impulse that the slack's scale
// would cause, equations by their terms.

#include "tangible/lcp/dense/problem.h"
#include "tangible/lcp/system/contact_problem.h"

namespace tangible::corpus {

/// The largest scaled violation of the equations, of s_n ≥ 0 ⊥ λn ≥ 0 and of Coulomb's law in each
/// contact; the modes are not used. Infinite where a number is not finite or missing.
double RecomputedResidual(const ContactProblem<double>& problem,
                          const ContactSolution<double>& solution);

/// The largest scaled violation of the equations and of s ≥ 0 ⊥ z ≥ 0.
double RecomputedResidual(const MixedLcp<double>& problem, const VectorX<double>& v,
                          const VectorX<double>& y, const VectorX<double>& z);

/// Whether (u, t, w) proves that nothing is feasible: w ≥ 0 and M u + Aᵀ t + Gᵀ w = 0, A u = 0,
/// Fᵀ w ≤ G u to 1e-10 of their terms, and uᵀ p + tᵀ b − wᵀ c above 1e-6 of its terms.
bool ProvesInfeasible(const MixedLcp<double>& problem, const VectorX<double>& farkas);

}  // namespace tangible::corpus
