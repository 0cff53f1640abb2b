// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// What a solution with given modes says against them, one contact at a time.

#include "tangible/lcp/contact/tolerances.h"
#include "tangible/lcp/system/contact_residual.h"

namespace tangible {

/// The mode of a contact that begins to push: as if it met this contact alone.
ContactMode ModeOfClosing(const ContactBlock<double>& contact, const ContactValues& values);

/// The mode that a contact should have where its present one is contradicted, and by how much
/// (relative); 0: it is not.
struct ModeChange {
  ContactMode mode;
  double violation = 0.0;
};

/// Of a contact without a driven impulse; `normal` and `tangent` are its impulses, `impulse_scale`
/// the largest normal one, `tolerance` of the residual asked for.
ModeChange Contradiction(const ContactBlock<double>& contact, const ContactValues& values,
                         ContactMode mode, double normal, double tangent, double impulse_scale,
                         double tolerance);

/// Moves the impulses on along their last change, from `before`, a little beyond where the first of
/// them meets its limit.
void ExtrapolateImpulses(const ContactProblem<double>& problem,
                         const ContactSolution<double>& before, ContactSolution<double>* solution);

}  // namespace tangible
