// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// Which of the given contact modes a solution contradicts, one contact at a time.

#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/system/contact_residual.h"

namespace tangible {

/// The mode of a contact that closes, as if it were the only one.
ContactMode ModeOfClosing(const ContactBlock<double>& contact, const ContactValues& values);

/// The mode that a contact should have where its present one is contradicted, and the relative size
/// of the contradiction; 0: there is none.
struct ModeChange {
  ContactMode mode;
  double violation = 0.0;
};

/// For a contact without a driven impulse; `normal` and `tangent` are its impulses, `impulse_scale`
/// the largest normal one, `tolerance` of the residual asked for.
ModeChange Contradiction(const ContactBlock<double>& contact, const ContactValues& values,
                         ContactMode mode, double normal, double tangent, double impulse_scale,
                         double tolerance);

/// Extrapolates the impulses along their last change, from `before`, to slightly beyond the point
/// where the first of them reaches its limit.
void ExtrapolateImpulses(const ContactProblem<double>& problem,
                         const ContactSolution<double>& before, ContactSolution<double>* solution);

}  // namespace tangible
