// SPDX-License-Identifier: Apache-2.0
#pragma once
//
// How contacts share the forces at the start of a motion by events, for judging which of them are
// at a limit.

#include "tangible/lcp/contact/contact_inner_impulses.h"
#include "tangible/simulation/events/event_record.h"

namespace tangible {

/// The accelerations' solution at the start of a segment, with one of the shares that redundant
/// contacts can have of its forces, at which the fewest are at a limit. The force of a contact that
/// slides is determined, whatever its slip's rate.
ContactSolution<double> ShareAtStart(const Model<double>& model, const Segment& segment,
                                     InnerImpulses* inner_impulses);

/// Whether the bodies of a contact are at rest on supports, or do not move at all: these may
/// squeeze it, and need not.
bool SupportsHoldBoth(const ModelStructure& structure, const State<double>& state,
                      const ActiveContact& contact);

/// The normal force that a contact of a segment surely has at its start, N: of bodies that supports
/// hold that of the segment's solution, which squeezes them by no more than it must, else that of
/// the share.
double SureNormal(const ModelStructure& structure, const Segment& segment, size_t contact,
                  const ContactSolution<double>& share);

}  // namespace tangible
